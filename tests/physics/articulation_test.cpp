// Joints between rigid bodies: motion against theory, momentum, energy and drift.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::articulation_test {
namespace {

using scene::JointType;

double energy_of(const World& world) {
  return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
}

// The largest gap of a joint so far, m, and error of a fixed angle, rad.
struct Drift {
  double gap = 0, angle = 0;
  void look(const World& world) {
    const JointSolver::Drift now = JointSolver::drift(world.bodies.articulation, world.bodies.rigid);
    gap = std::max(gap, now.gap);
    angle = std::max(angle, now.angle);
  }
};

// A rod of 1 m that swings about its end from `degrees` below the horizontal.
struct Swing {
  double period = 0;  // s, from its first two passages in the same direction
  double energy = 0;  // largest error over m g L
};

Swing swing(double degrees, double dt, double seconds,
            scene::OrientationUpdate update = scene::OrientationUpdate::exact) {
  scene::Scene scene;
  scene.solver.orientation = update;
  test::add_chain(scene, 1, JointType::hinge, true);
  scene::RigidBody& rod = scene.rigid.back();
  const double angle = -degrees * EIGEN_PI / 180;
  rod.placement.orientation = Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
  rod.placement.position = 0.5 * Vec3(std::cos(angle), std::sin(angle), 0);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double start = energy_of(world);
  std::vector<double> passages;
  Swing result;
  double before = world.bodies.rigid.state[1].pose.position.x();
  for (int i = 0; i * dt < seconds; ++i) {
    step(world, i * dt, dt);
    const double x = world.bodies.rigid.state[1].pose.position.x();
    if (before > 0 && x <= 0) passages.push_back((i + before / (before - x)) * dt);
    before = x;
    result.energy = std::max(result.energy, std::abs(energy_of(world) - start) / (10 * 9.8));
  }
  if (passages.size() > 1)
    result.period = (passages.back() - passages.front()) / static_cast<double>(passages.size() - 1);
  return result;
}

TEST(Articulation, APendulumSwingsWithItsPeriod) {
  // I / (m g d) with I = m (L^2/3 + w^2/12) about the end; the amplitude of 5 degrees adds a^2/16.
  const double a = 5 * EIGEN_PI / 180, inertia = (1 + 0.01) / 12.0 + 0.25;
  const double period = 2 * EIGEN_PI * std::sqrt(inertia / (9.8 * 0.5)) * (1 + a * a / 16);
  const Swing measured = swing(85, 1.0 / 96, 20);
  test::expect_below(std::abs(measured.period / period - 1), 1e-3, "relative_error_of_the_period");
}

TEST(Articulation, APendulumKeepsItsEnergy) {
  for (const double degrees : {-80.0, -30.0, 0.0, 30.0, 85.0})
    for (const double dt : {1.0 / 48, 1.0 / 96, 1.0 / 384})
      test::expect_below(swing(degrees, dt, 5).energy, 1e-5,
                         fmt::format("energy_from_{}_degrees_step_{:.2g}", degrees, dt));
}

// Without the correction of the energy, as the paper's update of orientations has it.
TEST(Articulation, ThePapersEnergyErrorFallsAtSecondOrder) {
  double before = 0;
  for (const double dt : {1.0 / 96, 1.0 / 192, 1.0 / 384}) {
    const Swing now = swing(30, dt, 5, scene::OrientationUpdate::second_order);
    fmt::print("  step 1/{:.0f}: energy error {:.3g}\n", 1 / dt, now.energy);
    if (before > 0) test::expect_above(std::log2(before / now.energy), 1.8, "order");
    before = now.energy;
  }
}

TEST(Articulation, FreeChainsKeepMomentum) {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 3, JointType::point, false);
  scene.rigid[0].placement.angular_velocity = Vec3(0.5, 1, 2);
  scene.rigid[2].placement.velocity = Vec3(1, 3, -2);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  step(world, 0, 1e-3);  // that makes the velocities fit
  const Momentum start = momentum(world.bodies);
  Drift drift;
  double linear = 0, angular = 0;
  for (int i = 1; i < 2000; ++i) {
    step(world, i * 5e-3, 5e-3);
    const Momentum now = momentum(world.bodies);
    linear = std::max(linear, (now.linear - start.linear).norm() / start.linear.norm());
    angular = std::max(angular, (now.angular - start.angular).norm() / start.angular.norm());
    drift.look(world);
  }
  test::expect_below(linear, 1e-12, "linear_momentum");
  test::expect_below(angular, 1e-10, "angular_momentum");
  test::expect_below(drift.gap, 1e-9, "gap");
}

