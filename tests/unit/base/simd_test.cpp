#include "sim/base/simd.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace duet::simd_test {
namespace {

// The logarithm is compared with std::log, which itself may be off by up to one unit: 2 epsilon relative
// leaves room for both.
TEST(Simd, LogarithmIsGoodToTwoUnitsInTheLastPlace) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-700, 700), near_one(0.5, 2);
  for (int i = 0; i < 20000; ++i) {
    const double x = i % 2 ? std::exp(exponent(random)) : near_one(random);
    const double exact = std::log(x);
    EXPECT_NEAR(log_of(x), exact, 2 * std::numeric_limits<double>::epsilon() * std::abs(exact)) << x;
  }
  EXPECT_EQ(log_of(1.0), 0);
}

// double4x2 takes the place of double8 where the machine has no vectors of eight doubles, and must give the
// same bits: every lane is computed by itself, for operations with a second vector and with a number.
class TwoQuadsTest : public testing::Test {
 protected:
  TwoQuadsTest() {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> number(0.5, 2);
    for (std::size_t lane = 0; lane < 8; ++lane) {
      a[lane] = number(random);
      b[lane] = lane == 2 ? a[lane] : number(random);  // lane 2 is equal in both, for <= and >=
    }
  }
  template <class Work>
  void expect_lanes_of(Work work) {
    const double4x2 both = work(a, b), first = work(a, 0.75), second = work(0.75, b);
    for (std::size_t lane = 0; lane < 8; ++lane) {
      EXPECT_EQ(both[lane], work(a[lane], b[lane])) << lane;
      EXPECT_EQ(first[lane], work(a[lane], 0.75)) << lane;
      EXPECT_EQ(second[lane], work(0.75, b[lane])) << lane;
    }
  }
  // Expects that comparisons, masks and selection act on every lane by itself.
  template <class Compare>
  void expect_lanes_where(Compare compare) {
    unsigned both = 0, with_one = 0;
    for (unsigned lane = 0; lane < 8; ++lane) {
      both |= compare(a[lane], b[lane]) ? 1u << lane : 0u;
      with_one |= compare(a[lane], a[5]) ? 1u << lane : 0u;
    }
    EXPECT_EQ(lanes_of(compare(a, b)), both);
    EXPECT_EQ(lanes_of(compare(a, a[5])), with_one);
    EXPECT_EQ(lanes_of(compare(a, b) & compare(a, a[5])), both & with_one);
    const double4x2 chosen = select(compare(a, b), a, b);
    for (unsigned lane = 0; lane < 8; ++lane)
      EXPECT_EQ(chosen[lane], compare(a[lane], b[lane]) ? a[lane] : b[lane]) << lane;
  }

  double4x2 a, b;
};

// Sums, products, quotients, signs and roots of every lane have the bits of the scalar operation.
TEST_F(TwoQuadsTest, ComputesEveryLaneByItself) {
  expect_lanes_of(std::plus<>{});
  expect_lanes_of(std::minus<>{});
  expect_lanes_of(std::multiplies<>{});
  expect_lanes_of(std::divides<>{});
  double4x2 sum = a, product = a;
  sum += b;
  product *= b;
  for (std::size_t lane = 0; lane < 8; ++lane) {
    EXPECT_EQ(sum[lane], a[lane] + b[lane]) << lane;
    EXPECT_EQ(product[lane], a[lane] * b[lane]) << lane;
    EXPECT_EQ((-a)[lane], -a[lane]) << lane;
    EXPECT_EQ(sqrt_of(a)[lane], std::sqrt(a[lane])) << lane;
  }
}

// Comparisons, masks and selection of every lane agree with the scalar comparison, for equal numbers as well.
TEST_F(TwoQuadsTest, ComparesEveryLaneByItself) {
  expect_lanes_where(std::less<>{});
  expect_lanes_where(std::greater<>{});
  expect_lanes_where(std::less_equal<>{});
  expect_lanes_where(std::greater_equal<>{});
}

// Conversions round as a cast does and keep the order of the lanes.
TEST(Simd, SingleAndDoublePrecisionKeepTheirLanes) {
  double8 x;
  for (std::size_t lane = 0; lane < pack_width; ++lane) x[lane] = 1.0 / static_cast<double>(lane + 3);
  const float8 single = to_single(x);
  const double8 back = to_double(single);
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    EXPECT_EQ(single[lane], static_cast<float>(x[lane])) << lane;
    EXPECT_EQ(back[lane], static_cast<double>(single[lane])) << lane;
  }
}

// Rows of four numbers that are transposed into packs and back are unchanged, to the bit.
TEST(Simd, RowsSurviveTransposition) {
  double rows[pack_width][4];
  for (std::size_t i = 0; i < pack_width; ++i)
    for (std::size_t k = 0; k < 4; ++k) rows[i][k] = static_cast<double>(10 * i + k);
  const vector8 packs = load_rows([&](std::size_t i) {
    return double4{rows[i][0], rows[i][1], rows[i][2], rows[i][3]};
  });
  double4 stored[pack_width];
  double8 w;
  for (std::size_t i = 0; i < pack_width; ++i) w[i] = rows[i][3];
  store_rows(packs, w, stored);
  for (std::size_t i = 0; i < pack_width; ++i) {
    EXPECT_EQ(packs.x[i], rows[i][0]);
    EXPECT_EQ(packs.y[i], rows[i][1]);
    EXPECT_EQ(packs.z[i], rows[i][2]);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(stored[i][k], rows[i][k]);
  }
}

}  // namespace
}  // namespace duet::simd_test
