// A step allocates no memory once it has warmed up. The tests count calls of malloc itself, because Eigen and
// the standard library both end there.
#include <atomic>
#include <cmath>
#include <cstdlib>

#include "tests/support/articulated.h"
#include "tests/support/random_state.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/base/parallel.h"
#include "sim/step/step.h"

// The sanitizers bring their own malloc, which must not be replaced.
#if !defined(__SANITIZE_ADDRESS__)

namespace {
std::atomic<long> allocations{0};
}

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* __libc_memalign(std::size_t alignment, std::size_t size);

extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}

extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}

namespace duet::allocation_test {
namespace {

// Checks the counter itself, without which the other tests could not fail.
TEST(Allocation, CountingSeesVectorsAndEigen) {
  const long before = allocations;
  std::vector<double>* vector = new std::vector<double>(100, 1.0);
  Eigen::VectorXd eigen =
      Eigen::VectorXd::Constant(static_cast<Eigen::Index>(vector->size()), vector->back());
  EXPECT_GE(allocations - before, 3);
  EXPECT_EQ(eigen.sum(), 100);
  delete vector;
}

// The scene has a stack of rigid and incompressible soft boxes under a kinematic box that spins and swings.
// After one period of the swing most counts of contacts have been seen.
TEST(Allocation, NoneInAWarmedUpStep) {
  set_thread_count(1);
  scene::Scene scene = test::small_stack();
  scene.deformable[0].incompressible = true;
  scene::RigidBody& top = test::add_box(scene, "top", Vec3(0, 4.49, 0), Vec3(1, 1, 1), 1);
  top.mass.reset();
  top.is_kinematic = true;
  top.motion.spin = {{Vec3::UnitY(), 0.1, 0, {}, 0}};
  top.motion.sinusoid = {{Vec3(0, 0.01, 0), {}, 2, 0, 0, {}}};
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 48; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 0);
  const long before = allocations;
  for (int i = 0; i < 50; ++i) step(world, 2 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.contacts, 10);
  set_thread_count(0);
}

// The balls swing back and forth, one of them far beyond the margin around its box, so that pairs of the
// broad phase come and go. After one period all pairs have been seen, and the second period must not
// allocate.
TEST(Allocation, NoneWhenPairsOfTheBroadPhaseComeAndGo) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < 64; ++i)
    test::add_ball(scene, "ball" + std::to_string(i), 0.25 * Vec3(i % 4, 1 + i / 4 % 4, i / 16), 0.1, 1);
  Bodies bodies = Simulation(scene, test::plan(scene)).world().bodies;
  const std::vector<RigidState> start = bodies.rigid.state;
  BroadPhase broad_phase;
  const auto swing = [&] {
    for (int call = 0; call < 40; ++call) {
      for (std::size_t i = 0; i < 64; ++i)
        bodies.rigid.state[i].pose.position =
            start[i].pose.position + (i == 20 ? 2 : 0.01 * static_cast<double>(i % 8)) *
                                         std::sin(2 * EIGEN_PI * call / 40) * Vec3::UnitX();
      bound_bodies(bodies, broad_phase.bounds);
      broad_phase.margin.assign(broad_phase.bounds.size(), 0.03);
      broad_phase.find({});
    }
  };
  swing();
  const long before = allocations;
  const std::int64_t found = broad_phase.counts().found;
  swing();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(broad_phase.counts().found - found, 40);
  set_thread_count(0);
}

// The soft boxes touch each other and themselves, so that the search for self-contact runs as well.
TEST(Allocation, NoneInAWarmedUpStepOfSoftBodiesThatTouch) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2).self_collision = true;
  test::add_soft_box(scene, "upper", Vec3(0.1, 1.55, 0.05), Vec3(1, 1, 1), 2);
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 12; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 0);
  world.counters.self_repulsions = 0;
  const std::int64_t searches = world.context.surfaces.candidates.searches();
  const long before = allocations;
  for (int i = 0; i < 100; ++i) step(world, 0.5 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.self_repulsions, 0);
  EXPECT_LT(world.context.surfaces.candidates.searches() - searches, 10)
      << "pairs are kept while bodies stand";
}

