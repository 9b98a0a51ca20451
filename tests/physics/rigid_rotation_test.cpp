// The orientation updates of Shinar et al. 2008, section 4.1, against the closed form of a torque-free box
// that spins about its middle axis and keeps turning over.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include "tools/study/free_top.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::rigid_rotation_test {
namespace {

constexpr double seconds = 10;
constexpr double spin = 3,
                 wobble = 0.3;  // rad/s, about the middle and the short axis: the box turns over four times

// Errors of a run.
struct Outcome {
  double orientation = 0;  // rad, from the closed form, at the end
  double energy = 0;       // largest relative change of the kinetic energy
  double momentum = 0;     // largest relative change of the angular momentum
};

// Simulates the box for ten seconds in equal steps.
Outcome tumble(int steps, scene::OrientationUpdate update) {
  scene::Scene scene = test::free_space();
  auto& box = test::add_box(scene, "box", Vec3(0, 0, 0), Vec3(3, 2, 1), 12);  // I = 5, 10, 13 kg m^2
  box.placement.angular_velocity = Vec3(0, spin, wobble);
  scene.solver.orientation = update;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double energy = kinetic_energy(world.bodies);
  const Vec3 angular = momentum(world.bodies).angular;
  Outcome outcome;
  for (int i = 0; i < steps; ++i) {
    step(world, seconds * i / steps, seconds / steps);
    outcome.energy = std::max(outcome.energy, std::abs(kinetic_energy(world.bodies) / energy - 1));
    outcome.momentum =
        std::max(outcome.momentum, (momentum(world.bodies).angular - angular).norm() / angular.norm());
  }
  const study::FreeTop top(world.bodies.rigid.properties[0].inertia, spin, wobble);
  outcome.orientation =
      world.bodies.rigid.state[0].pose.orientation.angularDistance(top.orientation(seconds));
  return outcome;
}

// The slope of log error over log step must be within 0.1 of the order.
TEST(RigidRotation, ErrorFallsWithTheOrderOfTheUpdate) {
  // The first-order update takes finer steps: an error as large as a turn has no order.
  for (const auto& [update, name, coarsest, least, most] :
       {std::tuple{scene::OrientationUpdate::second_order, "second-order", 16000, 1.9, 2.1},
        std::tuple{scene::OrientationUpdate::first_order, "first-order", 64000, 0.9, 1.1}}) {
    double previous = 0;
    for (const int steps : {coarsest, 2 * coarsest, 4 * coarsest}) {
      const Outcome outcome = tumble(steps, update);
      fmt::print("  {} update, {} steps: orientation error {:.3g} rad, energy {:.3g}, momentum {:.3g}\n",
                 name, steps, outcome.orientation, outcome.energy, outcome.momentum);
      if (previous > 0) {
        const double slope = std::log2(previous / outcome.orientation);
        test::record_margin(fmt::format("slope_{}_{}", name, steps), slope,
                            fmt::format("{} to {}", least, most));
        EXPECT_GT(slope, least);
        EXPECT_LT(slope, most);
      }
      previous = outcome.orientation;
    }
  }
}

// Both updates keep angular momentum, which is the stored quantity. The second-order update must have an
// energy error at least ten times smaller than the first-order one.
TEST(RigidRotation, EnergyAndMomentumAreKept) {
  constexpr int steps = 1000;  // a hundred a second
  const Outcome second = tumble(steps, scene::OrientationUpdate::second_order);
  const Outcome first = tumble(steps, scene::OrientationUpdate::first_order);
  test::expect_below(second.momentum, 1e-12, "angular_momentum");
  test::expect_below(first.momentum, 1e-12, "angular_momentum_first_order");
  test::expect_above(first.energy / second.energy, 10, "energy_error_first_over_second_order");
}

}  // namespace
}  // namespace duet::rigid_rotation_test
