// From linear light to the bytes of a picture.
#pragma once

#include <cstdint>
#include <vector>

namespace duet::render {

// The sRGB transfer function (IEC 61966-2-1) of a linear value in [0, 1]; values outside are clamped, NaN
// gives 0.
double srgb_encode(double linear);

// Encodes linear values, 65535 being white, into 8-bit sRGB. Rows of `rgba` start at the bottom, as OpenGL
// has them; rows of the result at the top, three bytes a pixel. A fixed pattern of less than one step decides
// which of the two nearest bytes stands for a value, so that slow gradients show no bands.
std::vector<unsigned char> encode_picture(const std::vector<std::uint16_t>& rgba, int width, int height);

}  // namespace duet::render
