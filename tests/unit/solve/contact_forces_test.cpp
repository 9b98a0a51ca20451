// Contacts inside of a velocity solve, on random velocities: their impulses are the gradient of a potential,
// push and never pull, and their blocks are the diagonal of their derivative.
#include "sim/solve/contact_forces.h"

#include <algorithm>
#include <limits>

#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/solve/velocity_blocks.h"

namespace duet::contact_forces_test {
namespace {

using test::random_velocity;

// The contacts of a stack after a few steps, built for a solve.
class ContactsInSolve : public ::testing::Test {
 protected:
  ContactsInSolve() : scene_(test::small_stack()), simulation_(scene_, test::plan(scene_)) {
    for (int i = 0; i < 3; ++i) step(world(), 0, 1e-3);  // so that contacts carry weight
    islands_.begin(bodies());
    islands_.finish();
    blocks_.find(bodies(), 1e-3);
    VelocitySystem(bodies(), 1e-3, ImplicitForces::damping, nullptr, force_, inertia_);
    contacts_.build(bodies(), world().context.contact.contacts, world().context.contact.graph, islands_, 1,
                    blocks_.own());
  }
  World& world() { return simulation_.world(); }
  Bodies& bodies() { return world().bodies; }
  GeneralizedVelocity zero() { return test::no_velocity(bodies()); }
  // Returns the inner product with the mass matrix.
  double inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) {
    return VelocitySystem(bodies(), 1e-3, ImplicitForces::damping, nullptr, force_, inertia_).inner(u, v);
  }
  // Returns the potential at `at` + `share` `direction`, with the bounds of friction from `at`, J.
  double potential(const GeneralizedVelocity& at, double share, const GeneralizedVelocity& direction) {
    contacts_.evaluate(at);
    contacts_.set_bounds();
    GeneralizedVelocity there = at;
    VelocitySystem::axpy(share, direction, there);
    return contacts_.evaluate(there);
  }

  scene::Scene scene_;
  Simulation simulation_;
  Islands islands_;
  VelocityBlocks blocks_;
  ContactForces contacts_;
  std::vector<Vec3> force_;
  std::vector<Mat3> inertia_;
};

// The derivative of the potential along d is -d . impulses, by central differences. A Newton search minimizes
// that potential.
TEST_F(ContactsInSolve, ImpulsesAreTheGradientOfTheirPotential) {
  ASSERT_FALSE(contacts_.empty());
  for (unsigned seed = 1; seed < 6; ++seed) {
    GeneralizedVelocity v = random_velocity(bodies(), seed), d = random_velocity(bodies(), seed + 50);
    constexpr double share = 1e-6;
    const double slope = (potential(v, share, d) - potential(v, -share, d)) / (2 * share);
    potential(v, 0, d);
    GeneralizedVelocity impulses = zero();
    contacts_.add_velocities(1, impulses);
    const double expected = -inner(d, impulses);
    EXPECT_NEAR(slope, expected, 1e-5 * std::abs(expected));
  }
}

// The differentials are the derivative of the impulses; the careful ones are at least as large, to bound what
// friction loses along a step.
TEST_F(ContactsInSolve, DifferentialsAreTheirDerivative) {
  for (const bool careful : {false, true})
    for (unsigned seed = 1; seed < 6; ++seed) {
      const GeneralizedVelocity v = random_velocity(bodies(), seed), d = random_velocity(bodies(), seed + 50);
      constexpr double share = 1e-7;
      GeneralizedVelocity before = zero(), after = zero(), change = zero();
      potential(v, 0, d);
      contacts_.add_velocities(1, before);
      contacts_.set_careful(careful);
      contacts_.add_differentials(d, change);
      potential(v, share, d);
      contacts_.add_velocities(1, after);
      VelocitySystem::axpy(-1, before, after);
      const double falls = -inner(d, after) / share, expected = inner(d, change);
      if (careful)
        EXPECT_GE(expected, 0.9999 * falls);  // an upper bound of the decrease
      else
        EXPECT_NEAR(falls, expected, 1e-4 * expected);
    }
}

// Each impulse pushes and lies in its friction cone, and together they change the total momentum by no more
// than the static ground gives.
TEST_F(ContactsInSolve, ImpulsesKeepMomentumAndNeverPull) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    potential(random_velocity(bodies(), seed), 0, zero());
    ContactSet found = world().context.contact.contacts;
    contacts_.store(1, found);
    for (const ContactPoint& contact : found.points) {
      const double normal = contact.impulse.dot(contact.normal);
      EXPECT_GE(normal, -1e-12 * contact.impulse.norm());
      EXPECT_LE((contact.impulse - normal * contact.normal).norm(),
                contact.friction * normal * (1 + 1e-12) + 1e-12);
    }
    GeneralizedVelocity impulses = zero();
    contacts_.add_velocities(1, impulses);
    Vec3 sum = Vec3::Zero();
    double size = 0;
    const auto add = [&](double mass, const Vec3& v) {
      sum += mass * v;
      size += mass * v.norm();
    };
    for (std::size_t p = 0; p < bodies().particles.size(); ++p)
      add(bodies().particles.mass[p], impulses.particle[p]);
    for (std::size_t i = 0; i < bodies().rigid.size(); ++i)
      add(bodies().rigid.properties[i].mass, impulses.linear[i]);
    // The rest of the sum is the impulse of the ground, which has no velocity that would show it.
    Vec3 from_ground = Vec3::Zero();
    for (const ContactPoint& contact : found.points)
      if (!bodies().rigid.properties[as_index(contact.host)].is_dynamic()) from_ground += contact.impulse;
    EXPECT_LT((sum - from_ground).norm(), 1e-12 * size);
  }
}

