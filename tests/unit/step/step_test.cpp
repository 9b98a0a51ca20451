#include "sim/step/step.h"

#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

TEST(TimeStep, FollowsTheElasticLimitAndItsShare) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(2, 2, 2), 6);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const double limit = 2 / std::sqrt(world.bodies.elements.rest_squared_frequency());
  world.settings.cfl = 0.9;
  EXPECT_DOUBLE_EQ(choose_time_step(world, 0), 0.9 * limit);
  world.settings.cfl = 0.3;
  EXPECT_DOUBLE_EQ(choose_time_step(world, 0), 0.3 * limit);
}

TEST(TimeStep, FollowsTheTravelAndTheTurnOfRigidBodies) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "ball", Vec3::Zero(), 0.5, 1).placement.velocity = Vec3(200, 0, 0);
  Simulation fast(scene, test::plan(scene));
  EXPECT_DOUBLE_EQ(choose_time_step(fast.world(), 0), 0.1 * 1 / 200);
  scene.rigid[0].placement.velocity.setZero();
  scene.rigid[0].placement.angular_velocity = Vec3(0, 1000, 0);
  Simulation spinning(scene, test::plan(scene));
  EXPECT_DOUBLE_EQ(choose_time_step(spinning.world(), 0), std::min(0.314159 / 1000, 0.1 * 1 / (0.5 * 1000)));
}

TEST(TimeStep, FollowsTheMotionOfKinematicBodiesOverTheStepToCome) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& plate = test::add_box(scene, "plate", Vec3::Zero(), Vec3(4, 0.1, 4), 1);
  plate.mass.reset();
  plate.is_kinematic = true;
  plate.motion.interpolation = Interpolation::linear;
  plate.motion.keyframes = {{1, Vec3::Zero(), {}, false, {}}, {2, Vec3(0, 50, 0), {}, false, {}}};
  test::add_ball(scene, "ball", Vec3(0, 9, 0), 0.5, 1);
  const auto limit = [&](double time) {
    const Simulation simulation(scene, test::plan(scene));
    return choose_time_step(simulation.world(), time);
  };
  EXPECT_EQ(limit(0), 1.0 / 48) << "at rest, as long as the step may last";
  EXPECT_DOUBLE_EQ(limit(0.99), 0.1 * 1 / 50) << "a tenth of the ball, which is what it could miss";
  EXPECT_EQ(limit(2.1), 1.0 / 48);

  scene.rigid[0].motion = {};
  scene.rigid[0].motion.spin = {{Vec3::UnitY(), 2, 0, {}, 0}};
  const double spin = 4 * EIGEN_PI, radius = Vec3(2, 0.05, 2).norm();
  EXPECT_DOUBLE_EQ(limit(0), std::min(0.1 * 1 / (radius * spin), 0.314159 / spin));

  scene.rigid[0].motion = {};  // a fast oscillation that goes nowhere is still one that shakes others
  scene.rigid[0].motion.sinusoid = {{Vec3(0, 1e-4, 0), {}, 40, 0, 0, {}}};
  EXPECT_DOUBLE_EQ(limit(0), 0.314159 / (80 * EIGEN_PI));

  scene.rigid.pop_back();
  scene.rigid[0].motion.sinusoid = {{Vec3(0, 1, 0), {}, 2, 0, 0, {}}};
  EXPECT_DOUBLE_EQ(limit(0), 0.1 * 0.1 / (4 * EIGEN_PI)) << "nobody else is there: a tenth of itself";
}

// The stability limit of the rule is one: an undamped body rings at 0.9 of it without growing, and blows up
// beyond it.
double energy_after(double cfl) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 2, 1e5);
  scene.materials[0].damping = 0;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
    world.bodies.particles.v[p] = 1e-3 * Vec3((p % 3) - 1.0, (p % 5) - 2.0, (p % 7) - 3.0);
  const double dt = cfl * 2 / std::sqrt(world.bodies.elements.rest_squared_frequency());
  const double start = kinetic_energy(world.bodies);
  for (int i = 0; i < 3000; ++i) step(world, 0, dt);
  return (kinetic_energy(world.bodies) + world.bodies.elements.energy(world.bodies.particles.x)) / start;
}

TEST(TimeStep, RuleIsStableWithoutDampingAndNotFarFromTheLimit) {
  EXPECT_LT(energy_after(0.9), 1.5);  // an explicit symplectic scheme's energy wavers, but does not grow
  EXPECT_THROW(EXPECT_GT(energy_after(3), 1e3), SimulationError);
}

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

TEST(Step, AnEffectThatIsNotCalledForIsNeverEntered) {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 2, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  EXPECT_EQ(simulation.world().clock[Stage::elastic_forces].calls, 0);
  EXPECT_EQ(simulation.world().clock[Stage::damping_solve].calls, 0);
  EXPECT_GT(simulation.world().clock[Stage::collide].calls, 0);

  scene::Scene alone = test::free_space();
  test::add_soft_box(alone, "soft", Vec3::Zero(), Vec3(1, 1, 1), 2);
  Simulation floating(alone, test::plan(alone));
  floating.advance_frame();
  for (Stage stage :
       {Stage::broad_phase, Stage::collide, Stage::apply_contact, Stage::push_out, Stage::velocity_contact})
    EXPECT_EQ(floating.world().clock[stage].calls, 0);
  EXPECT_GT(floating.world().clock[Stage::elastic_forces].calls, 0);
}

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
  // The last good frame is back.
  EXPECT_TRUE(particles.v[first + 3].allFinite());
  simulation.load_state(simulation.save_state());
  EXPECT_EQ(simulation.stats().hash, hash);
}

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
}  // namespace duet
