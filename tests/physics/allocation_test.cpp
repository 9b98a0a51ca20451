// Nothing allocates in a warmed-up step. malloc itself is counted: Eigen and the standard library both end
// there.
#include <atomic>
#include <cstdlib>

#include "tests/support/random_state.h"
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

namespace duet {
namespace {

TEST(Allocation, CountingSeesVectorsAndEigen) {
  const long before = allocations;
  std::vector<double>* vector = new std::vector<double>(100, 1.0);
  Eigen::VectorXd eigen =
      Eigen::VectorXd::Constant(static_cast<Eigen::Index>(vector->size()), vector->back());
  EXPECT_GE(allocations - before, 3);
  EXPECT_EQ(eigen.sum(), 100);
  delete vector;
}

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
  for (int i = 0; i < 4; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const double dt = choose_time_step(world, 0);
  const long before = allocations;
  for (int i = 0; i < 50; ++i) step(world, 4.0 / 24 + i * dt, dt);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(world.counters.contacts, 10);
  set_thread_count(0);
}

}  // namespace
}  // namespace duet

#endif