// The peg gives what the rod does not have from gravity.
TEST(Articulation, TheLedgerOfAPendulumIsBalanced) {
  scene::Scene scene;
  test::add_chain(scene, 3, JointType::hinge, true);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  const StepLedger& ledger = simulation.world().ledger;
  double stage_defect = 0, step_defect = 0;
  for (int frame = 0; frame < 24; ++frame) {
    simulation.advance_frame();
    for (const Stage stage :
         {Stage::collided_joints, Stage::control, Stage::contact, Stage::control_at_end}) {
      stage_defect = std::max(stage_defect, ledger[stage].linear_defect);
      stage_defect = std::max(stage_defect, ledger[stage].angular_defect);
    }
    step_defect = std::max(step_defect, ledger.whole_step().linear_defect);
  }
  // The momenta are some 100 kg m/s.
  test::expect_below(stage_defect, 1e-9, "defect_of_a_stage");
  test::expect_below(step_defect, 1e-9, "linear_defect_of_a_step");
}

struct Hanging {
  double gap = 0, angle = 0, energy = 0;
  double jitter = 0;  // m/s, the fastest body at the end
};

Hanging hang(int links, double last, double seconds) {
  scene::Scene scene;
  scene.solver.max_time_step = 1.0 / 96;
  test::add_chain(scene, links, JointType::point, true, last);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double start = energy_of(world);
  Drift drift;
  double energy = -1e300;
  for (int frame = 0; frame < 24 * seconds; ++frame) {
    simulation.advance_frame();
    drift.look(world);
    energy = std::max(energy, energy_of(world) - start);
  }
  return {drift.gap, drift.angle, energy / (world.bodies.rigid.properties.back().mass * 9.8 * links)};
}

TEST(Articulation, AChainOfTenLinksHoldsTogether) {
  const Hanging chain = hang(10, 10, 30);
  test::expect_below(chain.gap, 1e-5, "gap_over_30_s");
  test::record_margin("energy_gained", chain.energy, "of the fall's");
}

TEST(Articulation, HeavyEndsDoNotPullChainsApart) {
  for (const double ratio : {100.0, 1000.0}) {
    const Hanging chain = hang(10, 10 * ratio, 5);
    test::expect_below(chain.gap, 1e-5, fmt::format("gap_at_{}", ratio));
    test::record_margin("energy_gained", chain.energy, "of the fall's");
  }
}

void expect_closed(const scene::Scene& scene, const std::string& what) {
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double start = energy_of(world);
  Drift drift;
  double energy = -1e300;
  for (int frame = 0; frame < 72; ++frame) {
    simulation.advance_frame();
    drift.look(world);
    energy = std::max(energy, energy_of(world) - start);
  }
  test::expect_below(drift.gap, 1e-4, "gap_" + what);
  test::expect_below(drift.angle, 1e-4, "angle_" + what);
  test::expect_below(energy, 1, "energy_gained_" + what);
}

TEST(Articulation, LoopsStayClosed) {
  for (const int links : {6, 20}) {
    scene::Scene scene;
    test::add_loop(scene, links, JointType::point, Vec3(0, 0, 0));
    const Vec3 corner(0.5 / std::sin(EIGEN_PI / links), 0, 0);
    test::add_peg(scene, "peg", corner);
    test::add_joint(scene, JointType::point, "peg", "loop0", corner);
    expect_closed(scene, fmt::format("{}_links", links));
  }
}

// Four parallel hinges leave one freedom and constrain the rest three times more than is needed.
TEST(Articulation, AnOverConstrainedFourBarSwings) {
  scene::Scene scene;
  test::add_peg(scene, "left", Vec3(0, 0, 0));
  test::add_peg(scene, "right", Vec3(1.5, 0, 0));
  test::add_box(scene, "crank", Vec3(-0.5, 0, 0), Vec3(1, 0.1, 0.1), 10);
  test::add_box(scene, "rocker", Vec3(1, 0, 0), Vec3(1, 0.1, 0.1), 10);
  test::add_box(scene, "coupler", Vec3(-0.25, 0, 0.2), Vec3(1.5, 0.1, 0.1), 10);
  for (const auto& [parent, child, x] : {std::tuple("left", "crank", 0.0),
                                         {"crank", "coupler", -1.0},
                                         {"coupler", "rocker", 0.5},
                                         {"right", "rocker", 1.5}})
    test::add_joint(scene, JointType::hinge, parent, child, Vec3(x, 0, 0), Vec3::UnitZ());
  expect_closed(scene, "four_bar");
}

// A ring of hinges that hangs from a corner folds flat until its links touch.
TEST(Articulation, ALoopThatFoldsFlatHoldsTogether) {
  scene::Scene scene;
  test::add_loop(scene, 4, JointType::hinge, Vec3(0, 0, 0));
  test::add_peg(scene, "peg", Vec3(std::sqrt(0.5), 0, 0));
  test::add_joint(scene, JointType::hinge, "peg", "loop0", Vec3(std::sqrt(0.5), 0, 0), Vec3::UnitZ());
  expect_closed(scene, "flat");
}

// A hinge in free space between a heavy parent and a light child, that turns to a target of one radian.
scene::Scene actuated(double gain) {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 2, JointType::hinge, false);
  scene::Joint& joint = scene.joints.back();
  joint.has_control = true;
  joint.control.gain = gain;
  joint.control.target.turn = Vec3(180 / EIGEN_PI, 0, 0);
  return scene;
}

