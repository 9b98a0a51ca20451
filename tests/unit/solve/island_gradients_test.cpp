// Velocity solves island by island, for a stack in contact and a soft box far away from it.
#include "sim/solve/island_gradients.h"

#include <algorithm>
#include <limits>

#include "tests/support/random_state.h"
#include <gtest/gtest.h>

namespace duet::island_gradients_test {
namespace {

using test::random_velocity;

class IslandSolve : public ::testing::Test {
 protected:
  static scene::Scene build() {
    scene::Scene scene = test::small_stack();
    // The box has more particles than one chunk of a parallel loop.
    test::add_soft_box(scene, "far", Vec3(20, 10, 0), Vec3(1, 1, 1), 10);
    return scene;
  }
  IslandSolve() : scene_(build()), simulation_(scene_, test::plan(scene_)) {
    for (int i = 0; i < 3; ++i) step(world(), 0, 1e-3);  // contacts then carry weight, elements are strained
    // With this many sweeps P P = P.
    projection_.build(bodies(), world().context.contact.contacts, world().context.contact.graph, 200);
    std::vector<Vec3> unused(bodies().particles.size());
    bodies().forces.add_elastic_forces(bodies().particles.x, unused);
    b_ = random_velocity(bodies(), 9);
  }
  World& world() { return simulation_.world(); }
  Bodies& bodies() { return world().bodies; }
  VelocitySystem system() {
    return VelocitySystem(bodies(), 1e-3, ImplicitForces::damping, &projection_, force_, inertia_);
  }
  CgResult solve(VelocitySystem& system, double tolerance, int most, GeneralizedVelocity& x) {
    islands_.begin(bodies());
    projection_.join(islands_);
    islands_.finish();
    return solve_islands(system, &projection_, masses_, AssembleBlocks::all, islands_, b_, tolerance, most, x,
                         search_);
  }
  // Returns the norm of P (b - A x) by the particles' own masses, m/s.
  double residual(const GeneralizedVelocity& x) {
    VelocitySystem plain = system();
    GeneralizedVelocity Ax, r;
    plain.apply(x, Ax);
    VelocitySystem::subtract(b_, Ax, r);
    plain.project(r);
    return plain.norm(r);
  }
  // Returns a velocity from which a solve may begin: P b.
  GeneralizedVelocity start() {
    GeneralizedVelocity x = b_;
    projection_.project(x);
    return x;
  }
  const DeformableBody& far() { return bodies().deformable.back(); }

