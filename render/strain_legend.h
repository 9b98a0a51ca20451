// The scale of a picture that shows strain.
#pragma once

#include <vector>

namespace duet::render {

// Draws a bar into the lower left corner of an 8-bit sRGB picture, top row first: from no strain to
// render.strain_range, and apart from it the colour of inverted elements.
void draw_strain_legend(std::vector<unsigned char>& rgb, int width, int height);

}  // namespace duet::render
