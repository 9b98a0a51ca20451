// Joints between rigid bodies: motion against theory, momentum, energy and drift.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::articulation_test {
namespace {

using scene::JointType;

// Returns kinetic plus potential energy, in J.
double energy_of(const World& world) {
  return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
}

// The largest errors of the joints so far: the gap in m, and the error of a fixed angle in rad.
struct Drift {
  double gap = 0, angle = 0;
  void look(const World& world) {
    const JointSolver::Drift now = JointSolver::drift(world.bodies.articulation, world.bodies.rigid);
    gap = std::max(gap, now.gap);
    angle = std::max(angle, now.angle);
  }
};

// A rod of 1 m and 10 kg that swings about its end, released from `degrees` below the horizontal.
struct Swing {
  double period = 0;  // s, mean over the passages through the vertical in one direction
  double energy = 0;  // largest error of the energy over m g L
};

// Simulates the rod for `seconds` with steps of `dt` (s).
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

// The period of a swinging rod is that of the physical pendulum, to 1e-3. A wrong inertia or a joint that
// takes energy changes it.
TEST(Articulation, APendulumSwingsWithItsPeriod) {
  // T = 2 pi sqrt(I / (m g d)) (1 + a^2 / 16), the physical pendulum at the amplitude a = 5 degrees. I = m
  // (L^2/3 + w^2/12) about the end, and d = L/2.
  const double a = 5 * EIGEN_PI / 180, inertia = (1 + 0.01) / 12.0 + 0.25;
  const double period = 2 * EIGEN_PI * std::sqrt(inertia / (9.8 * 0.5)) * (1 + a * a / 16);
  const Swing measured = swing(85, 1.0 / 96, 20);
  test::expect_below(std::abs(measured.period / period - 1), 1e-3, "relative_error_of_the_period");
}

// Returns the relative error of the frequency of a rod of `length` (m) that swings about its end, released at
// 5 degrees from the vertical, over five seconds of default steps.
double error_of_frequency(double length) {
  scene::Scene scene;
  scene.fps = 24;
  const double a = 5 * EIGEN_PI / 180;
  test::add_peg(scene, "peg", Vec3::Zero());
  test::add_box(scene, "rod", 0.5 * length * Vec3(std::sin(a), -std::cos(a), 0), length * Vec3(0.1, 1, 0.1),
                1)
      .placement.orientation = Quat(Eigen::AngleAxisd(a, Vec3::UnitZ()));
  test::add_joint(scene, JointType::hinge, "peg", "rod", Vec3::Zero(), Vec3::UnitZ());
  Simulation simulation(scene, test::plan(scene));
  const double inertia = 1.01 / 12 + 0.25;  // m^2, of 1 kg and 1 m about the end
  const double frequency = std::sqrt(9.8 * 0.5 / (inertia * length)) / (1 + a * a / 16);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();  // of the fit of A cos + B sin to the last second
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (int frame = 1; frame <= 120; ++frame) {
    simulation.advance_frame();
    if (frame <= 96) continue;
    const Vec3& at = simulation.world().bodies.rigid.state[1].pose.position;
    const double phase = frequency * frame / 24;
    const Eigen::Vector2d row(std::cos(phase), std::sin(phase));
    normal += row * row.transpose();
    right += std::atan2(at.x(), -at.y()) * row;
  }
  const Eigen::Vector2d fit = normal.inverse() * right;
  return std::atan2(fit.y(), fit.x()) / (frequency * 108.5 / 24);
}

// Short pendulums swing in a few default steps, whose length the rule bounds by their frequency. Before, rods
// of 2 to 10 cm swung 1 to 2 % too fast.
TEST(Articulation, ShortPendulumsHaveTheirPeriodInDefaultSteps) {
  for (const double length : {0.02, 0.05, 0.1, 0.3, 1.0, 5.0})
    test::expect_below(std::abs(error_of_frequency(length)), 1.5e-3,
                       fmt::format("error_of_the_frequency_of_{:g}_m", length));
}

// The default orientation update is the exact rotation with a correction of the energy. It must keep the
// energy of a pendulum at any amplitude and step; the bound of 1e-5 m g L is a measurement with a margin.
TEST(Articulation, APendulumKeepsItsEnergy) {
  for (const double degrees : {-80.0, -30.0, 0.0, 30.0, 85.0})
    for (const double dt : {1.0 / 48, 1.0 / 96, 1.0 / 384})
      test::expect_below(swing(degrees, dt, 5).energy, 1e-5,
                         fmt::format("energy_from_{}_degrees_step_{:.2g}", degrees, dt));
}

// The second-order orientation update of the paper has no correction of the energy, so its error must fall
// with the square of the step. Below an order of 1.8, a first-order term has entered.
TEST(Articulation, ThePapersEnergyErrorFallsAtSecondOrder) {
  double before = 0;
  for (const double dt : {1.0 / 96, 1.0 / 192, 1.0 / 384}) {
    const Swing now = swing(30, dt, 5, scene::OrientationUpdate::second_order);
    fmt::print("  step 1/{:.0f}: energy error {:.3g}\n", 1 / dt, now.energy);
    if (before > 0) test::expect_above(std::log2(before / now.energy), 1.8, "order");
    before = now.energy;
  }
}

// A free chain keeps linear and angular momentum, because the impulses at a joint are equal and opposite at
// one place. The bounds are rounding, accumulated over 2000 steps.
TEST(Articulation, FreeChainsKeepMomentum) {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 3, JointType::point, false);
  scene.rigid[0].placement.angular_velocity = Vec3(0.5, 1, 2);
  scene.rigid[2].placement.velocity = Vec3(1, 3, -2);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  step(world, 0, 1e-3);  // fits the velocities to the joints
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

// A stage of joints, control or contact must book every impulse that it gives. The peg takes up the momentum
// that gravity gives to the hinged rods.
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
  // The momenta are some 100 kg m/s, so the bound is rounding.
  test::expect_below(stage_defect, 1e-9, "defect_of_a_stage");
  test::expect_below(step_defect, 1e-9, "linear_defect_of_a_step");
}

