#include "render/color.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/base/assert.h"

namespace duet::render {
namespace {

// Returns the sRGB value of each 16-bit linear value, in steps of 1/256 of a byte.
std::vector<std::uint16_t> make_encoding_table() {
  std::vector<std::uint16_t> table(65536);
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] =
        static_cast<std::uint16_t>(std::lround(255 * 256 * srgb_encode(static_cast<double>(i) / 65535)));
  return table;
}

// Side of the dithering pattern (pixels).
constexpr int pattern_side = 8;

// Bayer's ordered dithering pattern: a permutation of 0 to 63 over an 8 x 8 block in which neighboring
// numbers lie far apart.
constexpr int bayer(int x, int y) {
  int value = 0;
  for (int bit = 0; bit < 3; ++bit) {
    const int bx = (x >> bit) & 1, by = (y >> bit) & 1;
    value = 4 * value + 2 * (bx ^ by) + by;
  }
  return value;
}

// Returns what is added to a value before its fraction of a byte is cut off, in steps of 1/256: 2 to 254, 128
// on average.
std::array<int, pattern_side * pattern_side> make_thresholds() {
  std::array<int, pattern_side * pattern_side> thresholds{};
  for (int y = 0; y < pattern_side; ++y)
    for (int x = 0; x < pattern_side; ++x)
      thresholds[static_cast<std::size_t>(y * pattern_side + x)] = 2 + 4 * bayer(x, y);
  return thresholds;
}

}  // namespace

double srgb_encode(double linear) {
  if (!(linear > 0)) return 0;
  if (linear >= 1) return 1;
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

std::vector<unsigned char> encode_picture(const std::vector<std::uint16_t>& rgba, int width, int height) {
  DUET_ASSERT(width > 0 && height > 0);
  DUET_ASSERT(rgba.size() == 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  static const std::vector<std::uint16_t> table = make_encoding_table();
  static const std::array<int, pattern_side* pattern_side> thresholds = make_thresholds();
  std::vector<unsigned char> picture;
  picture.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    const std::uint16_t* pixel =
        rgba.data() + 4 * static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width);
    const int* row = thresholds.data() + (y % pattern_side) * pattern_side;
    for (int x = 0; x < width; ++x, pixel += 4)
      for (int channel = 0; channel < 3; ++channel)
        picture.push_back(static_cast<unsigned char>((table[pixel[channel]] + row[x % pattern_side]) >> 8));
  }
  return picture;
}

}  // namespace duet::render
