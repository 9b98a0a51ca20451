#include "render/strain_legend.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/color.h"
#include "render/looks.h"
#include "sim/base/assert.h"

namespace duet::render {

void draw_legend(std::vector<unsigned char>& rgb, int width, int height, InvertedSquare square) {
  DUET_ASSERT(width > 0 && height > 0);
  DUET_ASSERT(rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const int side = std::max(4, height / 36);  // pixels; side of the red square, and width of the margin
  const int length = std::min(8 * side, width - 4 * side);
  const auto fill = [&](int x, const Vec3& color) {
    if (x < 0 || x >= width) return;
    for (int y = std::max(0, height - 2 * side); y < height - side; ++y) {
      unsigned char* pixel = rgb.data() + 3 * (static_cast<std::ptrdiff_t>(y) * width + x);
      for (int channel = 0; channel < 3; ++channel)
        pixel[channel] = static_cast<unsigned char>(std::lround(255 * srgb_encode(color[channel])));
    }
  };
  for (int i = 0; i < length; ++i) {
    const double share = (i + 0.5) / length;
    fill(side + i, (1 - share) * low_color + share * high_color);
  }
  if (square == InvertedSquare::absent) return;
  for (int i = 0; i < side; ++i) fill(side + length + side / 2 + i, inverted_color);
}

}  // namespace duet::render