  scene::Scene scene_;
  Simulation simulation_;
  ContactProjection projection_;
  Islands islands_;
  IslandSearch search_;
  BlockJacobi masses_;
  std::vector<Vec3> force_;
  std::vector<Mat3> inertia_;
  GeneralizedVelocity b_;
};

// The solutions of the two islands are that of the whole system, to the tolerance of the solves.
TEST_F(IslandSolve, FindsTheSolutionOfTheWholeSystem) {
  VelocitySystem A = system(), whole = system();
  GeneralizedVelocity x = start(), expected = x, r, s, q;
  EXPECT_TRUE(solve(A, 1e-10, 400, x).converged);
  EXPECT_EQ(islands_.size(), 2u);
  EXPECT_EQ(islands_.searched(), 0u);
  EXPECT_LT(residual(x), 1e-9);
  EXPECT_TRUE(conjugate_gradient(whole, b_, 1e-10, 1000, expected, r, s, q).converged);
  VelocitySystem::subtract(x, expected, r);
  EXPECT_LT(whole.norm(r), 1e-9);
}

// The forces that a solve collects are the damping forces of its solution, in single precision (loose
// tolerance) and double: for islands that are solved, for one that converges before the other, and for one
// that needs no iteration.
TEST_F(IslandSolve, CollectsTheForcesOfItsSolution) {
  for (const bool far_moves : {true, false})
    for (const double tolerance : {1e-2, 1e-8}) {
      if (!far_moves) for_each_particle(far(), [&](std::size_t p) { b_.particle[p] = Vec3(1, 2, 3); });
      VelocitySystem A = system();
      GeneralizedVelocity x = start();
      std::vector<Vec3> collected(x.particle.size(), Vec3::Zero()), expected = collected, scratch;
      A.collect_forces(collected, scratch);
      EXPECT_GT(solve(A, tolerance, 400, x).iterations, 3);
      A.finish();
      bodies().forces.add_damping_forces(x.particle, expected);
      double largest = 0, difference = 0;
      for (std::size_t p = 0; p < expected.size(); ++p) {
        largest = std::max(largest, expected[p].norm());
        difference = std::max(difference, (collected[p] - expected[p]).norm());
      }
      EXPECT_LT(difference, (tolerance > 1e-4 ? 1e-6 : 1e-12) * largest);
    }
}

// A body that moves as a whole is not damped, so its start is its solution. While the stack is solved, its
// velocity stays to the bit and the preconditioner is not assembled for it.
TEST_F(IslandSolve, LeavesAloneWhatBeginsAtItsSolution) {
  for_each_particle(far(), [&](std::size_t p) { b_.particle[p] = Vec3(1, 2, 3); });
  VelocitySystem A = system();
  GeneralizedVelocity x = start();
  const GeneralizedVelocity before = x;
  EXPECT_TRUE(solve(A, 1e-6, 400, x).converged);
  for_each_particle(far(), [&](std::size_t p) { EXPECT_EQ(x.particle[p], before.particle[p]); });
  EXPECT_NE(x.particle[0], before.particle[0]);
  EXPECT_TRUE(masses_.known.has(0));
  EXPECT_FALSE(masses_.known.has(x.particle.size() - 1));
  EXPECT_EQ(masses_.mass.back().diagonal, Vec3::Zero());
  EXPECT_LT(residual(x), 1e-5);

  b_.particle.back() += Vec3(1, 0, 0);  // not the solution any more: its blocks are added to the others
  const SymmetricBlock known = masses_.mass[0];
  A.use(masses_, AssembleBlocks::missing);
  EXPECT_TRUE(masses_.known.has(x.particle.size() - 1));
  EXPECT_GT(masses_.mass.back().diagonal.minCoeff(), 0);
  EXPECT_EQ(masses_.mass[0].diagonal, known.diagonal);
}

// A solve restricts operator and projection to islands that are searched. After it ends without convergence,
// both act on all bodies again.
TEST_F(IslandSolve, LeavesNoLimitsBehind) {
  VelocitySystem A = system();
  const GeneralizedVelocity u = random_velocity(bodies(), 4);
  GeneralizedVelocity before, after, Pu = u, Pv = u, difference;
  A.apply(u, before);
  A.project(Pu);
  GeneralizedVelocity x = start();
  for_each_particle(far(), [&](std::size_t p) { b_.particle[p] = x.particle[p] = Vec3(1, 2, 3); });
  const CgResult result = solve(A, 1e-10, 2, x);  // ends without convergence
  EXPECT_EQ(result.iterations, 2);
  EXPECT_FALSE(result.converged);
  EXPECT_GT(result.residual, 1e-10);
  VelocitySystem plain = system();
  plain.apply(u, after);
  plain.project(Pv);
  VelocitySystem::subtract(after, before, difference);
  EXPECT_EQ(plain.norm(difference), 0);
  VelocitySystem::subtract(Pu, Pv, difference);
  EXPECT_LT(plain.norm(difference), 1e-13);  // rows have had other masses in between
}

// A right side that is not a number gives a residual that is none either, so that the caller notices.
TEST_F(IslandSolve, SaysSoWhereThereIsNoSolution) {
  VelocitySystem A = system();
  GeneralizedVelocity x = start();
  b_.particle.back().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(std::isfinite(solve(A, 1e-10, 400, x).residual));
}

}  // namespace
}  // namespace duet::island_gradients_test
