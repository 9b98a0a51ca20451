// A soft block under a plate that falls and crushes it. Compressed elements stiffen, and either bound the
// time step or are damped instead; both must give the same motion, the second in fewer steps.
#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::crushing_test {
namespace {

// Results of the fall.
struct Crushed {
  double height = 0;          // m, of the plate's middle at the end
  double lowest_min_det = 1;  // smallest det F of all frames
  int steps = 0;
};

// Simulates the fall of a plate whose weight over the block's area is 15 times the Young's modulus. The steps
// are too long for the stiffness of compressed elements, which have little damping otherwise: without a
// treatment of compression some of them turn inside out.
Crushed crush(scene::Compression compression) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "soft", Vec3(0, 0.05, 0), Vec3(0.4, 0.1, 0.4), 4, 1e5);
  scene.materials[0].damping = 1e-3;
  test::add_box(scene, "plate", Vec3(0, 0.12, 0), Vec3(0.6, 0.04, 0.6), 24000);
  scene.solver.compression = compression;
  Simulation simulation(scene, test::plan(scene));
  Crushed result;
  for (int frame = 0; frame < 3; ++frame) {
    simulation.advance_frame();
    result.steps += static_cast<int>(simulation.stats().substeps);
    result.lowest_min_det = std::min(result.lowest_min_det, simulation.stats().min_det_F);
  }
  const RigidState& plate = simulation.world().bodies.rigid.state[0];
  result.height = plate.pose.position.y();
  return result;
}

// Damped elements must fall as deep as followed ones, to 0.5 mm of a fall of 74 mm, without inverting, and in
// at most 0.7 of the steps.
TEST(Crushing, DampedElementsGoWhereFollowedOnesDo) {
  const Crushed damped = crush(scene::Compression::damped), followed = crush(scene::Compression::followed);
  test::expect_below(followed.height, 0.06, "height under the plate, m, of 0.12 m at the start");
  test::expect_above(damped.lowest_min_det, 0.2, "least det F");
  test::expect_below(std::abs(damped.height - followed.height), 5e-4,
                     "difference of the heights, m, of 0.074 m fallen");
  test::expect_below(damped.steps, 0.7 * followed.steps, "steps, against 0.7 times those that follow");
}

}  // namespace
}  // namespace duet::crushing_test
