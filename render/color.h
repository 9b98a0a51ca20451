// Conversion of linear light to the sRGB bytes of a picture.
#pragma once

#include <cstdint>
#include <vector>

namespace duet::render {

/// Maps a linear value in [0, 1] to its sRGB value in [0, 1] (IEC 61966-2-1). Values outside are clamped, and
/// NaN gives 0.
double srgb_encode(double linear);

/// Encodes a picture of linear values, of which 65535 is white, as 8-bit sRGB. `rgba` has 4 * width * height
/// numbers in rows from the bottom, as OpenGL has them; the result has 3 * width * height bytes in rows from
/// the top, without alpha. Ordered dithering by less than one step decides which of the two nearest bytes
/// stands for a value, so that slow gradients show no bands.
std::vector<unsigned char> encode_picture(const std::vector<std::uint16_t>& rgba, int width, int height);

}  // namespace duet::render
