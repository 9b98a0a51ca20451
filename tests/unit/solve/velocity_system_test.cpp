// The operator of the implicit solve and its contact projection, on random velocities.
#include "sim/solve/velocity_system.h"

#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/random_state.h"
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "sim/solve/conjugate_gradient.h"

namespace duet::velocity_system_test {
namespace {

using test::random_velocity;

// The velocity system of a stack after a few steps, with the projection of its contacts.
class ConstrainedSystem : public ::testing::Test {
 protected:
  ConstrainedSystem() : scene_(test::small_stack()), simulation_(scene_, test::plan(scene_)) {
    World& w = world();
    for (int i = 0; i < 3; ++i) step(w, 0, 1e-3);  // contacts then carry weight, elements are strained
    projection_.build(w.bodies, w.context.contact.contacts, w.context.contact.graph,
                      1);  // the contacts that V.4 left with an impulse
  }
  World& world() { return simulation_.world(); }
  VelocitySystem system(const ContactProjection* projection) {
    return VelocitySystem(world().bodies, dt_, ImplicitForces::damping, projection, force_, inertia_);
  }

  static constexpr double dt_ = 1e-3;
  scene::Scene scene_;
  Simulation simulation_;
  ContactProjection projection_;
  std::vector<Vec3> force_;
  std::vector<Mat3> inertia_;
};

// A = 1 + M^-1 damping is symmetric in the mass inner product, and at least the identity.
TEST_F(ConstrainedSystem, OperatorIsSymmetricPositiveDefinite) {
  VelocitySystem A = system(nullptr);
  for (unsigned seed = 1; seed < 6; ++seed) {
    const GeneralizedVelocity u = random_velocity(world().bodies, seed),
                              v = random_velocity(world().bodies, seed + 50);
    GeneralizedVelocity Au, Av;
    A.apply(u, Au);
    A.apply(v, Av);
    const double uu = A.inner(u, Au);
    EXPECT_NEAR(A.inner(u, Av), A.inner(v, Au), 1e-12 * uu);
    EXPECT_GE(uu, A.inner(u, u));  // A = 1 + damping
  }
}

// One symmetric sweep is self-adjoint in the mass inner product, as conjugate gradients require, and takes
// energy out. A sweep in one direction alone would not be symmetric.
TEST_F(ConstrainedSystem, ProjectionIsSymmetricAfterOneSweep) {
  VelocitySystem P = system(&projection_);
  for (unsigned seed = 1; seed < 6; ++seed) {
    const GeneralizedVelocity u = random_velocity(world().bodies, seed),
                              v = random_velocity(world().bodies, seed + 50);
    GeneralizedVelocity Pu = u, Pv = v;
    P.project(Pu);
    P.project(Pv);
    EXPECT_NEAR(P.inner(u, Pv), P.inner(v, Pu), 1e-12 * P.inner(u, u));
    EXPECT_LT(P.inner(Pu, Pu),
              0.999 * P.inner(u, u));  // it takes something away, and a projection adds nothing
  }
}

// Returns linear and angular momentum of the velocities `v`, the latter about the origin.
Momentum momentum_of(const Bodies& bodies, const GeneralizedVelocity& v) {
  Momentum sum;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
    const Vec3 linear = bodies.particles.mass[p] * v.particle[p];
    sum += {linear, bodies.particles.x[p].cross(linear)};
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!bodies.rigid.properties[i].is_dynamic()) continue;
    const Pose& pose = bodies.rigid.state[i].pose;
    const Vec3 linear = bodies.rigid.properties[i].mass * v.linear[i],
               in_body = pose.orientation.conjugate() * v.angular[i];
    sum += {linear, pose.position.cross(linear) +
                        pose.orientation * bodies.rigid.properties[i].inertia.cwiseProduct(in_body)};
  }
  return sum;
}

// The impulses of a projection act on both bodies at one place, wherever its sweeps end: a stack that is
// pressed together in free space keeps its momentum to rounding.
TEST(ContactProjection, KeepsMomentumWhereverItStops) {
  scene::Scene scene = test::small_stack();
  scene.ground.reset();
  scene.gravity.setZero();
  scene.rigid[1].placement.velocity = Vec3(0, -1, 0);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 3; ++i) step(world, 0, 1e-3);
  for (const int sweeps : {1, 200}) {
    ContactProjection projection;
    projection.build(world.bodies, world.context.contact.contacts, world.context.contact.graph, sweeps);
    ASSERT_FALSE(projection.empty());
    GeneralizedVelocity v = random_velocity(world.bodies, 4);
    const Momentum before = momentum_of(world.bodies, v);
    const GeneralizedVelocity start = v;
    projection.project(v);
    const Momentum change = momentum_of(world.bodies, v) - before;
    double moved = 0;  // kg m/s
    for (std::size_t p = 0; p < v.particle.size(); ++p)
      moved += world.bodies.particles.mass[p] * (v.particle[p] - start.particle[p]).norm();
    EXPECT_GT(moved, 10) << sweeps;
    test::expect_below(change.linear.norm() / moved, 1e-12, "change of momentum, over what has moved");
    test::expect_below(change.angular.norm() / moved, 1e-12, "change of angular momentum, over that, m");
  }
}

