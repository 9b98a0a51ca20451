#include "sim/contact/detection/friction_fade.h"

#include <cmath>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::friction_fade_test {
namespace {

const Vec3 up(0, 1, 0);

// Returns a surface point with equal weights on `particles`.
SurfacePoint point_on(std::initializer_list<int> particles) {
  SurfacePoint point;
  point.count = static_cast<int>(particles.size());
  std::size_t i = 0;
  for (const int p : particles) {
    point.particle[i] = p;
    point.weight[i++] = 1.0 / point.count;
  }
  return point;
}

// Returns the fraction of friction that an edge, or a face, keeps on a horizontal surface from which it rises
// at `angle` (degrees).
double share_at(double angle, bool is_face) {
  Bodies bodies;
  const double a = angle * std::acos(-1) / 180;
  bodies.particles.x = {Vec3(0, 0, 0), Vec3(2 * std::cos(a), 2 * std::sin(a), 0), Vec3(0, 0, 1)};
  return friction_fade_fraction(bodies, is_face ? point_on({0, 1, 2}) : point_on({0, 1}), up);
}

// Friction fades linearly in the sine s of the angle, from s = 0.5 (30 degrees) to s = 0.7 (44 degrees): at s
// = 0.6 half of it is left.
TEST(FrictionFade, EndsWhereEdgesAndFacesCrossTheSurface) {
  for (const bool is_face : {false, true}) {
    EXPECT_EQ(share_at(0, is_face), 1);
    EXPECT_EQ(share_at(-29.9, is_face), 1);
    EXPECT_NEAR(share_at(std::asin(0.6) * 180 / std::acos(-1), is_face), 0.5, 1e-14);
    EXPECT_EQ(share_at(45, is_face), 0);
    EXPECT_EQ(share_at(-90, is_face), 0);
  }
}

// A corner particle of a soft box keeps its friction on surfaces that its elements lie on. It has none on a
// surface that has its elements behind it: there the body would hang on an edge.
TEST(FrictionFade, EndsForParticlesInFrontOfTheirElements) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "box", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  int corners = 0;
  for (int p = 0; p < static_cast<int>(bodies.particles.size()); ++p) {
    const Vec3 from_middle = bodies.particles.x[static_cast<std::size_t>(p)] - Vec3(0, 0.5, 0);
    if (from_middle.norm() < 0.8) continue;
    ++corners;
    const Vec3 inward = inward_direction(bodies, point_on({p}));
    EXPECT_GT(inward.dot(-from_middle.normalized()), 0.9);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 outward = from_middle[axis] > 0 ? Vec3(Vec3::Unit(axis)) : Vec3(-Vec3::Unit(axis));
      EXPECT_EQ(friction_fade_fraction(bodies, point_on({p}), -outward), 1);
    }
    EXPECT_EQ(friction_fade_fraction(bodies, point_on({p}), from_middle.normalized()), 0);
  }
  EXPECT_EQ(corners, 8);
}

// The neighbors of a particle are those with which it shares a tetrahedron, ascending, each once, and without
// itself.
TEST(FrictionFade, NeighborsShareATetAndAreListedOnce) {
  const ElementLists lists = neighbors(6, {{0, 1, 2, 3}, {3, 2, 1, 4}});
  const auto of = [&](int p) { return std::vector<int>(lists.of(p).begin(), lists.of(p).end()); };
  EXPECT_EQ(of(0), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(of(2), (std::vector<int>{0, 1, 3, 4}));
  EXPECT_TRUE(of(5).empty());
}

}  // namespace
}  // namespace duet::friction_fade_test
