#include "render/color.h"

#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

namespace duet::render::color_test {
namespace {

TEST(Color, SrgbEncodingHasTheStandardsValues) {
  EXPECT_EQ(srgb_encode(0), 0);
  EXPECT_EQ(srgb_encode(1), 1);
  EXPECT_NEAR(srgb_encode(0.0031308), 0.0404499, 1e-6);  // end of the linear part
  EXPECT_NEAR(srgb_encode(0.2140411), 0.5, 1e-6);
  EXPECT_NEAR(srgb_encode(0.5), 0.7353570, 1e-6);
  EXPECT_NEAR(srgb_encode(0.001), 0.01292, 1e-12);
}

TEST(Color, ValuesOutsideTheRangeAreClamped) {
  EXPECT_EQ(srgb_encode(-1), 0);
  EXPECT_EQ(srgb_encode(7), 1);
  EXPECT_EQ(srgb_encode(std::numeric_limits<double>::quiet_NaN()), 0);
  EXPECT_EQ(srgb_encode(std::numeric_limits<double>::infinity()), 1);
}

TEST(Color, RowsAreTurnedOver) {
  // The two pixels are above each other. In the order of OpenGL the lower one, which is white, comes first.
  const std::vector<std::uint16_t> rgba = {65535, 65535, 65535, 65535, 0, 0, 0, 65535};
  EXPECT_EQ(encode_picture(rgba, 1, 2), (std::vector<unsigned char>{0, 0, 0, 255, 255, 255}));
}

// Over one period of the dither pattern the mean is the exact value, and no byte is farther than one step
// from it.
TEST(Color, DitheringKeepsTheMean) {
  for (const int value : {1, 200, 5000, 14027, 33333, 65000}) {
    const std::vector<std::uint16_t> rgba(4 * 64, static_cast<std::uint16_t>(value));
    const std::vector<unsigned char> bytes = encode_picture(rgba, 8, 8);
    const double exact = 255 * srgb_encode(value / 65535.0);
    const double mean = std::accumulate(bytes.begin(), bytes.end(), 0.0) / static_cast<double>(bytes.size());
    EXPECT_NEAR(mean, exact, 1.0 / 64) << value;  // The pattern has 64 levels.
    for (const unsigned char byte : bytes) EXPECT_LT(std::abs(byte - exact), 1) << value;
  }
}

}  // namespace
}  // namespace duet::render::color_test