// With 200 sweeps P P = P, and the contacts with an impulse have no relative normal velocity left.
TEST_F(ConstrainedSystem, ProjectionConverges) {
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 200);
  VelocitySystem P = system(&projection_);
  GeneralizedVelocity once = random_velocity(world().bodies, 3);
  P.project(once);
  GeneralizedVelocity twice = once, difference;
  P.project(twice);
  VelocitySystem::subtract(twice, once, difference);
  EXPECT_LT(P.inner(difference, difference), 1e-16 * P.inner(once, once));  // P P = P
  for (const ContactPair& pair : world().context.contact.contacts.pairs)
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = world().context.contact.contacts.points[static_cast<std::size_t>(i)];
      if (contact.impulse.isZero(0) || contact.is_rigid_pair()) continue;
      const auto host = static_cast<std::size_t>(contact.host);
      const Vec3 relative = weighted(surface_point(world().bodies, contact), once.particle) -
                            once.linear[host] - once.angular[host].cross(contact.host_arm);
      EXPECT_LT(std::abs(relative.dot(contact.normal)), 1e-7);
    }
}

// The true projected residual P (b - A x) is as small as the search says, with a factor of ten for the
// recurrence of the residual.
TEST_F(ConstrainedSystem, ConjugateGradientsReachTheTolerance) {
  // With this many sweeps P P = P.
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 200);
  VelocitySystem A = system(&projection_);
  const GeneralizedVelocity b = random_velocity(world().bodies, 9);
  GeneralizedVelocity x = b, r, s, q;
  A.project(x);
  const CgResult result = conjugate_gradient(A, b, 1e-9, 400, x, r, s, q);
  EXPECT_TRUE(result.converged);
  GeneralizedVelocity Ax, residual;
  A.apply(x, Ax);
  VelocitySystem::subtract(b, Ax, residual);
  A.project(residual);
  EXPECT_LT(A.norm(residual), 1e-8);
}

// The forces that are summed during the search are the damping forces of the solution, to the rounding of as
// many sums.
TEST_F(ConstrainedSystem, CollectsTheForcesOfItsSolution) {
  VelocitySystem A = system(&projection_);
  const GeneralizedVelocity b = random_velocity(world().bodies, 12);
  GeneralizedVelocity x = b, r, s, q;
  A.project(x);
  // The forces are not zero at first, because the solve adds to them.
  std::vector<Vec3> collected(x.particle.size(), Vec3(1, 2, 3)), expected = collected;
  std::vector<Vec3> unused;
  A.collect_forces(collected, unused);
  const CgResult result = conjugate_gradient(A, b, 1e-6, 400, x, r, s, q);
  A.finish();
  EXPECT_TRUE(unused.empty());
  EXPECT_GT(result.iterations, 3);
  world().bodies.forces.add_damping_forces(x.particle, expected);
  double largest = 0, difference = 0;
  for (std::size_t p = 0; p < expected.size(); ++p) {
    largest = std::max(largest, expected[p].norm());
    difference = std::max(difference, (collected[p] - expected[p]).norm());
  }
  EXPECT_LT(difference, 1e-12 * largest);
}

// A residual that has to fall by a factor of 1e3 takes its products in single precision, and one that has to
// fall by 1e8 does not. Either way the true residual is below its tolerance (2 % for the rounding of floats),
// and the collected forces are those of the solution, without sum or moment.
TEST_F(ConstrainedSystem, SinglePrecisionIsTakenWhereItIsEnough) {
  // With this many sweeps P P = P.
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 200);
  BlockJacobi masses;
  std::vector<Vec3> unused(world().bodies.particles.size());
  // Damping is prepared for the present positions.
  world().bodies.forces.add_elastic_forces(world().bodies.particles.x, unused);
  VelocitySystem exact = system(&projection_);
  exact.use(masses, AssembleBlocks::all);
  projection_.use_inverse_masses(&masses.inverse);
  GeneralizedVelocity b = random_velocity(world().bodies, 9), start = b, r, s, q, residual;
  exact.apply_preconditioner(b);
  exact.project(start);
  const double before = conjugate_gradient(exact, b, 0, 0, start, r, s, q).residual;
  for (const double factor : {1e3, 1e8}) {
    VelocitySystem A = system(&projection_);
    A.use(masses, AssembleBlocks::missing);
    GeneralizedVelocity x = start;
    std::vector<Vec3> collected(x.particle.size(), Vec3::Zero()), expected = collected, scratch;
    A.collect_forces(collected, scratch);
    EXPECT_TRUE(conjugate_gradient(A, b, before / factor, 1000, x, r, s, q).converged);
    A.finish();
    A.apply(x, r);
    exact.apply(x, q);
    VelocitySystem::subtract(q, r, residual);
    EXPECT_EQ(exact.norm(residual) > 0, factor < 1e4);
    VelocitySystem::subtract(b, q, residual);
    exact.project(residual);
    EXPECT_LT(exact.norm(residual), 1.02 * before / factor);

    world().bodies.forces.add_damping_forces(x.particle, expected);
    double largest = 0, difference = 0;
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
    for (std::size_t p = 0; p < expected.size(); ++p) {
      largest = std::max(largest, expected[p].norm());
      difference = std::max(difference, (collected[p] - expected[p]).norm());
      sum += collected[p];
      moment += world().bodies.particles.x[p].cross(collected[p]);
    }
    EXPECT_LT(difference, (factor < 1e4 ? 1e-6 : 1e-12) * largest);
    EXPECT_LT(sum.norm(), 1e-12 * largest);
    EXPECT_LT(moment.norm(), 1e-12 * largest);  // m: lever arms are about 1
  }
}

