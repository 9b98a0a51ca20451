// Jointed bodies that spin keep energy and momentum, whatever the joints, the size, the rate and the step.
// The method is in sim/articulation/free_motion.h.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::jointed_spin_test {
namespace {

using scene::JointType;

// Returns the name of the joint type.
std::string name_of(JointType type) {
  switch (type) {
    case JointType::point:
      return "point";
    case JointType::hinge:
      return "hinge";
    case JointType::universal:
      return "universal";
    case JointType::prismatic:
      return "prismatic";
    case JointType::prismatic_twist:
      return "prismatic_twist";
    case JointType::weld:
      return "weld";
  }
  return {};
}

// Returns a box, a ball, a flat box and a rod in a bent row, each jointed to the one before, that turn about
// various axes at up to `spin` (rad/s). The smallest dimension is a quarter of `size` (m).
scene::Scene turning_row(JointType type, double size, double spin) {
  scene::Scene scene = test::free_space();
  const double mass = 1000 * size * size * size;
  test::add_box(scene, "box", Vec3(0, 0, 0), size * Vec3(0.8, 0.5, 0.4), 0.3 * mass);
  test::add_ball(scene, "ball", size * Vec3(1, 0.2, 0), 0.4 * size, 0.25 * mass);
  test::add_box(scene, "plate", size * Vec3(1.6, 1, 0.3), size * Vec3(0.9, 0.25, 0.7), 0.1 * mass);
  test::add_box(scene, "rod", size * Vec3(2.2, 1.7, 0.1), size * Vec3(0.3, 1, 0.25), 0.05 * mass);
  const Vec3 rates[] = {{0.3, 0.2, 1}, {-0.5, 0.3, 0.4}, {0.6, -0.6, 0.2}, {0.1, 0.8, -0.4}};
  for (std::size_t i = 0; i < scene.rigid.size(); ++i)
    scene.rigid[i].placement.angular_velocity = spin * rates[i];
  for (std::size_t i = 1; i < scene.rigid.size(); ++i) {
    const Vec3 a = scene.rigid[i - 1].placement.position, b = scene.rigid[i].placement.position;
    test::add_joint(scene, type, scene.rigid[i - 1].name, scene.rigid[i].name, (a + b) / 2,
                    Vec3(0.3, i % 2 ? 1 : -0.5, 0.6).normalized());
  }
  return scene;
}

// Returns the plan of the scene without contact between rigid bodies.
EffectSet without_contact(const scene::Scene& scene) {
  EffectSet plan = test::plan(scene);
  for (const Effect effect : {Effect::rigid_collision, Effect::rigid_contact}) plan[index(effect)] = false;
  return plan;
}

// The largest changes over a run.
struct Kept {
  double gain = 0, loss = 0;  // of energy, relative to the largest kinetic energy
  double momentum = 0,
         angular = 0;  // linear relative to that of the largest kinetic energy, angular relative to the start
  double gap = 0;      // m, largest gap of a joint
};

// Simulates the scene and compares with the end of the first frame, because its first step makes the
// velocities satisfy the joints.
Kept simulate(const scene::Scene& scene, double seconds) {
  Simulation simulation(scene, without_contact(scene));
  const World& world = simulation.world();
  const auto energy = [&] {
    return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
  };
  simulation.advance_frame();
  const double start = energy();
  const Momentum before = momentum(world.bodies);
  double largest = 0, mass = 0;
  for (const RigidProperties& body : world.bodies.rigid.properties) mass += body.mass;
  Kept kept;
  for (int frame = 1; frame < seconds * scene.fps; ++frame) {
    simulation.advance_frame();
    largest = std::max(largest, kinetic_energy(world.bodies));
    kept.gain = std::max(kept.gain, energy() - start);
    kept.loss = std::max(kept.loss, start - energy());
    const Momentum now = momentum(world.bodies);
    kept.momentum = std::max(kept.momentum, (now.linear - before.linear).norm());
    kept.angular = std::max(kept.angular, (now.angular - before.angular).norm() / before.angular.norm());
    kept.gap = std::max(kept.gap, JointSolver::drift(world.bodies.articulation, world.bodies.rigid).gap);
  }
  kept.gain /= largest;
  kept.loss /= largest;
  kept.momentum /= std::sqrt(2 * mass * largest);
  return kept;
}

// Joints do no work in free motion. The correction of sim/articulation/free_motion.h keeps the energy to
// 1e-4, where RATTLE alone keeps it to second order in the step. Momenta are kept to the rounding of the
// joint solution.
TEST(JointedSpin, FreeBodiesKeepEnergyAndMomentum) {
  for (const JointType type : {JointType::point, JointType::hinge, JointType::universal, JointType::weld})
    for (const double size : {0.01, 1.0, 10.0})
      for (const double spin : {3.0, 100.0})
        for (const double longest_step : {1.0 / 48, 2e-3}) {
          if (size != 1 && longest_step < 0.01) continue;
          scene::Scene scene = turning_row(type, size, spin);
          scene.solver.max_time_step = longest_step;
          const Kept kept = simulate(scene, spin > 10 ? 2 : 4);
          const std::string name =
              fmt::format("{}_of_{}_m_at_{}_step_{:.2g}", name_of(type), size, spin, longest_step);
          test::expect_below(kept.gain, 1e-4, "gain_" + name);
          test::expect_below(kept.loss, 1e-4, "loss_" + name);
          test::expect_below(kept.momentum, 1e-10, "momentum_" + name);
          test::expect_below(kept.angular, 1e-7, "angular_momentum_" + name);
          test::expect_below(kept.gap, 1e-7 * size, "gap_" + name);
        }
}

// The first body is static, and gravity lets the slow rows swing as chains of pendulums. The bound on energy
// is ten times that of free bodies.
TEST(JointedSpin, HeldBodiesKeepTheirEnergyUnderGravity) {
  for (const JointType type : {JointType::point, JointType::hinge, JointType::universal})
    for (const double size : {0.01, 1.0, 10.0})
      for (const double spin : {0.0, 3.0, 50.0}) {
        scene::Scene scene = turning_row(type, size, spin);
        scene.gravity = Vec3(0, -9.8, 0);
        scene::RigidBody& box = scene.rigid.front();
        box.is_static = true;
        box.mass.reset();
        box.placement.angular_velocity.setZero();
        const Kept kept = simulate(scene, 2);
        const std::string name = fmt::format("{}_of_{}_m_at_{}", name_of(type), size, spin);
        test::expect_below(kept.gain, 1e-3, "gain_" + name);
        test::expect_below(kept.loss, 1e-3, "loss_" + name);
        test::expect_below(kept.gap, 1e-7 * size, "gap_" + name);
      }
}

// Returns the positions (m) after half a second.
std::vector<Vec3> places(double dt, scene::OrientationUpdate update) {
  scene::Scene scene = turning_row(JointType::point, 1, 4);
  scene.solver.orientation = update;
  Simulation simulation(scene, without_contact(scene));
  World& world = simulation.world();
  step(world, 0, 1e-6);  // fits the velocities to the joints
  for (int i = 0; i * dt < 0.5 - dt / 2; ++i) step(world, i * dt, dt);
  std::vector<Vec3> result;
  for (const RigidState& state : world.bodies.rigid.state) result.push_back(state.pose.position);
  return result;
}

// The correction of the energy keeps the accuracy: errors of positions fall at second order (at least 1.7
// measured).
TEST(JointedSpin, TheMotionIsOfSecondOrder) {
  const std::vector<Vec3> reference = places(1.0 / 8192, scene::OrientationUpdate::exact);
  const auto error = [&](const std::vector<Vec3>& x) {
    double worst = 0;
    for (std::size_t i = 0; i < x.size(); ++i) worst = std::max(worst, (x[i] - reference[i]).norm());
    return worst;
  };
  double before = 0;
  for (const double dt : {1.0 / 64, 1.0 / 128, 1.0 / 256, 1.0 / 512}) {
    const double exact = error(places(dt, scene::OrientationUpdate::exact)),
                 papers = error(places(dt, scene::OrientationUpdate::second_order));
    test::record_margin(fmt::format("error_at_{:.0f}_steps_a_second", 1 / dt), exact,
                        fmt::format("m; the paper's update {:.2g}", papers));
    if (before > 0) test::expect_above(std::log2(before / exact), 1.7, "order");
    before = exact;
  }
}

// The paper's update of orientations has no correction of the energy: joints are then kept closed by RATTLE
// alone, and the energy changes by more than 1e-3.
TEST(JointedSpin, ThePapersUpdateLetsEnergyGo) {
  scene::Scene scene = turning_row(JointType::point, 1, 30);
  scene.solver.orientation = scene::OrientationUpdate::second_order;
  const Kept kept = simulate(scene, 2);
  test::expect_above(std::max(kept.gain, kept.loss), 1e-3, "change_of_energy");
}

}  // namespace
}  // namespace duet::jointed_spin_test
