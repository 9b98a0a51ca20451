// Tests of measures of difference between pictures whose values are known on paper.
#include "render/compare.h"

#include <cmath>

#include <gtest/gtest.h>

#include "sim/base/error.h"

namespace duet::render::compare_test {
namespace {

Picture uniform(int width, int height, int r, int g, int b) {
  Picture picture{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    for (const int channel : {r, g, b}) picture.rgb.push_back(static_cast<unsigned char>(channel));
  return picture;
}

Picture gray(int width, int height, int value) { return uniform(width, height, value, value, value); }

// Returns channel `c` (0: red) of the pixel at (x, y), counted from the upper left.
unsigned char& channel(Picture& picture, int x, int y, int c) {
  return picture.rgb[static_cast<std::size_t>(3 * (y * picture.width + x) + c)];
}

TEST(Compare, APictureEqualsItself) {
  const Picture a = uniform(20, 10, 200, 30, 90);
  const Difference d = compare(a, a);
  EXPECT_EQ(d.maximum, 0);
  EXPECT_EQ(d.mean, 0);
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.share, 0);
  EXPECT_EQ(d.max_patch, 0);
  EXPECT_EQ(d.ssim, 1);
  EXPECT_EQ(broken_bounds(d, {}), "");
}

// One of three channels is off by 51/255 = 0.2 in all pixels: the mean is 0.2 / 3 and the root mean square
// 0.2 / sqrt(3).
TEST(Compare, AUniformDifferenceHasItsOwnValue) {
  const Difference d = compare(uniform(20, 10, 100, 50, 50), uniform(20, 10, 151, 50, 50));
  EXPECT_DOUBLE_EQ(d.maximum, 0.2);
  EXPECT_NEAR(d.mean, 0.2 / 3, 1e-15);
  EXPECT_NEAR(d.rmse, 0.2 / std::sqrt(3), 1e-15);
  EXPECT_EQ(d.share, 1);
  EXPECT_EQ(d.max_patch, 200);
}

// One of 100 pixels is off by 1 in all channels: the mean is 0.01 and the root mean square 0.1.
TEST(Compare, ASingleDifferenceIsAveraged) {
  const Picture a = gray(10, 10, 0);
  Picture b = a;
  for (int c = 0; c < 3; ++c) channel(b, 9, 9, c) = 255;
  const Difference d = compare(a, b);
  EXPECT_NEAR(d.mean, 0.01, 1e-15);
  EXPECT_NEAR(d.rmse, 0.1, 1e-15);
  EXPECT_EQ(d.share, 0.01);
  EXPECT_EQ(d.max_patch, 1);
  EXPECT_LT(d.ssim, 1);
}

TEST(Compare, OnlyPixelsBeyondTheToleranceCount) {
  const Picture a = gray(10, 10, 100);
  Picture b = a;
  channel(b, 1, 1, 0) = 104;
  channel(b, 5, 5, 1) = 95;
  EXPECT_EQ(compare(a, b, 4).share, 0.01);
  EXPECT_EQ(compare(a, b, 3).share, 0.02);
  EXPECT_EQ(compare(a, b, 5).share, 0);
}

TEST(Compare, PatchesConnectBySidesAndCorners) {
  const Picture a = gray(12, 9, 100);
  Picture b = a;
  for (const auto& [x, y] : {std::pair(0, 0), {1, 1}, {2, 0}, {3, 1}, {3, 2}}) channel(b, x, y, 2) = 0;
  for (const auto& [x, y] : {std::pair(5, 4), {11, 0}, {0, 1 + 5}, {11, 8}, {10, 8}, {0, 8}})
    channel(b, x, y, 0) = 0;  // The left and right borders of the picture do not connect.
  const Difference d = compare(a, b);
  EXPECT_EQ(d.max_patch, 5);
  EXPECT_DOUBLE_EQ(d.share, 11.0 / (12 * 9));
}

// For two flat pictures, structural similarity is its luminance term (2 x y + c1) / (x^2 + y^2 + c1), at the
// border as in the middle.
TEST(Compare, StructuralSimilarityOfFlatPictures) {
  const double x = 51 / 255.0, y = 153 / 255.0, c1 = 1e-4;
  EXPECT_NEAR(compare(gray(17, 13, 51), gray(17, 13, 153)).ssim, (2 * x * y + c1) / (x * x + y * y + c1),
              1e-12);
}

// Two pictures have the same brightness and opposite structure, so that their structural similarity is near
// -1.
TEST(Compare, StructuralSimilaritySeesStructure) {
  Picture a = gray(32, 32, 100), b = a, faint = a;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c) {
        const bool odd = ((x + y) & 1) != 0;
        channel(a, x, y, c) = odd ? 150 : 50;
        channel(b, x, y, c) = odd ? 50 : 150;
        channel(faint, x, y, c) = odd ? 149 : 51;
      }
  EXPECT_LT(compare(a, b).ssim, -0.9);
  EXPECT_GT(compare(a, faint).ssim, 0.999);
  EXPECT_DOUBLE_EQ(compare(a, b).ssim, compare(b, a).ssim);
}

TEST(Compare, EveryBoundCanBeBroken) {
  const Difference good{
      .maximum = 0.9, .mean = 0.9, .rmse = 0.0005, .share = 0.001, .max_patch = 7, .ssim = 0.5};
  EXPECT_EQ(broken_bounds(good, {}), "") << "what lies on a bound passes";
  Difference d = good;
  d.rmse = 0.00051;
  EXPECT_EQ(broken_bounds(d, {}), "RMSE 0.00051 > 0.0005");
  d = good;
  d.share = 0.0011;
  EXPECT_EQ(broken_bounds(d, {}), "0.11 % of the pixels off by more than 4/255 > 0.1 %");
  d = good;
  d.max_patch = 8;
  EXPECT_EQ(broken_bounds(d, {}), "a patch of 8 such pixels > 7");
  EXPECT_EQ(broken_bounds(good, {.min_ssim = 0.6}), "SSIM 0.5 < 0.6");
  d.rmse = std::nan("");
  EXPECT_EQ(broken_bounds(d, {}), "RMSE nan > 0.0005, a patch of 8 such pixels > 7");
}

TEST(Compare, TheDifferencePictureShowsWhereAndHowMuch) {
  const Picture a = gray(3, 1, 255);
  Picture b = a;
  channel(b, 1, 0, 2) = 254;
  channel(b, 2, 0, 2) = 0;
  const Picture shown = difference_picture(a, b);
  const auto at = [&](std::size_t x) {
    return std::array<int, 3>{shown.rgb[3 * x], shown.rgb[3 * x + 1], shown.rgb[3 * x + 2]};
  };
  EXPECT_EQ(at(0), (std::array<int, 3>{76, 76, 76}));
  EXPECT_GT(at(1)[2], 3 * at(1)[1]) << "a small difference is blue";
  EXPECT_GT(at(2)[0] + at(2)[1] + at(2)[2], 650) << "the largest is nearly white";
}

TEST(Compare, SizesMustAgree) {
  EXPECT_THROW(compare(gray(4, 3, 0), gray(3, 4, 0)), Error);
  EXPECT_THROW(difference_picture(gray(4, 3, 0), gray(4, 4, 0)), Error);
}

}  // namespace
}  // namespace duet::render::compare_test
