#include "sim/geometry/queries/closest_points.h"

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::closest_points_test {
namespace {

using test::random_vector;

// Checks optimality: two convex elements are nearest at p and q exactly if each lies behind the plane through
// its own point across p - q. The first `first` corners belong to the first element. `scale` is a length (m)
// that bounds the corners, and `rounding` the relative rounding of the weights.
void expect_closest(const FourPoints& x, std::size_t first, const ClosestPoints& closest, double scale,
                    double rounding = 1e-14) {
  double sum_first = 0, sum_second = 0;
  Vec3 p = Vec3::Zero(), q = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const double w = i < first ? closest.weight[i] : -closest.weight[i];
    EXPECT_GE(w, 0);
    (i < first ? sum_first : sum_second) += w;
    (i < first ? p : q) += w * x[i];
  }
  EXPECT_NEAR(sum_first, 1, 1e-15);
  EXPECT_NEAR(sum_second, 1, 1e-15);
  EXPECT_LE((p - q - closest.difference).norm(), 1e-15 * scale);
  // The second term allows for the angle (1e-7) below which edges count as parallel.
  const double tolerance = rounding * scale * scale + 1e-7 * scale * closest.difference.norm();
  for (std::size_t i = 0; i < 4; ++i) {
    if (i < first)
      EXPECT_GE(closest.difference.dot(x[i] - p), -tolerance);
    else
      EXPECT_LE(closest.difference.dot(x[i] - q), tolerance);
  }
}

TEST(ClosestPoints, AreOptimalForRandomElementsOfAllScales) {
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double scale = std::pow(10.0, i % 13 - 6);
    FourPoints x;
    for (Vec3& corner : x) corner = scale * random_vector(random);
    expect_closest(x, 1, closest_point_triangle(x), 4 * scale);
    expect_closest(x, 2, closest_edge_edge(x), 4 * scale);
  }
}

TEST(ClosestPoints, AreOptimalForDegenerateElements) {
  constexpr double rounding = 1e-13;  // Where an element is almost flat, cancellation costs a digit.
  std::mt19937 random(2);
  for (int i = 0; i < 20000; ++i) {
    FourPoints x;
    for (Vec3& corner : x) corner = random_vector(random);
    // `bend` ranges from clearly separate elements to degenerate ones.
    const double bend = std::pow(10.0, -(i % 20));
    FourPoints sliver = x;
    sliver[3] = 0.3 * x[1] + 0.7 * x[2] + bend * random_vector(random);
    expect_closest(sliver, 1, closest_point_triangle(sliver), 4, rounding);
    FourPoints flat = x;  // The point is in the plane of the triangle.
    flat[0] = 0.4 * x[1] + 1.3 * x[2] - 0.7 * x[3] + bend * random_vector(random);
    expect_closest(flat, 1, closest_point_triangle(flat), 4, rounding);
    FourPoints parallel = x;
    parallel[3] = x[2] + 0.8 * (x[1] - x[0]) + bend * random_vector(random);
    expect_closest(parallel, 2, closest_edge_edge(parallel), 4, rounding);
    FourPoints crossing = x;
    crossing[3] = x[2] + 2 * (0.6 * x[0] + 0.4 * x[1] - x[2]) + bend * random_vector(random);
    expect_closest(crossing, 2, closest_edge_edge(crossing), 4, rounding);
    FourPoints point = x;
    point[1] = x[0] + (i % 2 == 0 ? 0.0 : bend) * random_vector(random);
    expect_closest(point, 2, closest_edge_edge(point), 4, rounding);
  }
}

TEST(ClosestPoints, KnownAnswers) {
  const Vec3 a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  const auto weights = [&](const Vec3& p) { return closest_point_triangle({p, a, b, c}).weight; };
  using W = std::array<double, 4>;
  EXPECT_EQ(weights(Vec3(1, 1, 5)), (W{1, -0.5, -0.25, -0.25}));  // The point is above the face.
  EXPECT_EQ(weights(Vec3(1, -3, 2)), (W{1, -0.75, -0.25, 0}));    // The point is beside an edge.
  EXPECT_EQ(weights(Vec3(9, -1, 0)), (W{1, 0, -1, 0}));           // The point is beyond a corner.
  const auto edges = [&](const Vec3& p, const Vec3& q) { return closest_edge_edge({a, b, p, q}).weight; };
  EXPECT_EQ(edges(Vec3(1, -1, 1), Vec3(1, 3, 1)), (W{0.75, 0.25, -0.75, -0.25}));
  EXPECT_EQ(edges(Vec3(6, 0, 0), Vec3(9, 0, 0)), (W{0, 1, -1, 0}));  // Both edges are on one line.
}

}  // namespace
}  // namespace duet::closest_points_test
