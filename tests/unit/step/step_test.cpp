#include "sim/step/step.h"

#include <algorithm>
#include <cmath>

#include "tests/support/elastic_state.h"
#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/parallel.h"

namespace duet::step_test {
namespace {

// For a body at rest the step is the setting `cfl` times the elastic limit 2 / omega_max.
TEST(TimeStep, IsAFractionOfTheElasticLimit) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(2, 2, 2), 6);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double limit = 2 / std::sqrt(world.bodies.forces.rest_omega_squared());
  world.settings.cfl = 0.9;
  EXPECT_DOUBLE_EQ(choose_time_step(world, 0), 0.9 * limit);
  world.settings.cfl = 0.3;
  EXPECT_DOUBLE_EQ(choose_time_step(world, 0), 0.3 * limit);
}

// A solve starts from the velocity that the acceleration of the last solve predicts, which leaves it less
// than two iterations on average. A start at the right side takes three iterations in this scene.
TEST(ConjugateGradients, HaveLittleToDoWhereMotionGoesOnAsBefore) {
  scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  const FrameStats stats = simulation.stats();
  EXPECT_LT(stats.cg_iterations, 2 * 2 * stats.substeps)
      << "of two solves in " << stats.substeps << " substeps";
}

// Elements deform by at most a quarter of their size in a step, but no step is shorter than 1/1024 of the one
// at rest.
TEST(TimeStep, FollowsThePaceOfDeformation) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "softer", Vec3(9, 0, 0), Vec3(2, 2, 2), 6, 2e5);
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(2, 2, 2), 6);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  Particles& particles = world.bodies.particles;
  const double limit = 2 / std::sqrt(world.bodies.forces.rest_omega_squared());
  for (const double rate : {1.0, 1e3, 1e9}) {  // 1/s: rate of a shear
    for (std::size_t p = 0; p < particles.size(); ++p)
      particles.v[p] = Vec3((particles.x[p].x() < 5 ? rate : 0.1 * rate) * particles.x[p].y(), 5, 0);
    const TimeStepChoice choice = bounded_time_step(world, 0);
    EXPECT_NEAR(choice.seconds, std::max(std::min(0.7 * limit, 0.25 / rate), limit / 1024), 1e-12 * limit);
    EXPECT_EQ(describe(choice, world.bodies), rate > 1 ? "the pace at which elements of `soft` are deformed"
                                                       : "the elastic forces of `soft`");
  }
}

// A body turns by at most 0.314159 rad (a tenth of pi) in a step.
TEST(TimeStep, FollowsTheTurnOfRigidBodies) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "ball", Vec3::Zero(), 0.5, 1).placement.angular_velocity = Vec3(0, 2000, 0);
  test::add_box(scene, "box", Vec3(3, 0, 0), Vec3(1, 1, 1), 1).placement.angular_velocity = Vec3(0, 1000, 0);
  Simulation spinning(scene, test::plan(scene));
  const TimeStepChoice choice = bounded_time_step(spinning.world(), 0);
  EXPECT_DOUBLE_EQ(choice.seconds, 0.314159 / 1000);  // balls turn without error and bound nothing
  EXPECT_EQ(describe(choice, spinning.world().bodies), "the turn of `box`");
}

// Returns the time step with a ball of 1 m that flies towards a plate at 200 m/s, at `angle` (rad) from the
// line to it. The plate is `distance` (m) away and has `thickness` (m).
TimeStepChoice choice_before_plate(double distance, double thickness, bool is_static, double angle = 0) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "ball", Vec3::Zero(), 0.5, 1).placement.velocity =
      200 * Vec3(std::cos(angle), std::sin(angle), 0);
  auto& plate =
      test::add_box(scene, "plate", Vec3(0.5 + distance + thickness / 2, 0, 0), Vec3(thickness, 20, 20), 1);
  plate.is_static = is_static;
  if (is_static) plate.mass.reset();
  Simulation simulation(scene, test::plan(scene));
  const TimeStepChoice choice = bounded_time_step(simulation.world(), 0);
  if (choice.bound == TimeStepBound::approach) {
    EXPECT_EQ(describe(choice, simulation.world().bodies), "`ball` and `plate`, which can meet");
  }
  return choice;
}

