#include "render/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/index.h"

namespace duet::render {
namespace {

using Plane = std::vector<double>;

void require_same_size(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height)
    throw Error(ExitStatus::usage, fmt::format("pictures of {} x {} and {} x {} pixels cannot be compared",
                                               a.width, a.height, b.width, b.height));
}

std::size_t pixel_count(const Picture& picture) { return picture.rgb.size() / 3; }

// Returns the largest difference among the channels of a pixel, 0 to 255.
int pixel_difference(const Picture& a, const Picture& b, std::size_t pixel) {
  int largest = 0;
  for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i)
    largest = std::max(largest, std::abs(a.rgb[i] - b.rgb[i]));
  return largest;
}

// Returns the luma by Rec. 709, in [0, 1].
double luma(const Picture& picture, std::size_t pixel) {
  const unsigned char* p = picture.rgb.data() + 3 * pixel;
  return (0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]) / 255;
}

// Counts the marked pixels that are connected with `start` by sides or corners, and unmarks them.
int take_patch(std::vector<bool>& marked, int width, int height, int start) {
  std::vector<int> waiting = {start};
  marked[as_index(start)] = false;
  int count = 0;
  while (!waiting.empty()) {
    const int here = waiting.back(), x = here % width, y = here / width;
    waiting.pop_back();
    ++count;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
        const int next = v * width + u;
        if (!marked[as_index(next)]) continue;
        marked[as_index(next)] = false;
        waiting.push_back(next);
      }
  }
  return count;
}

// Computes means over a Gaussian window of 11 x 11 pixels with the standard deviation 1.5, as in Wang et al.
// 2004. At the border of the picture only the part of the window that lies inside counts.
class GaussianMean {
 public:
  GaussianMean(int width, int height) : width_(width), height_(height) {
    for (int i = -radius; i <= radius; ++i)
      weights_[as_index(i + radius)] = std::exp(-i * i / (2 * 1.5 * 1.5));
  }
  Plane operator()(const Plane& values) const {
    return along(along(values, width_, height_, 1, width_), height_, width_, width_, 1);
  }

 private:
  static constexpr int radius = 5;

  // Computes means along lines of `length` values that lie `step` apart; the lines begin `line_step` apart.
  Plane along(const Plane& values, int length, int lines, int step, int line_step) const {
    Plane means(values.size());
    for (int line = 0; line < lines; ++line)
      for (int i = 0; i < length; ++i) {
        double sum = 0, weight = 0;
        for (int k = std::max(-radius, -i); k <= std::min(radius, length - 1 - i); ++k) {
          const double w = weights_[as_index(k + radius)];
          sum += w * values[as_index(line * line_step + (i + k) * step)];
          weight += w;
        }
        means[as_index(line * line_step + i * step)] = sum / weight;
      }
    return means;
  }

  int width_, height_;
  std::array<double, 2 * radius + 1> weights_{};
};

Plane product(const Plane& a, const Plane& b) {
  Plane result(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) result[i] = a[i] * b[i];
  return result;
}

// Returns the mean structural similarity of the luma (Wang, Bovik, Sheikh and Simoncelli 2004, eq. 13), with
// the constants of that paper.
double structural_similarity(const Picture& a, const Picture& b) {
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  Plane x(pixel_count(a)), y(pixel_count(b));
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = luma(a, i);
    y[i] = luma(b, i);
  }
  const GaussianMean mean(a.width, a.height);
  const Plane mean_x = mean(x), mean_y = mean(y);
  const Plane mean_xx = mean(product(x, x)), mean_yy = mean(product(y, y)), mean_xy = mean(product(x, y));
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double xx = mean_x[i] * mean_x[i], yy = mean_y[i] * mean_y[i], xy = mean_x[i] * mean_y[i];
    sum += (2 * xy + c1) * (2 * (mean_xy[i] - xy) + c2) /
           ((xx + yy + c1) * ((mean_xx[i] - xx) + (mean_yy[i] - yy) + c2));
  }
  return sum / static_cast<double>(x.size());
}

// Returns the color (0 to 255) of a difference of 1 to 255.
std::array<double, 3> heat(int difference) {
  // Colors of the differences 1, 16, 128 and 256, and the logarithms of these to the base 2.
  static constexpr std::array<std::array<double, 3>, 4> scale = {
      {{30, 60, 200}, {215, 30, 40}, {255, 165, 20}, {255, 255, 215}}};
  static constexpr std::array<double, 4> places = {0, 4, 7, 8};
  const double place = std::log2(difference);
  const std::size_t i = place < places[1] ? 0 : place < places[2] ? 1 : 2;
  const double t = (place - places[i]) / (places[i + 1] - places[i]);
  std::array<double, 3> color{};
  for (std::size_t k = 0; k < 3; ++k) color[k] = (1 - t) * scale[i][k] + t * scale[i + 1][k];
  return color;
}

}  // namespace

Difference compare(const Picture& a, const Picture& b, int tolerance) {
  require_same_size(a, b);
  Difference result;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const double d = std::abs(a.rgb[i] - b.rgb[i]) / 255.0;
    result.maximum = std::max(result.maximum, d);
    sum += d;
    squares += d * d;
  }
  if (result.maximum == 0) return result;
  result.mean = sum / static_cast<double>(a.rgb.size());
  result.rmse = std::sqrt(squares / static_cast<double>(a.rgb.size()));
  result.ssim = structural_similarity(a, b);

  std::vector<bool> different(pixel_count(a));
  for (std::size_t i = 0; i < different.size(); ++i) different[i] = pixel_difference(a, b, i) > tolerance;
  result.share = static_cast<double>(std::count(different.begin(), different.end(), true)) /
                 static_cast<double>(different.size());
  for (std::size_t i = 0; i < different.size(); ++i)
    if (different[i])
      result.max_patch =
          std::max(result.max_patch, take_patch(different, a.width, a.height, static_cast<int>(i)));
  return result;
}

std::string broken_bounds(const Difference& difference, const DifferenceBounds& bounds) {
  std::vector<std::string> broken;
  if (!(difference.rmse <= bounds.rmse))
    broken.push_back(fmt::format("RMSE {:.3g} > {:.3g}", difference.rmse, bounds.rmse));
  if (!(difference.share <= bounds.share))
    broken.push_back(fmt::format("{:.3g} % of the pixels off by more than {}/255 > {:.3g} %",
                                 100 * difference.share, bounds.tolerance, 100 * bounds.share));
  if (difference.max_patch > bounds.max_patch)
    broken.push_back(fmt::format("a patch of {} such pixels > {}", difference.max_patch, bounds.max_patch));
  if (!(difference.ssim >= bounds.min_ssim))
    broken.push_back(fmt::format("SSIM {:.4g} < {:.4g}", difference.ssim, bounds.min_ssim));
  return fmt::format("{}", fmt::join(broken, ", "));
}

Picture difference_picture(const Picture& a, const Picture& b) {
  require_same_size(a, b);
  constexpr double dark = 0.3 * 255;  // brightness of white where the pictures are equal
  Picture result{a.width, a.height, std::vector<unsigned char>(a.rgb.size())};
  for (std::size_t i = 0; i < pixel_count(a); ++i) {
    const int difference = pixel_difference(a, b, i);
    const double gray = dark * luma(a, i);
    const std::array<double, 3> color =
        difference > 0 ? heat(difference) : std::array<double, 3>{gray, gray, gray};
    for (std::size_t k = 0; k < 3; ++k) result.rgb[3 * i + k] = static_cast<unsigned char>(color[k]);
  }
  return result;
}

}  // namespace duet::render
