// Figure 3 of Shinar et al. 2008: a rigid ball hits a row of rigid and incompressible soft ones that touch
// each other.
#include <algorithm>
#include <array>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::row_test {
namespace {

// Returns the scene with the ball a quarter of a meter before the row, because the motion before the impact
// is free rolling, and with coarser soft balls, to save time. Frames are as short as the gaps between the
// balls are to be timed.
scene::Scene row() {
  scene::Scene scene = scene::read(test::source_folder() + "/scenes/row.toml").scene;
  scene.rigid[0].placement.position = Vec3(-2.25, 0, 0);
  for (scene::DeformableBody& body : scene.deformable)
    body.shape.spacing = test::runs_in_full() ? 0.25 : 0.35;
  scene.fps = 480;
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
// volume, 0.1 % of the energy, and 1 % of the diameter for penetration. The impact passes through the row,
// and the gap before the last ball opens first. A solver that treats contacts independently of each other
// opens the gaps in another order.
TEST(Row, KeepsMomentumVolumeAndEnergyAndTheLastBallLeavesFirst) {
  Simulation simulation(row(), test::plan(row()));
  simulation.keep_ledger();
  const FrameStats start = simulation.stats();
  const double momentum = start.momentum.norm(), seconds = test::runs_in_full() ? 1.0 / 3 : 0.25;
  double defect = 0, volume = 0, penetration = 0, energy = start.kinetic + start.potential + start.elastic;
  double risen = 0;
  const double first_energy = start.kinetic;
  const Bodies& bodies = simulation.world().bodies;
  constexpr double apart = 0.03;  // m: more than the skin of a soft ball swings after the impact
  std::array<double, 6> left{};   // s, when a gap opened before this ball
  left.fill(1e9);
  while (simulation.stats().time < seconds) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    for (const LedgerStats& stage : stats.ledger) defect = std::max(defect, stage.momentum_defect / momentum);
    volume = std::max(volume, stats.volume_error);
    penetration = std::max(penetration, stats.max_penetration);
    const double sum = stats.kinetic + stats.potential + stats.elastic;
    risen = std::max(risen, (sum - energy) / first_energy);
    energy = std::min(energy, sum);
    const auto now = extents(bodies);
    for (std::size_t i = 2; i < 6; ++i)
      if (now[i][0] - now[i - 1][1] > apart) left[i] = std::min(left[i], stats.time);
  }
  test::expect_below(defect, 1e-10, "largest defect of momentum of a stage, relative");
  test::expect_below(volume, 0.005, "largest error of a ball's volume");
  test::expect_below(risen, 0.001, "energy risen, over that of the blow");
  test::expect_below(penetration, 0.02, "penetration, m");
  test::record_margin("the last ball leaves at", left[5], "s");
  test::record_margin("the next one, at", *std::min_element(left.begin() + 2, left.begin() + 5), "s");
  EXPECT_LT(left[5], 0.25);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_LT(left[5], left[i]) << "before ball " << i;
  // The last ball is the fastest, by more than 1 m/s.
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_GT(bodies.rigid.state[3].velocity.x(), bodies.rigid.state[i].velocity.x() + 1);
}

}  // namespace
}  // namespace duet::row_test
