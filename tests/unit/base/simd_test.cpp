#include "sim/base/simd.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace duet {
namespace {

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

TEST(Simd, RowsComeBackFromPacks) {
  double rows[pack_width][4];
  for (std::size_t i = 0; i < pack_width; ++i)
    for (std::size_t k = 0; k < 4; ++k) rows[i][k] = static_cast<double>(10 * i + k);
  const PackVector packs = load_rows([&](std::size_t i) {
    return Quad{rows[i][0], rows[i][1], rows[i][2], rows[i][3]};
  });
  Quad stored[pack_width];
  Pack w;
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
}  // namespace duet