// Mass-proportional damping has a moment, which the solve must not remove as if it were rounding.
TEST(VelocitySystem, DampingOfMassKeepsItsMoment) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "box", Vec3::Zero(), Vec3(1, 1, 1), 3, 1e5);
  scene.materials[0].mass_damping = 2;
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  std::vector<Vec3> force(bodies.particles.size(), Vec3::Zero()), scratch;
  bodies.forces.add_elastic_forces(bodies.particles.x, force);
  std::vector<Mat3> inertia;
  VelocitySystem A(bodies, 1e-3, ImplicitForces::damping, nullptr, force, inertia);
  BlockJacobi masses;
  A.use(masses, AssembleBlocks::all);
  GeneralizedVelocity b, x, r, s, q;
  to_generalized(bodies, b);
  x = b;
  for (std::size_t p = 0; p < b.particle.size(); ++p)
    b.particle[p] = Vec3(1, 5, 2).cross(bodies.particles.x[p]);
  A.apply_preconditioner(b);
  std::vector<Vec3> collected(b.particle.size(), Vec3::Zero()), expected = collected;
  A.collect_forces(collected, scratch);
  EXPECT_TRUE(conjugate_gradient(A, b, 1e-3, 100, x, r, s, q).converged);
  A.finish();
  bodies.forces.add_damping_forces(x.particle, expected);
  const auto moment = [&](const std::vector<Vec3>& forces) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t p = 0; p < forces.size(); ++p) sum += bodies.particles.x[p].cross(forces[p]);
    return sum;
  };
  EXPECT_GT(moment(expected).norm(), 1);
  EXPECT_LT((moment(collected) - moment(expected)).norm(), 1e-12 * moment(expected).norm());
}

// In the inner product of the block-Jacobi preconditioner operator and projection are self-adjoint as well.
// The solution under constraints is the same, because stationarity does not depend on the inner product, and
// it takes fewer iterations.
TEST_F(ConstrainedSystem, PreconditionerKeepsTheSolution) {
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 200);
  BlockJacobi masses;
  const GeneralizedVelocity b = random_velocity(world().bodies, 9);
  GeneralizedVelocity plain = b, x, r, s, q, weighed = b;
  VelocitySystem A = system(&projection_);
  A.project(plain);
  x = plain;
  const CgResult without = conjugate_gradient(A, b, 1e-10, 1000, plain, r, s, q);
  EXPECT_TRUE(without.converged);

  VelocitySystem C = system(&projection_);
  C.use(masses, AssembleBlocks::all);
  C.apply_preconditioner(weighed);
  projection_.use_inverse_masses(&masses.inverse);
  const GeneralizedVelocity u = random_velocity(world().bodies, 3), v = random_velocity(world().bodies, 4);
  GeneralizedVelocity Cu, Cv, Pu = u, Pv = v;
  C.apply(u, Cu);
  C.apply(v, Cv);
  C.project(Pu);
  C.project(Pv);
  EXPECT_NEAR(C.inner(u, Cv), C.inner(v, Cu), 1e-12 * C.inner(u, u));
  EXPECT_NEAR(C.inner(u, Pv), C.inner(v, Pu), 1e-12 * C.inner(u, u));
  // Rows with the particles' own masses would need many more sweeps in this inner product.
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 1);
  const auto left_by_one_sweep = [&](const std::vector<SymmetricBlock>* inverse_mass) {
    projection_.use_inverse_masses(inverse_mass);
    GeneralizedVelocity once = u, twice, difference;
    projection_.project(once);
    twice = once;
    projection_.project(twice);
    VelocitySystem::subtract(twice, once, difference);
    return A.norm(difference) / A.norm(once);
  };
  EXPECT_LT(left_by_one_sweep(&masses.inverse), 3 * left_by_one_sweep(nullptr));
  projection_.build(world().bodies, world().context.contact.contacts, world().context.contact.graph, 200);
  projection_.use_inverse_masses(&masses.inverse);
  const CgResult with = conjugate_gradient(C, weighed, 1e-10, 1000, x, r, s, q);
  EXPECT_TRUE(with.converged);
  EXPECT_LT(with.iterations, without.iterations);
  VelocitySystem::subtract(x, plain, r);
  EXPECT_LT(A.norm(r), 1e-8);
}

}  // namespace
}  // namespace duet::velocity_system_test