// Fast bodies must not pass through each other within a step, and steps must not be shorter than that
// requires.
TEST(TimeStep, LetsFastBodiesMeetAndOverlapByAFraction) {
  constexpr double speed = 200;
  // A plate that is far away bounds nothing. On the approach the step ends at half of the depth that may be
  // entered, which is a tenth of the ball here.
  EXPECT_EQ(choice_before_plate(5, 1, true).bound, TimeStepBound::setting);
  EXPECT_DOUBLE_EQ(choice_before_plate(2, 1, true).seconds, (2 - 0.05) / speed);
  EXPECT_DOUBLE_EQ(choice_before_plate(0, 1, true).seconds, 0.1 / speed);
  // Half of a thin static plate may be entered, and a tenth of a dynamic one.
  EXPECT_DOUBLE_EQ(choice_before_plate(0, 0.01, true).seconds, 0.005 / speed);
  EXPECT_DOUBLE_EQ(choice_before_plate(0, 0.01, false).seconds, 0.001 / speed);
  EXPECT_DOUBLE_EQ(choice_before_plate(2, 0.01, false).seconds, (2 - 0.0005) / speed);
  // The velocity of approach alone counts: a ball that passes or moves away is not bounded.
  EXPECT_NEAR(choice_before_plate(0.1, 1, true, EIGEN_PI / 3).seconds, 2 * 0.1 / speed, 1e-12);
  EXPECT_EQ(choice_before_plate(0.1, 1, true, EIGEN_PI / 2).bound, TimeStepBound::setting);
  EXPECT_EQ(choice_before_plate(0.1, 1, true, EIGEN_PI).bound, TimeStepBound::setting);
}

// The approach counts the velocity of a soft body, and the velocity that a rotation gives to the ends of a
// bar.
TEST(TimeStep, CountsTheSpeedOfSoftBodiesAndOfTurningOnes) {
  scene::Scene scene = test::free_space();
  auto& soft = test::add_soft_box(scene, "soft", Vec3(0, 0, 1.6), Vec3(1, 1, 1), 2, 1e3);
  soft.placement.velocity = Vec3(0, 0, -300);
  auto& plate = test::add_box(scene, "plate", Vec3(0, 0, 0), Vec3(5, 5, 0.2), 1);
  plate.is_static = true;
  plate.mass.reset();
  Simulation falling(scene, test::plan(scene));
  const TimeStepChoice choice = bounded_time_step(falling.world(), 0);
  EXPECT_EQ(choice.bound, TimeStepBound::approach);
  EXPECT_DOUBLE_EQ(choice.seconds, (1 - 0.05) / 300);

  scene.deformable.clear();
  auto& bar = test::add_box(scene, "bar", Vec3(0, 0, 0.35), Vec3(2, 0.1, 0.1), 1);
  bar.placement.angular_velocity = Vec3(0, 12, 0);
  Simulation turning(scene, test::plan(scene));
  const TimeStepChoice turn = bounded_time_step(turning.world(), 0);
  EXPECT_EQ(turn.bound, TimeStepBound::approach);
  // The bar is 0.2 m away, and its corners move with the lever arm hypot(1, 0.05, 0.05).
  EXPECT_NEAR(turn.seconds, (0.2 - 0.005) / (12 * std::hypot(1, 0.05, 0.05)), 1e-9);
}

// A kinematic body bounds the step by its motion in the step to come, which may begin at a later key, and by
// its turn and the phase of its oscillation.
TEST(TimeStep, FollowsTheMotionOfKinematicBodiesOverTheStepToCome) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& plate = test::add_box(scene, "plate", Vec3::Zero(), Vec3(4, 0.1, 4), 1);
  plate.mass.reset();
  plate.is_kinematic = true;
  plate.motion.interpolation = Interpolation::linear;
  plate.motion.keyframes = {{1, Vec3::Zero(), {}, false, {}}, {2, Vec3(0, 50, 0), {}, false, {}}};
  test::add_ball(scene, "ball", Vec3(0, 0.55, 0), 0.5, 1);
  const auto choice = [&](double time) {
    Simulation simulation(scene, test::plan(scene));
    return bounded_time_step(simulation.world(), time);
  };
  EXPECT_EQ(choice(0).seconds, 1.0 / 48) << "at rest, as long as the step may last";
  EXPECT_EQ(choice(0.99).bound, TimeStepBound::approach);
  EXPECT_GE(choice(0.99).seconds, 0.5 * 0.1 / 50 / 3) << "bounded by half the plate and its speed in any way";
  EXPECT_LE(choice(0.99).seconds, 0.5 * 0.1 / 50);
  EXPECT_DOUBLE_EQ(choice(1.5).seconds, 0.5 * 0.1 / 50);
  EXPECT_EQ(choice(2.1).seconds, 1.0 / 48);

  scene.rigid[0].motion = {};
  scene.rigid[0].motion.spin = {{Vec3::UnitY(), 20, 0, {}, 0}};
  EXPECT_DOUBLE_EQ(choice(0).seconds, 0.314159 / (40 * EIGEN_PI));

  scene.rigid[0].motion = {};  // a fast oscillation of small amplitude shakes other bodies nevertheless
  scene.rigid[0].motion.sinusoid = {{Vec3(0, 1e-4, 0), {}, 40, 0, 0, {}}};
  EXPECT_DOUBLE_EQ(choice(0).seconds, 0.314159 / (80 * EIGEN_PI));

  // The ball is farther away than the plate can come: the phase alone could bound the step, and does not.
  scene.rigid[0].motion.sinusoid = {{Vec3(0, 1, 0), {}, 2, 0, 0, {}}};
  scene.rigid[1].placement.position.y() = 20;
  EXPECT_EQ(choice(0).seconds, 1.0 / 48);
}

