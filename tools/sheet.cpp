#include "tools/sheet.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::tools {
namespace {

constexpr int gap = 4;                    // pixels between the pictures of a sheet
constexpr unsigned char gap_level = 255;  // white
constexpr int max_columns = 5;            // largest number of pictures in a row of a sheet
// Largest number of pixels of a sheet: 1.5 GB, or twice a picture of the largest size (16384 x 16384).
constexpr std::int64_t max_pixels =
    512LL * 1024 * 1024;  // of a sheet, 1.5 GB: twice a picture of the largest size

// Returns the number of columns of a sheet of `count` pictures: at least as many as rows and, among these,
// the number that leaves the fewest places empty.
int columns_of(int count) {
  int fewest = 1;
  while (fewest * fewest < count) ++fewest;
  int best = fewest;
  const auto empty = [&](int columns) { return (count + columns - 1) / columns * columns - count; };
  for (int columns = fewest; columns <= max_columns; ++columns)
    if (empty(columns) < empty(best)) best = columns;
  return best;
}

}  // namespace

Sheet::Sheet(int count, int width, int height) : columns_(columns_of(count)), width_(width), height_(height) {
  const int rows = (count + columns_ - 1) / columns_;
  const std::int64_t all_width = std::int64_t{columns_} * (width + gap) - gap,
                     all_height = std::int64_t{rows} * (height + gap) - gap;
  if (all_width * all_height > max_pixels)
    throw Error(ExitStatus::usage,
                fmt::format("a sheet of {} x {} pixels is too large (give a smaller --width "
                            "and --height, or fewer --moments)",
                            all_width, all_height));
  picture_.width = static_cast<int>(all_width);
  picture_.height = static_cast<int>(all_height);
  picture_.rgb.assign(static_cast<std::size_t>(3 * all_width * all_height), gap_level);
}

void Sheet::add(const std::vector<unsigned char>& rgb) {
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(width_);
  const int left = count_ % columns_ * (width_ + gap), top = count_ / columns_ * (height_ + gap);
  for (int y = 0; y < height_; ++y) {
    const std::size_t to = 3 * (static_cast<std::size_t>(top + y) * static_cast<std::size_t>(picture_.width) +
                                static_cast<std::size_t>(left));
    std::copy_n(rgb.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(y) * row_bytes), row_bytes,
                picture_.rgb.begin() + static_cast<std::ptrdiff_t>(to));
  }
  ++count_;
}

render::Picture shrunk(const render::Picture& picture, int factor) {
  render::Picture small{picture.width / factor, picture.height / factor, {}};
  const auto width = static_cast<std::size_t>(picture.width);
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      for (int channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int i = 0; i < factor * factor; ++i) {
          const int row = y * factor + i / factor, column = x * factor + i % factor;
          sum += picture.rgb[3 * (static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)) +
                             static_cast<std::size_t>(channel)];
        }
        small.rgb.push_back(static_cast<unsigned char>((sum + factor * factor / 2) / (factor * factor)));
      }
  return small;
}

}  // namespace duet::tools