// The worst errors of a chain that hangs from a peg and swings.
struct Hanging {
  double gap = 0, angle = 0, energy = 0;
  double jitter = 0;  // m/s, speed of the fastest body at the end
};

// Simulates a chain of `links` rods whose last one has the mass `last` (kg). The energy is the largest gain
// over the fall of the last body by the length of the chain.
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

// The bound of 1e-5 m on gaps is a millionth of the chain's length of 10 m. A joint solution that corrects
// gaps too weakly drifts beyond it.
TEST(Articulation, AChainOfTenLinksHoldsTogether) {
  const Hanging chain = hang(10, 10, 30);
  test::expect_below(chain.gap, 1e-5, "gap_over_30_s");
  test::expect_below(chain.energy, 1e-3, "energy gained, over that of the fall");
}

// A mass ratio of 100 or 1000 at the end of a chain must not open its joints; iterative joint solvers fail
// here.
TEST(Articulation, HeavyEndsDoNotPullChainsApart) {
  for (const double ratio : {100.0, 1000.0}) {
    const Hanging chain = hang(10, 10 * ratio, 5);
    test::expect_below(chain.gap, 1e-5, fmt::format("gap_at_{}", ratio));
    test::expect_below(chain.energy, 1e-3, fmt::format("energy gained at {}, over that of the fall", ratio));
  }
}

// Simulates three seconds and checks that joints stay within 1e-4 (m and rad) and that no energy above 1 J is
// gained.
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

// A closed loop of point joints hangs from a peg. Its constraints are redundant, which makes the system of a
// direct solution singular.
TEST(Articulation, LoopsStayClosed) {
  for (const int links : {6, test::runs_in_full() ? 20 : 12}) {
    scene::Scene scene;
    test::add_loop(scene, links, JointType::point, Vec3(0, 0, 0));
    const Vec3 corner(0.5 / std::sin(EIGEN_PI / links), 0, 0);
    test::add_peg(scene, "peg", corner);
    test::add_joint(scene, JointType::point, "peg", "loop0", corner);
    expect_closed(scene, fmt::format("{}_links", links));
  }
}

// Four parallel hinges leave a four-bar linkage one degree of freedom, and constrain the others three times
// more than needed. The redundant rows must not stop the swing or make the joint solution fail.
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

// A ring of hinges that hangs from a corner folds flat until its links touch, where the constraints are
// ill-conditioned.
TEST(Articulation, ALoopThatFoldsFlatHoldsTogether) {
  scene::Scene scene;
  test::add_loop(scene, 4, JointType::hinge, Vec3(0, 0, 0));
  test::add_peg(scene, "peg", Vec3(std::sqrt(0.5), 0, 0));
  test::add_joint(scene, JointType::hinge, "peg", "loop0", Vec3(std::sqrt(0.5), 0, 0), Vec3::UnitZ());
  expect_closed(scene, "flat");
}

}  // namespace
}  // namespace duet::articulation_test
