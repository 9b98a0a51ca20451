#include "sim/contact/detection/load_shares.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace duet::load_shares_test {
namespace {

using Vec2 = Eigen::Vector2d;

std::vector<Vec2> regular_polygon(int corners, double radius, const Vec2& middle) {
  std::vector<Vec2> result;
  for (int i = 0; i < corners; ++i)
    result.push_back(middle +
                     radius * Vec2(std::cos(2 * M_PI * i / corners), std::sin(2 * M_PI * i / corners)));
  return result;
}

// A square and a disc have the center, area and mean distance that integration gives.
TEST(EvenLoad, OfASquareAndADiscIsThatOfTheTextbook) {
  const std::vector<Vec2> square = {{1, 2}, {3, 2}, {3, 4}, {1, 4}};
  const EvenLoad of_square = even_load(square);
  EXPECT_NEAR((of_square.middle - Vec2(2, 3)).norm(), 0, 1e-15);
  EXPECT_NEAR(of_square.area, 4, 1e-14);
  // Gauss's rule with five points is precise to 1e-5 for this integrand. Mean distance of a square of side a
  // from its middle: a (sqrt 2 + ln(1 + sqrt 2)) / 6.
  EXPECT_NEAR(of_square.mean_distance, 2 * (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 6, 1e-5);
  EXPECT_NEAR(of_square.mean_direction.norm(), 0, 1e-15);
  const EvenLoad disc = even_load(regular_polygon(96, 1.5, {0.3, -7}));
  EXPECT_NEAR(disc.mean_distance, 1.0, 2e-3);  // 2/3 of the radius, less the segments that the polygon lacks
  EXPECT_NEAR((disc.middle - Vec2(0.3, -7)).norm(), 0, 1e-13);
}

// The moments of the triangle with corners (0, 0), (3, 0), (0, 1) agree with sums over 4e6 points to 1 %, the
// precision of the rule near the middle, where the unit vectors jump.
TEST(EvenLoad, OfATriangleHasAMeanDirection) {
  const std::vector<Vec2> triangle = {{0, 0}, {3, 0}, {0, 1}};
  const EvenLoad load = even_load(triangle);
  Vec2 direction(0, 0);
  double distance = 0;
  const int n = 2000;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      double s = (i + 0.5) / n, t = (j + 0.5) / n;
      if (s + t > 1) s = 1 - s, t = 1 - t;
      const Vec2 x = Vec2(3 * s, t) - load.middle;
      distance += x.norm() / (n * n);
      direction += x.normalized() / (n * n);
    }
  EXPECT_NEAR(load.mean_distance, distance, 0.01 * distance);
  EXPECT_NEAR((load.mean_direction - direction).norm(), 0, 0.01);
}

// Convex polygons have unevenly spaced corners on an ellipse, and four points inside, in sizes from 1e-3 to
// 1e3 m. With the load fractions the points have the sums of 1, x, |x| and x / |x| of the even load. The
// bound of 1e-6 is that of the fit.
TEST(LoadShares, HaveTheMomentsOfTheEvenLoad) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 200; ++i) {
    const double size = std::pow(10, 6 * uniform(random) - 3);
    std::vector<double> angles;
    for (int k = 0; k < 5 + i % 20; ++k)
      angles.push_back(2 * M_PI * (k + 0.3 * uniform(random)) / (5 + i % 20));
    std::vector<Vec2> corners;
    for (const double angle : angles)
      corners.push_back(size * Vec2(3 + std::cos(angle), 0.8 * std::sin(angle) - 1));
    const EvenLoad load = even_load(corners);
    std::vector<Vec2> places = corners;
    for (int k = 0; k < 4; ++k)
      places.push_back(load.middle +
                       0.5 * (corners[static_cast<std::size_t>(k) * corners.size() / 4] - load.middle));
    std::vector<double> shares(corners.size(), 0.5 / static_cast<double>(corners.size()));
    shares.resize(places.size(), 0.125);
    share_load(load, places, shares);
    double sum = 0, distance = 0;
    Vec2 middle(0, 0), direction(0, 0);
    for (std::size_t k = 0; k < places.size(); ++k) {
      const Vec2 x = places[k] - load.middle;
      EXPECT_GE(shares[k], 0);
      sum += shares[k];
      middle += shares[k] * x;
      distance += shares[k] * x.norm();
      direction += shares[k] * x.normalized();
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_NEAR(middle.norm() / size, 0, 1e-6);
    EXPECT_NEAR(distance / load.mean_distance, 1, 1e-6);
    EXPECT_NEAR((direction - load.mean_direction).norm(), 0, 1e-6);
  }
}

// Most corners of a polygon crowd on a third of a circle, so that points that would have to pull are found in
// more than eight rounds. The shares are solved for again after the last of these points.
TEST(LoadShares, AreSolvedForHoweverManyRoundsThatTakes) {
  std::mt19937 random(1);
  const auto number = [&] { return static_cast<double>(random()) / 4294967295.0; };
  std::vector<double> angles;
  for (int i = 0; i <= 203; ++i) {  // the last one is such a polygon
    angles.resize(12 + random() % 49);
    const double crowd = 6 * number(), width = 0.3 + number();
    for (double& angle : angles) {
      const double x = number(), choice = number();
      angle = choice < 0.7 ? crowd + width * x : 6.28 * x;
    }
  }
  std::sort(angles.begin(), angles.end());
  std::vector<Vec2> corners;
  for (const double angle : angles) corners.emplace_back(std::cos(angle), std::sin(angle));
  const EvenLoad load = even_load(corners);
  std::vector<Vec2> places = corners;
  std::vector<double> shares(corners.size(), 0.5 / static_cast<double>(corners.size()));
  for (std::size_t i = 0; i < 4; ++i) {
    places.push_back(load.middle + 0.5 * (corners[i * corners.size() / 4] - load.middle));
    shares.push_back(0.125);
  }
  share_load(load, places, shares);
  Vec2 center(0, 0);
  for (std::size_t i = 0; i < places.size(); ++i) center += shares[i] * places[i];
  EXPECT_LT((center - load.middle).norm(), 0.01);  // 0.12 after eight rounds
}

}  // namespace
}  // namespace duet::load_shares_test