// Two free bones in flesh and a cradle of jointed balls that strike each other exercise the articulated
// response, which treats all bodies of a jointed group together.
TEST(Allocation, NoneInAWarmedUpStepOfBonesInFleshAndOfACradle) {
  set_thread_count(1);
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 2, scene::JointType::point, false);
  scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3(1, 0, 0), Vec3(2.2, 0.3, 0.3), 2);
  flesh.shape.cells = Vec3i(12, 2, 2);
  flesh.attach = {"link0", "link1"};
  test::add_peg(scene, "bar", Vec3(0, 8, 0));
  for (int i = 0; i < 3; ++i) {
    const std::string name = "ball" + std::to_string(i);
    scene::RigidBody& ball = test::add_ball(scene, name, Vec3(0.21 * i, 4, 0), 0.1, 1);
    ball.restitution = 1;
    if (i == 0) ball.placement.velocity = Vec3(1, 0, 0);
    test::add_joint(scene, scene::JointType::hinge, "bar", name, Vec3(0.21 * i, 5, 0), Vec3::UnitZ());
  }
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const std::vector<unsigned char> start = simulation.save_state();
  for (int i = 0; i < 4; ++i) simulation.advance_frame();  // by now the balls have met
  simulation.load_state(start);
  const double dt = choose_time_step(world, 0);
  const long before = allocations;
  for (int i = 0; i * dt < 4.0 / 24; ++i) step(world, i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.bodies.rigid.state.back().velocity.norm(), 0.5) << "the last ball has been struck";
  set_thread_count(0);
}

// The scene has mass-spring cloth on a ball, a panel of elements, a rod and a mass-spring volume.
TEST(Allocation, NoneInAWarmedUpStepOfShellsRodsAndSprings) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 0.2, 0), 0.2, 5);
  test::add_soft_box(scene, "box", Vec3(2, 0.251, 0), Vec3(0.5, 0.5, 0.5), 2).material = "cloth";
  scene.materials.clear();
  scene::Material& cloth = test::add_material(scene, "cloth");
  cloth.has_springs = cloth.has_bending_springs = true;
  test::add_panel(scene, "net", Vec3(0, 0.45, 0), Vec2(0.8, 0.8), 6, 0.01);
  test::add_material(scene, "felt").youngs_modulus = 1e5;
  test::add_panel(scene, "felt", Vec3(-2, 0.02, 0), Vec2(0.8, 0.8), 6, 0.01);
  test::add_rope(scene, "rope", {Vec3(3, 0.02, 0), Vec3(4, 0.02, 0)}, 12, 0.03);
  Simulation simulation(scene, test::plan(scene));
  // The warm-up lasts until the cloth has draped over the ball, because lists of contacts grow as it touches
  // more of it.
  for (int i = 0; i < 30; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 0);
  const long before = allocations;
  for (int i = 0; i < 50; ++i) step(world, 30.0 / 24 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.contacts, 10);
  set_thread_count(0);
}

// A controlled plate presses a soft box in implicit steps, with contact and control inside their solves.
TEST(Allocation, NoneInAWarmedUpImplicitStepOfAPress) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground();
  scene.solver.integration = scene::Integration::implicit;
  test::add_soft_box(scene, "block", Vec3(0, 0.25, 0), Vec3(0.4, 0.5, 0.4), 2, 1e6);
  test::add_box(scene, "plate", Vec3(0, 0.551, 0), Vec3(0.6, 0.1, 0.6), 10);
  scene::Joint& joint = test::add_joint(scene, scene::JointType::prismatic, "ground", "plate",
                                        Vec3(0, 0.551, 0), -Vec3::UnitY());
  joint.has_control = true;
  joint.control.torque_limit = 2000;
  joint.control.target.travel = 0.4;
  joint.travel.most = 0.3;
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 12; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 0.5);
  const long before = allocations;
  for (int i = 0; i < 20; ++i) step(world, 0.5 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.contacts, 0);
  set_thread_count(0);
}

// The scene is a controlled chain with limits and friction in its joints, whose first two links are bones in
// flesh.
TEST(Allocation, NoneInAWarmedUpStepOfJointsAndFleshOnBones) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground();
  test::add_chain(scene, 4, scene::JointType::point, false);
  for (scene::RigidBody& link : scene.rigid) link.placement.position.y() += 0.3;
  for (scene::Joint& joint : scene.joints) {
    joint.world.position->y() += 0.3;
    joint.swing = 20;
    joint.friction = 1;
  }
  scene.joints[0].has_control = true;
  scene.joints[0].control.torque_limit = 50;
  scene.joints[0].control.target.sinusoid = {{Vec3(0, 0, 20), 0, 0.25, 0}};
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", Vec3(1, 0.3, 0), Vec3(2, 0.4, 0.4), 1, 1e5);
  flesh.shape.cells = Vec3i(20, 4, 4);
  flesh.attach = {"link0", "link1"};
  Simulation simulation(scene, test::plan(scene));
  // Six periods of the motion pass first. After them no step brings more contacts than there were before.
  for (int i = 0; i < 36; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 1.5);
  const long before = allocations;
  for (int i = 0; i < 50; ++i) step(world, 1.5 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.contacts, 5);
  EXPECT_GT(world.bodies.bound.size(), 10u);
  set_thread_count(0);
}

}  // namespace
}  // namespace duet::allocation_test

#endif
