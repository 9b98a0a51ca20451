// A soft block under a plate that falls and crushes it: elements that are damped instead of bounding the step
// go the same way in fewer steps.
#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::crushing_test {
namespace {

struct Crushed {
  double height = 0;          // m, of the plate's middle
  double lowest_min_det = 1;  // of all frames
  int steps = 0;
};

// 15 times the Young's modulus presses on it. The steps are too long for what becomes of the elements, which
// are damped little otherwise: without what compression brings some of them turn inside out.
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