// Contacts out of reach take no part in the solve. If they kept the impulse of an earlier solve, it would act
// a second time.
TEST_F(ContactsInSolve, WhatIsOutOfReachHasNoImpulse) {
  ContactSet found = world().context.contact.contacts;
  ASSERT_FALSE(found.points.empty());
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    found.points[i].impulse = found.points[i].normal;
    if (i % 2 == 0) found.points[i].target = -std::numeric_limits<double>::infinity();
  }
  contacts_.build(bodies(), found, world().context.contact.graph, islands_, 1, blocks_.own());
  potential(random_velocity(bodies(), 1), 0, zero());
  contacts_.store(1, found);
  int out_of_reach = 0;
  for (const ContactPair& pair : found.pairs) {
    if (!pair.active) continue;
    for (int i = pair.begin; i < pair.end; ++i) {
      if (i % 2 != 0) continue;
      ++out_of_reach;
      EXPECT_TRUE(found.points[as_index(i)].impulse.isZero(0));
    }
  }
  EXPECT_GT(out_of_reach, 0);
}

// The blocks are the diagonal of the derivative: what it does to the velocity of one particle, or of one
// body, alone.
TEST_F(ContactsInSolve, BlocksAreTheDiagonal) {
  potential(random_velocity(bodies(), 4), 0, zero());
  contacts_.set_careful(false);
  std::vector<SymmetricBlock> particle(bodies().particles.size());
  std::vector<Mat6> rigid(bodies().rigid.size(), Mat6::Zero());
  contacts_.add_blocks(particle, rigid);
  double largest = 0;
  for (const SymmetricBlock& block : particle) largest = std::max(largest, block.diagonal.maxCoeff());
  ASSERT_GT(largest, 0);
  for (std::size_t p = 0; p < particle.size(); ++p) {
    GeneralizedVelocity alone = zero(), change = zero();
    alone.particle[p] = Vec3(0.3, -0.8, 0.5);
    contacts_.add_differentials(alone, change);
    EXPECT_NEAR(inner(alone, change), alone.particle[p].dot(particle[p] * alone.particle[p]), 1e-9 * largest);
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    GeneralizedVelocity alone = zero(), change = zero();
    Vec6 twist;
    twist << 0.2, 0.7, -0.4, 0.9, -0.1, 0.6;
    if (!bodies().rigid.properties[i].is_dynamic()) continue;
    alone.linear[i] = twist.head<3>();
    alone.angular[i] = twist.tail<3>();
    contacts_.add_differentials(alone, change);
    const double expected = twist.dot(rigid[i] * twist);
    EXPECT_NEAR(inner(alone, change), expected, 1e-9 * std::max(expected, 1.0));
  }
}

}  // namespace
}  // namespace duet::contact_forces_test