double angle_of_joint(const World& world) {
  const Joint& joint = world.bodies.articulation.joints.back();
  return angle_of(JointFrames(joint, world.bodies.rigid.state[static_cast<std::size_t>(joint.parent)].pose,
                              world.bodies.rigid.state[static_cast<std::size_t>(joint.child)].pose));
}

TEST(JointControl, StepResponseIsTheCriticallyDampedCurve) {
  const double gain = 100, omega = std::sqrt(gain);
  Simulation simulation(actuated(gain), test::plan(actuated(gain)));
  World& world = simulation.world();
  double largest = 0;
  for (int i = 0; i < 96; ++i) {
    step(world, i / 96.0, 1 / 96.0);
    const double t = (i + 1) / 96.0;
    const double expected = 1 - (1 + omega * t) * std::exp(-omega * t);
    largest = std::max(largest, std::abs(angle_of_joint(world) - expected));
  }
  test::expect_below(largest, 0.01, "error_rad_of_1");
}

TEST(JointControl, AnyGainIsStableAndArrives) {
  for (const double gain : {1e1, 1e2, 1e3, 1e4, 1e5, 1e6}) {
    Simulation simulation(actuated(gain), test::plan(actuated(gain)));
    World& world = simulation.world();
    double overshoot = 0, t = 0;
    const double seconds = 30 / std::sqrt(gain) + 1;
    while (t < seconds) {
      const double dt = choose_time_step(world, t);
      step(world, t, dt);
      t += dt;
      overshoot = std::max(overshoot, angle_of_joint(world) - 1);
    }
    test::expect_below(std::abs(angle_of_joint(world) - 1), 1e-9,
                       fmt::format("error_at_the_end_{:.0e}", gain));
    test::expect_below(overshoot, 0.01, fmt::format("overshoot_{:.0e}", gain));
    // The torques on the two are equal and opposite.
    test::expect_below(momentum(world.bodies).angular.norm(), 1e-10, "angular_momentum");
    test::expect_below(momentum(world.bodies).linear.norm(), 1e-11, "linear_momentum");
  }
}

TEST(JointControl, HoldsALoadWithoutSagging) {
  scene::Scene scene;
  test::add_chain(scene, 3, JointType::hinge, true, 100);
  for (scene::Joint& joint : scene.joints) {
    joint.has_control = true;
    joint.control.gain = 400;
  }
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 480; ++i) step(world, i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(angle_of_joint(world)), 1e-6, "angle_of_the_last_joint");
  test::expect_below(std::abs(world.bodies.rigid.state.back().pose.position.y()), 1e-6, "sagging_m");
}

TEST(JointControl, TorqueStaysWithinItsLimit) {
  scene::Scene scene = actuated(1e4);
  scene.joints.back().control.torque_limit = 2;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  // The two turn about the hinge like one of them about a fixed one (by symmetry), with half of the angle.
  const double inertia = 10 * (1 + 0.01) / 12;
  for (int i = 0; i < 48; ++i) step(world, i / 96.0, 1 / 96.0);
  const double angular = inertia * world.bodies.rigid.state[1].angular_velocity.z();
  test::expect_below(angular, 2 * 0.5 * (1 + 1e-9), "angular_momentum_after_half_a_second");
  test::expect_above(angular, 0.5, "angular_momentum_after_half_a_second");
}

TEST(JointLimits, StopAHingeAndLetItGo) {
  scene::Scene scene;
  test::add_chain(scene, 1, JointType::hinge, true);
  scene.joints.back().angle.least = -30;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  double least = 0;
  for (int i = 0; i < 192; ++i) {
    step(world, i / 96.0, 1 / 96.0);
    least = std::min(least, angle_of_joint(world));
  }
  test::expect_above(least, -30 * EIGEN_PI / 180 - 1e-6, "least_angle");
  test::expect_below(std::abs(angle_of_joint(world) + 30 * EIGEN_PI / 180), 1e-6, "rests_at_the_limit");
  world.gravity *= -1;
  for (int i = 0; i < 20; ++i) step(world, 2 + i / 96.0, 1 / 96.0);
  test::expect_above(angle_of_joint(world), -0.5, "angle_after_being_let_go");
}

TEST(JointFriction, StopsASpinLikeABrake) {
  scene::Scene scene;
  scene.gravity.setZero();
  test::add_peg(scene, "peg", Vec3::Zero());
  test::add_box(scene, "wheel", Vec3(0, 0, 0.2), Vec3(1, 1, 0.1), 12);
  scene.rigid.back().placement.angular_velocity = Vec3(0, 0, 5);
  test::add_joint(scene, JointType::hinge, "peg", "wheel", Vec3(0, 0, 0.2), Vec3::UnitZ());
  scene.joints.back().friction = 4;  // I = 2 kg m^2: 2 rad/s^2
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 96; ++i) step(world, i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(world.bodies.rigid.state[1].angular_velocity.z() - 3), 1e-6, "after_1_s");
  for (int i = 0; i < 192; ++i) step(world, 1 + i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(world.bodies.rigid.state[1].angular_velocity.z()), 1e-9, "after_3_s");
}

}  // namespace
}  // namespace duet::articulation_test
