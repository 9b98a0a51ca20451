// Figure 3 of Shinar et al. 2008: a rigid ball hits a row of rigid and incompressible soft ones that touch
// each other.
#include <algorithm>
#include <array>

#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/step.h"

namespace duet::row_test {
namespace {

// Returns the scene with the ball a quarter of a meter before the row, because the motion before the impact
// is free rolling, and with coarser soft balls, to save time.
scene::Scene row() {
  scene::Scene scene = scene::read(test::source_folder() + "/scenes/row.toml").scene;
  scene.rigid[0].placement.position = Vec3(-2.25, 0, 0);
  for (scene::DeformableBody& body : scene.deformable) body.shape.spacing = 0.25;
  return scene;
}

// Returns the smallest and the largest x (m) of the balls, in the order of the row.
std::array<std::array<double, 2>, 6> extents(const Bodies& bodies) {
  std::array<std::array<double, 2>, 6> result;
  const std::array<std::size_t, 4> rigid_places = {0, 1, 3, 5};
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = bodies.rigid.state[i].pose.position.x();
    result[rigid_places[i]] = {x - 1, x + 1};
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const DeformableBody& body = bodies.deformable[k];
    std::array<double, 2> range = {1e9, -1e9};
    for (int i = 0; i < body.particle_count; ++i) {
      const double x = bodies.particles.x[static_cast<std::size_t>(body.first_particle + i)].x();
      range = {std::min(range[0], x), std::max(range[1], x)};
    }
    result[2 * k + 2] = range;
  }
  return result;
}

// Momentum defects of stages are rounding. The other bounds are measurements with a margin: 0.5 % of a
// volume, 0.1 % of the energy, and 1 % of the diameter for penetration.
TEST(Row, KeepsMomentumVolumeAndEnergy) {
  Simulation simulation(row(), test::plan(row()));
  simulation.keep_ledger();
  const FrameStats start = simulation.stats();
  const double momentum = start.momentum.norm();
  double defect = 0, volume = 0, penetration = 0, energy = start.kinetic + start.potential + start.elastic;
  double risen = 0;
  const double first_energy = start.kinetic;
  for (int frame = 0; frame < 8; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    for (const LedgerStats& stage : stats.ledger) defect = std::max(defect, stage.momentum_defect / momentum);
    volume = std::max(volume, stats.volume_error);
    penetration = std::max(penetration, stats.max_penetration);
    const double now = stats.kinetic + stats.potential + stats.elastic;
    risen = std::max(risen, (now - energy) / first_energy);
    energy = std::min(energy, now);
  }
  test::expect_below(defect, 1e-10, "largest defect of momentum of a stage, relative");
  test::expect_below(volume, 0.005, "largest error of a ball's volume");
  test::expect_below(risen, 0.001, "energy risen, over that of the blow");
  test::expect_below(penetration, 0.02, "penetration, m");
  // The last ball is the fastest, by more than 1 m/s.
  const Bodies& bodies = simulation.world().bodies;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_GT(bodies.rigid.state[3].velocity.x(), bodies.rigid.state[i].velocity.x() + 1);
}

// The impact passes through the row, and the gap before the last ball opens first. A solver that treats
// contacts independently of each other opens the gaps in another order.
TEST(Row, LastBallLeavesFirst) {
  const scene::Scene scene = row();
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  constexpr double apart = 0.02;  // m: more than the skin of a soft ball swings after the impact
  std::array<double, 6> left{};   // s, when a gap opened before this ball
  left.fill(1e9);
  for (double time = 0; time < 0.25;) {
    const double dt = choose_time_step(world, time);
    step(world, time, dt);
    time += dt;
    const auto now = extents(world.bodies);
    for (std::size_t i = 2; i < 6; ++i)
      if (now[i][0] - now[i - 1][1] > apart) left[i] = std::min(left[i], time);
  }
  test::record_margin("the last ball leaves at", left[5], "s");
  test::record_margin("the next one, at", *std::min_element(left.begin() + 2, left.begin() + 5), "s");
  EXPECT_LT(left[5], 0.25);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_LT(left[5], left[i]) << "before ball " << i;
}

}  // namespace
}  // namespace duet::row_test
