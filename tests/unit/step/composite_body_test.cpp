#include "sim/step/composite_body.h"

#include <vector>

#include "tests/support/margin.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace duet::composite_body_test {
namespace {

const std::vector<Vec3> corners{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.2, 2, 0), Vec3(0.3, -0.4, 3)};
const Vec3 u(0.3, -0.2, 0.5), w(1, 2, -0.7);  // m/s, rad/s

// Several masses lack the velocities of one rigid motion: the composite body gives that motion back, at any
// size and place. Sums are about the first point, so that at the distance D from the origin rounding leaves
// 1e-16 D / size, relative.
TEST(CompositeBody, GivesBackTheMotionOfARigidBody) {
  for (const double size : {1e-4, 1.0, 1e3})
    for (const Vec3& place : {Vec3(0, 0, 0), Vec3(1e4, -2e3, 5e3)}) {
      CompositeBody whole;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3 r = size * corners[i];
        whole.add(1.0 + static_cast<double>(i), place + r, size * u + w.cross(r));
      }
      const Mat3 inertia = size * size * Vec3(0.1, 0.2, 0.3).asDiagonal();
      whole.add_turning(inertia, w);
      whole.finish();
      const double tolerance = 1e-13 + 1e-15 * place.norm() / size;
      test::expect_below((whole.turn() - w).norm(), tolerance, fmt::format("turn, {:g} m", size));
      for (const Vec3& corner : corners) {
        const Vec3 r = size * corner, expected = size * u + w.cross(r);
        test::expect_below((whole.velocity_at(place + r) - expected).norm() / size, 10 * tolerance,
                           fmt::format("velocity, {:g} m", size));
      }
    }
}

// A motion without momentum is not changed: two equal masses that move away from each other have none.
TEST(CompositeBody, LeavesWhatHasNoMomentum) {
  CompositeBody whole;
  whole.add(2, Vec3(1, 0, 0), Vec3(3, 0, 0));
  whole.add(2, Vec3(-1, 0, 0), Vec3(-3, 0, 0));
  whole.finish();
  EXPECT_LT(whole.velocity_at(Vec3(1, 1, 1)).norm(), 1e-15);
}

// A couple that is added with impulses of zero sum cancels the angular momentum of the masses.
TEST(CompositeBody, TakesAMomentBack) {
  CompositeBody whole;
  whole.add(2, Vec3(1, 0, 0), Vec3(0, 3, 0));
  whole.add(2, Vec3(-1, 0, 0), Vec3(0, -3, 0));
  whole.add_moment(Vec3(0, 0, 5), Vec3(-1, 0, 0));  // a couple of -12 N m s about z
  whole.add_moment(Vec3(0, 12, 5), Vec3(1, 0, 0));
  whole.finish();
  EXPECT_LT(whole.turn().norm(), 1e-15);
}

// A composite whose masses lie on a line gets no rotation about that line, a single point gets none at all,
// and an empty composite has zero velocity.
TEST(CompositeBody, DoesNotTurnAboutALine) {
  CompositeBody rod, point;
  rod.add(1, Vec3(0, 0, 1), Vec3(0, 0, 0));
  rod.add(1, Vec3(0, 0, 2), Vec3(2, 0, 0));
  rod.add_moment(Vec3(1, 0, 1), Vec3(0, 5, 0));
  rod.add_moment(Vec3(0, 0, 1), Vec3(0, -5, 0));
  rod.finish();
  EXPECT_LT((rod.turn() - Vec3(0, 2, 0)).norm(), 1e-14);
  point.add(1, Vec3(4, 5, 6), u);
  point.finish();
  EXPECT_EQ(point.velocity_at(Vec3(4, 5, 6)), u);
  CompositeBody nothing;
  nothing.finish();
  EXPECT_EQ(nothing.velocity_at(Vec3(1, 2, 3)), Vec3::Zero());
}

}  // namespace
}  // namespace duet::composite_body_test
