// The color scale of pictures that show strain, stress or contact.
#pragma once

#include <vector>

namespace duet::render {

/// Whether a color scale has a square in the color of inverted elements.
enum class InvertedSquare { absent, present };

/// Draws the color scale of values into the lower left corner of a picture. The bar runs from 0 to
/// Render::range_of_color(); a square in the color of inverted elements may stand beside it. `rgb` has
/// 3 * width * height bytes of 8-bit sRGB in rows from the top. Parts that do not fit are left out.
void draw_legend(std::vector<unsigned char>& rgb, int width, int height, InvertedSquare square);

}  // namespace duet::render
