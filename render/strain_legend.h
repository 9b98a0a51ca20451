// The color scale of pictures that show strain.
#pragma once

#include <vector>

namespace duet::render {

/// Draws the color scale of strain into the lower left corner of a picture. The bar runs from no strain to
/// render.strain_range; a square beside it has the color of inverted elements. `rgb` has 3 * width * height
/// bytes of 8-bit sRGB in rows from the top. Parts that do not fit are left out.
void draw_strain_legend(std::vector<unsigned char>& rgb, int width, int height);

}  // namespace duet::render
