// Thin rigid bodies do not slip between the vertices of coarse soft faces, and fast ones do not pass through
// cloth.
#include <algorithm>
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/simulation/simulation.h"
#include "sim/step/world.h"

namespace duet::thin_on_soft_test {
namespace {

// A rod of 4 cm lies on a block with cells of 1 m, between its vertices and off the lattice of samples that
// faces have by default.
TEST(ThinOnSoft, ARodLiesOnACoarseBlockBetweenItsVertices) {
  for (const double beside : {0.06, 0.31}) {
    scene::Scene scene = test::on_ground(0.4);
    auto& soft = test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(2, 1, 2), 2, 2e5);
    soft.shape.cells = Vec3i(2, 1, 2);
    auto& rod = test::add_ball(scene, "rod", Vec3(0, 1.32, beside), 0.02, 2);
    rod.shape.kind = scene::ShapeKind::capsule;
    rod.shape.length = 1.2;
    rod.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitZ()));
    rod.restitution = 0;
    Simulation simulation(scene, test::plan(scene));
    double lowest = 2;
    for (int frame = 0; frame < 24; ++frame) {
      simulation.advance_frame();
      lowest = std::min(lowest, simulation.world().bodies.rigid.state[0].pose.position.y());
    }
    // The face yields by a millimeter or two, and samples may be half the rod's radius off its middle.
    test::expect_above(lowest, 0.98, "lowest point of the rod's axis, m");
    EXPECT_LT(simulation.world().bodies.rigid.state[0].velocity.norm(), 0.5);
  }
}

// A ball at 100 m/s moves by a multiple of its size in a frame. Contact must find the cloth within the step.
TEST(ThinOnSoft, AFastBallDoesNotPassThroughCloth) {
  scene::Scene scene = test::free_space();
  scene::Material cotton;
  cotton.name = "cotton";
  cotton.density = 400;
  cotton.youngs_modulus = 1e5;
  cotton.poisson_ratio = 0.3;
  scene.materials.push_back(cotton);
  scene::DeformableBody cloth;
  cloth.name = "cloth";
  cloth.shape.kind = scene::DeformableKind::panel;
  cloth.shape.panel_size = Vec2(2, 2);
  cloth.shape.panel_cells = Eigen::Vector2i(16, 16);
  cloth.thickness = 0.005;
  cloth.material = "cotton";
  scene.deformable.push_back(cloth);
  test::add_ball(scene, "ball", Vec3(0.03, 1.5, 0.02), 0.2, 5).placement.velocity = Vec3(0, -100, 0);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const std::vector<Vec3> before = bodies.particles.x;
  simulation.advance_frame();
  simulation.advance_frame();
  // The cloth wraps itself around the ball. The part that the ball struck must still be in front of it.
  const Vec3 ball = bodies.rigid.state[0].pose.position;
  double nearest = 1e9;
  for (std::size_t p = 0; p < before.size(); ++p) {
    const Vec3& x = bodies.particles.x[p];
    if (std::hypot(before[p].x() - 0.03, before[p].z() - 0.02) < 0.13) {
      EXPECT_LT(x.y(), ball.y()) << "particle " << p;
    }
    nearest = std::min(nearest, (x - ball).norm());
  }
  EXPECT_LT(nearest, 0.3) << "it carries the cloth along";
  test::expect_below(bodies.rigid.state[0].velocity.y(), -10, "velocity of the ball, m/s");
  EXPECT_GT(bodies.rigid.state[0].velocity.y(), -99);
}

}  // namespace
}  // namespace duet::thin_on_soft_test