// Returns the ratio of the mechanical energy after 3000 steps to that at the start, for an undamped body with
// the time step `cfl` times the limit of the rule. The body rings without growing at 0.9 of the limit, and
// impacts up beyond it.
double energy_after(double cfl) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 2, 1e5);
  scene.materials[0].damping = 0;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
    world.bodies.particles.v[p] = 1e-3 * Vec3((p % 3) - 1.0, (p % 5) - 2.0, (p % 7) - 3.0);
  world.settings.cfl = cfl;
  const double dt = test::rule_step(world);
  const double start = kinetic_energy(world.bodies);
  for (int i = 0; i < 3000; ++i) step(world, 0, dt);
  return test::mechanical_energy(world) / start;
}

// An undamped body is stable at 0.9 of the limit and impacts up at 3 times the limit: the rule neither fails
// nor wastes more than that.
TEST(TimeStep, RuleIsStableWithoutDampingAndNotFarFromTheLimit) {
  EXPECT_LT(energy_after(0.9), 1.5);  // the energy of an explicit symplectic scheme wavers without growing
  EXPECT_THROW(EXPECT_GT(energy_after(3), 1e3), SimulationError);
}

// The hash of the state after three frames does not depend on the number of threads.
TEST(Step, ResultsAreBitIdenticalForAnyThreadCount) {
  const scene::Scene scene = test::small_stack();
  std::vector<std::uint64_t> hashes;
  for (int threads : {1, 2, 4}) {
    set_thread_count(threads);
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 3; ++frame) simulation.advance_frame();
    hashes.push_back(simulation.stats().hash);
  }
  set_thread_count(0);
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

// The clock of a stage counts its calls: a rigid scene never enters the stages of deformable bodies, and a
// soft body alone never enters those of contact.
TEST(Step, AnEffectThatIsNotCalledForIsNeverEntered) {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 2, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  EXPECT_EQ(simulation.world().clock[Stage::elastic_forces].calls, 0);
  EXPECT_EQ(simulation.world().clock[Stage::damping_solve].calls, 0);
  EXPECT_GT(simulation.world().clock[Stage::collisions].calls, 0);

  scene::Scene alone = test::free_space();
  test::add_soft_box(alone, "soft", Vec3::Zero(), Vec3(1, 1, 1), 2);
  Simulation floating(alone, test::plan(alone));
  floating.advance_frame();
  for (Stage stage :
       {Stage::contact_candidates, Stage::collisions, Stage::contact, Stage::push_out, Stage::contact_at_end})
    EXPECT_EQ(floating.world().clock[stage].calls, 0);
  EXPECT_GT(floating.world().clock[Stage::elastic_forces].calls, 0);
}

// A NaN ends the frame with an error that names the stage, the body and a remedy, and the last good frame is
// restored.
TEST(Step, AStateThatStopsBeingFiniteNamesStageBodyAndParticle) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  const std::uint64_t hash = simulation.stats().hash;
  const Particles& particles = simulation.world().bodies.particles;
  const std::size_t first = static_cast<std::size_t>(simulation.world().bodies.deformable[1].first_particle);
  simulation.world().bodies.particles.v[first + 3].x() = std::numeric_limits<double>::quiet_NaN();
  try {
    simulation.advance_frame();
    FAIL() << "a NaN went through a frame";
  } catch (const SimulationError& error) {
    EXPECT_EQ(error.fault().body, "soft3");
    EXPECT_EQ(error.fault().stage, "I.1 advance velocity");
    EXPECT_EQ(error.fault().frame, 1);
    EXPECT_NE(std::string(error.what()).find("solver.cfl"), std::string::npos);
  }
  // The last good frame is restored.
  EXPECT_TRUE(particles.v[first + 3].allFinite());
  simulation.load_state(simulation.save_state());
  EXPECT_EQ(simulation.stats().hash, hash);
}

// A run from a saved state has the same state, to the byte, as one that went through; a state of the wrong
// length is refused.
TEST(Simulation, AResumedRunContinuesBitIdentically) {
  const scene::Scene scene = test::small_stack();
  Simulation whole(scene, test::plan(scene)), first(scene, test::plan(scene)),
      second(scene, test::plan(scene));
  for (int i = 0; i < 4; ++i) whole.advance_frame();
  for (int i = 0; i < 2; ++i) first.advance_frame();
  second.load_state(first.save_state());
  EXPECT_EQ(second.frame(), 2);
  for (int i = 0; i < 2; ++i) second.advance_frame();
  EXPECT_EQ(second.save_state(), whole.save_state());
  std::vector<unsigned char> wrong = whole.save_state();
  wrong.pop_back();
  EXPECT_THROW(second.load_state(wrong), Error);
}

}  // namespace
}  // namespace duet::step_test
