#include "sim/deformable/forces/finite_elements.h"

#include <algorithm>

#include "tests/support/elastic_block.h"
#include <gtest/gtest.h>

namespace duet::finite_elements_test {
namespace {

using Block = test::ElasticBlock;

std::vector<Vec3> zeros(std::size_t n) { return std::vector<Vec3>(n, Vec3::Zero()); }

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

// lambda = E nu / ((1 + nu) (1 - 2 nu)) and mu = E / (2 (1 + nu)), with the values for E = 2e6 Pa and nu =
// 0.45.
TEST(FiniteElements, LameParametersFromYoungAndPoisson) {
  const LameParameters p = lame_parameters(2e6, 0.45, 0.01);
  EXPECT_NEAR(p.lambda, 3.1034e6 * 2, 1e3);
  EXPECT_NEAR(p.mu, 0.344828e6 * 2, 1);
}

// The force is -dE/dx, for a mild deformation and for one with many inverted elements, by central
// differences. Truncation and rounding stay below the bound of 1e-6, relative to the largest force. An
// extrapolation whose energy and stress do not belong together shows in the second case.
TEST(FiniteElements, ForcesAreTheGradientOfTheEnergy) {
  Block block(2);
  for (double size : {0.05, 0.6}) {
    const std::vector<Vec3> x = block.moved(block.random_field(1, size));
    if (size > 0.5) {
      EXPECT_GT(block.elements.strain(x).inverted, 5);
    }
    std::vector<Vec3> force = zeros(x.size());
    block.elements.add_elastic_forces(x, force);
    double largest = 0;
    for (const Vec3& f : force) largest = std::max(largest, f.norm());
    for (std::size_t p = 0; p < x.size(); p += 5)
      for (int k = 0; k < 3; ++k) {
        constexpr double h = 1e-6;
        std::vector<Vec3> up = x, down = x;
        up[p][k] += h;
        down[p][k] -= h;
        const double slope = (block.elements.energy(up) - block.elements.energy(down)) / (2 * h);
        EXPECT_NEAR(force[p][k], -slope, 1e-6 * largest);
      }
  }
}

// Elastic and viscous forces have neither sum nor moment, to rounding: a stress that is not symmetric would
// turn bodies in free flight.
TEST(FiniteElements, InternalForcesHaveNoResultantAndNoMoment) {
  Block block;
  const std::vector<Vec3> x = block.moved(block.random_field(2, 0.2)), v = block.random_field(3, 1);
  std::vector<Vec3> force = zeros(x.size());
  block.elements.add_elastic_forces(x, force);
  block.elements.add_damping_forces(v, force);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
  double scale = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += force[i];
    moment += x[i].cross(force[i]);
    scale += force[i].norm();
  }
  EXPECT_LT(sum.norm(), 1e-12 * scale);
  EXPECT_LT(moment.norm(), 1e-12 * scale);
}

// The damping operator G is symmetric, u . G v = v . G u, and takes energy out, u . G u < 0: conjugate
// gradients need both.
TEST(FiniteElements, DampingIsSymmetricAndTakesEnergyOut) {
  Block block;
  std::vector<Vec3> unused = zeros(block.x.size());
  block.elements.add_elastic_forces(block.moved(block.random_field(4, 0.3)), unused);
  for (unsigned seed = 10; seed < 15; ++seed) {
    const std::vector<Vec3> u = block.random_field(seed, 1), v = block.random_field(seed + 100, 1);
    std::vector<Vec3> Gu = zeros(u.size()), Gv = zeros(v.size());
    block.elements.add_damping_forces(u, Gu);
    block.elements.add_damping_forces(v, Gv);
    EXPECT_NEAR(dot(u, Gv), dot(v, Gu), 1e-12 * std::abs(dot(u, Gu)));
    EXPECT_LT(dot(u, Gu), 0);
  }
}

class AnyModel : public ::testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(FiniteElements, AnyModel,
                         ::testing::Values(MaterialModel::neo_hookean, MaterialModel::corotated,
                                           MaterialModel::st_venant_kirchhoff));

// The block is under tension, where no element's Hessian has to be projected, so that the differentials are
// the derivative of the forces by central differences.
TEST_P(AnyModel, ForceDifferentialsAreTheDerivativeOfTheForces) {
  Block block(2, GetParam());
  std::vector<Vec3> x = block.moved(block.random_field(6, 0.001));
  for (Vec3& p : x) p *= 1.02;
  const std::vector<Vec3> dx = block.random_field(7, 1);
  const auto forces_at = [&](double s) {
    std::vector<Vec3> y = x, force = zeros(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) y[i] += s * dx[i];
    block.elements.add_elastic_forces(y, force);
    return force;
  };
  constexpr double h = 1e-5;
  const std::vector<Vec3> up = forces_at(h), down = forces_at(-h);
  forces_at(0);
  block.elements.linearize();
  std::vector<Vec3> differential = zeros(x.size());
  block.elements.add_force_differentials(dx, differential);
  double largest = 0;
  for (const Vec3& f : differential) largest = std::max(largest, f.norm());
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_LT((differential[i] - (up[i] - down[i]) / (2 * h)).norm(), 1e-6 * largest);
}

// The blocks add up to the matrix of damping forces, with drag, and force differentials, to rounding. Some
// elements are inverted, and the damping of strongly compressed ones is among the forces.
TEST_P(AnyModel, BlocksAddUpToTheMatrixOfTheForces) {
  Block block(3, GetParam(), 0.5);
  block.elements.rely_on_damping(0.9, 0.1);
  block.elements.set_time_step(0.01);
  const std::vector<Vec3> x = block.moved(block.random_field(9, 0.3)), v = block.random_field(10, 1);
  std::vector<Vec3> unused = zeros(x.size()), damping = zeros(x.size()), differential = zeros(x.size());
  block.elements.add_elastic_forces(x, unused);
  block.elements.linearize();
  block.elements.add_damping_forces(v, damping);
  block.elements.add_force_differentials(v, differential);
  for (const BlockFactors factors : {BlockFactors{0.7, 0}, {0.7, 0.02}}) {
    std::vector<ParticleBlock> blocks;
    block.elements.append_blocks(factors, blocks);
    std::vector<Vec3> sum = zeros(x.size());
    for (const ParticleBlock& entry : blocks) {
      const auto row = static_cast<std::size_t>(entry.row), column = static_cast<std::size_t>(entry.column);
      sum[row] += entry.block * v[column];
      if (row != column) sum[column] += entry.block.transpose() * v[row];
    }
    double scale = 0;
    for (const Vec3& f : sum) scale = std::max(scale, f.norm());
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LT((sum[i] + factors.damping * damping[i] + factors.elasticity * differential[i]).norm(),
                1e-12 * scale);
  }
}

// With many inverted elements the projected stiffness is still symmetric and never adds energy, as the
// conjugate gradients of implicit steps need it.
TEST_P(AnyModel, InvertedElementsHavePositiveSemidefiniteStiffness) {
  Block block(3, GetParam());
  for (unsigned seed = 20; seed < 25; ++seed) {
    const std::vector<Vec3> x = block.moved(block.random_field(seed, 0.6));
    EXPECT_GT(block.elements.strain(x).inverted, 10);
    std::vector<Vec3> unused = zeros(x.size()), Ku = zeros(x.size()), Kv = zeros(x.size());
    block.elements.add_elastic_forces(x, unused);
    block.elements.linearize();
    const std::vector<Vec3> u = block.random_field(seed + 100, 1), v = block.random_field(seed + 200, 1);
    block.elements.add_force_differentials(u, Ku);
    block.elements.add_force_differentials(v, Kv);
    EXPECT_NEAR(dot(u, Kv), dot(v, Ku), 1e-12 * std::abs(dot(u, Ku)));
    EXPECT_LT(dot(u, Ku), 0);
  }
}

// Batches hold elements of one model each, however the bodies are mixed: each body has the forces, and the
// sum has the energy, that it has alone.
TEST(FiniteElements, SeveralModelsTogetherActAsEachAlone) {
  const MaterialModel models[] = {MaterialModel::corotated, MaterialModel::neo_hookean,
                                  MaterialModel::st_venant_kirchhoff, MaterialModel::corotated};
  const TetMesh mesh = box_lattice(Vec3(1, 1, 1), Vec3i(1, 1, 1));
  const std::size_t nodes = mesh.nodes.size();
  FiniteElements together;
  std::vector<Vec3> rest, x;
  Block block(1);
  const std::vector<Vec3> displacement = block.random_field(8, 0.3);
  for (std::size_t body = 0; body < std::size(models); ++body) {
    std::vector<Tet> tets = mesh.tets;
    for (Tet& tet : tets)
      for (int& i : tet) i += static_cast<int>(body * nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
      rest.push_back(mesh.nodes[i]);
      x.push_back(mesh.nodes[i] + displacement[i]);
    }
    together.add(tets, rest, {lame_parameters(1e5, 0.3, 0), models[body]});
  }
  together.finalize(std::vector<double>(rest.size(), 1), {}, {});
  std::vector<Vec3> force = zeros(rest.size());
  together.add_elastic_forces(x, force);
  double energy = 0;
  for (std::size_t body = 0; body < std::size(models); ++body) {
    FiniteElements alone;
    alone.add(mesh.tets, mesh.nodes, {lame_parameters(1e5, 0.3, 0), models[body]});
    alone.finalize(std::vector<double>(nodes, 1), {}, {});
    const std::vector<Vec3> here(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(nodes));
    std::vector<Vec3> expected = zeros(nodes);
    alone.add_elastic_forces(here, expected);
    energy += alone.energy(here);
    for (std::size_t i = 0; i < nodes; ++i)
      EXPECT_LT((force[body * nodes + i] - expected[i]).norm(), 1e-12 * expected[i].norm());
  }
  EXPECT_NEAR(together.energy(x), energy, 1e-13 * energy);
}

// Mass-proportional damping adds the force -c m v to each particle.
TEST(FiniteElements, MassDampingBrakesEveryParticleAlike) {
  Block block(2, MaterialModel::neo_hookean, 3.0), undamped(2);
  const std::vector<Vec3> v = block.random_field(9, 1);
  std::vector<Vec3> unused = zeros(v.size()), damped = zeros(v.size()), viscous = zeros(v.size());
  block.elements.add_elastic_forces(block.x, unused);
  undamped.elements.add_elastic_forces(block.x, unused);
  block.elements.add_damping_forces(v, damped);
  undamped.elements.add_damping_forces(v, viscous);
  for (std::size_t i = 0; i < v.size(); ++i)
    EXPECT_LT((damped[i] - viscous[i] + 3.0 * block.mass[i] * v[i]).norm(), 1e-12 * damped[i].norm());
}

// No mode of the assembled body is faster than the bound from which the time step is chosen (by the argument
// of Irons' theorem). The fastest mode is found by power iteration on M^-1 K. The lower limit of 0.3 bounds
// the time that is wasted: steps are at most 1 / sqrt(0.3) times shorter than necessary.
TEST(FiniteElements, FrequencyBoundHoldsAndIsNotWasteful) {
  Block block;
  std::vector<Vec3> v = block.random_field(5, 1);
  double omega_squared = 0;
  for (int i = 0; i < 300; ++i) {
    double norm = 0;
    for (const Vec3& a : v) norm += a.squaredNorm();
    norm = std::sqrt(norm);
    constexpr double h = 1e-6;
    std::vector<Vec3> step = v;
    for (Vec3& a : step) a *= h / norm;
    std::vector<Vec3> force = zeros(v.size());
    block.elements.add_elastic_forces(block.moved(step), force);
    double size = 0;
    for (std::size_t p = 0; p < v.size(); ++p) {
      v[p] = -force[p] / block.mass[p] / h;
      size += v[p].squaredNorm();
    }
    omega_squared = std::sqrt(size);
  }
  EXPECT_LT(omega_squared, block.elements.rest_omega_squared());
  EXPECT_GT(omega_squared, 0.3 * block.elements.rest_omega_squared());
}

// A step that evaluates damping at its fraction s solves V = v - s dt c' V, and takes v to v - dt c' V. That
// is exp(-c dt) v, for any damping rate, step and fraction.
TEST(FiniteElements, MassDampingOfAStepIsTheExponential) {
  for (const double rate : {1e-3, 2.0, 50.0}) {
    Block block(1, MaterialModel::neo_hookean, rate);
    for (const double dt : {1e-4, 0.02, 0.5}) {
      for (const double at : {0.5, 0.75, 1.0}) {
        block.elements.set_time_step(dt, at);
        for (std::size_t p = 0; p < block.x.size(); ++p) {
          const double fitted = block.elements.drag(p) / block.mass[p], V = 1 / (1 + at * dt * fitted);
          EXPECT_NEAR(1 - dt * fitted * V, std::exp(-rate * dt), 1e-15) << rate << " " << dt << " " << at;
        }
      }
      block.elements.set_time_step(dt);
      EXPECT_DOUBLE_EQ(block.elements.drag(0), rate * block.mass[0]);
    }
  }
}

// Compressed elements bound the step only up to twice the omega^2 bound at rest (the state that the step
// still follows), and are damped instead: without moment, symmetrically, and more strongly for longer steps.
// `follower` is a block whose steps follow the stiffness.
TEST(FiniteElements, CompressedElementsAreDampedAtTheSameStep) {
  Block block, follower;
  constexpr double cfl = 0.7;
  block.elements.rely_on_damping(cfl, 0);
  const std::vector<Vec3> v = block.random_field(6, 1);
  const auto dissipation = [&](Block& of, double squeeze, double dt) {
    std::vector<Vec3> x = of.x, force = zeros(v.size());
    for (Vec3& place : x) place.y() *= squeeze;
    of.elements.set_time_step(dt);
    of.elements.add_elastic_forces(x, force);
    force = zeros(v.size());
    of.elements.add_damping_forces(v, force);
    Vec3 torque = Vec3::Zero();
    double scale = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      torque += x[i].cross(force[i]);
      scale += force[i].norm();
    }
    EXPECT_LT(torque.norm(), 1e-12 * scale);
    return -dot(v, force);
  };
  const double at_rest = block.elements.rest_omega_squared(), dt = 2 * cfl / std::sqrt(at_rest);
  EXPECT_DOUBLE_EQ(dissipation(block, 0.9, dt), dissipation(follower, 0.9, dt));  // the step follows
  EXPECT_DOUBLE_EQ(block.elements.max_omega_squared(), follower.elements.max_omega_squared());
  const double plain = dissipation(follower, 0.4, dt);
  EXPECT_GT(follower.elements.max_omega_squared(), 4 * at_rest);
  const double half = dissipation(block, 0.4, dt / 2), whole = dissipation(block, 0.4, dt);
  EXPECT_LE(block.elements.max_omega_squared(), 2 * at_rest * (1 + 1e-12));
  EXPECT_GT(half, 1.05 * plain);
  EXPECT_GT(whole, half);
  // Steps that are short enough for the compressed elements need no additional damping.
  EXPECT_DOUBLE_EQ(dissipation(block, 0.4, 2 * cfl / std::sqrt(100 * at_rest)), plain);
}

// Damping of tau seconds relaxes the limit of the stiffness that it holds to `relaxation` times tau, and
// leaves the limit of shear that stress alone resists.
TEST(FiniteElements, StrongDampingRelaxesTheElasticBound) {
  Block block;
  constexpr double cfl = 0.7, tau = 0.01;
  const double elastic = block.elements.rest_omega_squared();
  const auto at_rest = [&](double step) {
    block.elements.rely_on_damping(cfl, step / (cfl * tau));
    return block.elements.rest_omega_squared();
  };
  const double own_step = 2 * cfl / std::sqrt(elastic);
  EXPECT_DOUBLE_EQ(at_rest(0), elastic);
  EXPECT_DOUBLE_EQ(at_rest(0.1 * own_step), elastic) << "not beyond what the elements allow by themselves";
  EXPECT_NEAR(at_rest(1.2 * own_step), elastic / 1.44, 1e-12 * elastic);
  // Damping holds all but about mu / (lambda + 2 mu) of the stiffness, an eleventh for a Poisson's ratio of
  // 0.45.
  const double soft = at_rest(1e6 * own_step);
  EXPECT_GT(soft, elastic / 25);
  EXPECT_LT(soft, elastic / 10);
  EXPECT_DOUBLE_EQ(block.elements.elastic_omega_squared(), elastic);

  std::vector<Vec3> x = block.x, unused = zeros(x.size());
  at_rest(1.2 * own_step);
  block.elements.set_time_step(1.2 * own_step);
  block.elements.add_elastic_forces(x, unused);
  EXPECT_NEAR(block.elements.max_omega_squared(), elastic / 1.44, 1e-12 * elastic);
  for (Vec3& place : x) place.y() *= 8;  // stretched in a way that damping does not resist
  block.elements.add_elastic_forces(x, unused);
  EXPECT_GT(block.elements.max_omega_squared(), 1.5 * elastic / 1.44);
  for (Vec3& place : x) place.y() *= 0.02;  // compressed beyond the start of the extrapolated law
  block.elements.add_elastic_forces(x, unused);
  EXPECT_GT(block.elements.max_omega_squared(), 1.9 * elastic);
  block.elements.set_time_step(tau / 2);
  at_rest(1e6 * own_step);  // damping of tau does not hold steps longer than tau
  block.elements.add_elastic_forces(block.x, unused);
  EXPECT_DOUBLE_EQ(block.elements.max_omega_squared(), elastic);
}

// The diagonal block of each particle is what the damping operator does to the velocity of that particle
// alone, compressed elements included. Wrong blocks would make the block-Jacobi preconditioner useless
// without any other sign.
TEST(FiniteElements, DampingBlocksAreThoseOfTheOperator) {
  Block block(3, MaterialModel::neo_hookean, 3.0), follower(3, MaterialModel::neo_hookean, 3.0);
  block.elements.rely_on_damping(0.7, 0);
  block.elements.set_time_step(2 * 0.7 / std::sqrt(block.elements.rest_omega_squared()));
  std::vector<Vec3> x = block.moved(block.random_field(7, 0.05)), unused = zeros(x.size());
  for (Vec3& place : x) place.y() *= 0.4;
  block.elements.add_elastic_forces(x, unused);
  follower.elements.add_elastic_forces(x, unused);
  std::vector<SymmetricBlock> blocks(x.size()), plain(x.size());
  block.elements.add_damping_blocks(blocks);
  follower.elements.add_damping_blocks(plain);
  int damped_more = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    damped_more += blocks[p].diagonal.sum() > 1.01 * plain[p].diagonal.sum() ? 1 : 0;
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> v = zeros(x.size()), force = zeros(x.size());
      v[p][k] = 1;
      block.elements.add_damping_forces(v, force);
      EXPECT_LT((blocks[p] * v[p] + force[p]).norm(), 1e-12 * force[p].norm());
      EXPECT_LT((blocks[p].inverse() * (blocks[p] * v[p]) - v[p]).norm(), 1e-9);
    }
  }
  EXPECT_GT(damped_more, static_cast<int>(x.size()) / 2);
}

// Damping forces in single precision differ from those in double precision by the rounding of floats (3e-7, a
// few units of 6e-8), with compressed elements and mass-proportional damping included. Their sum vanishes as
// exactly as in double precision, so that no momentum is lost.
TEST(FiniteElements, DampingInSinglePrecisionIsOffByItsRounding) {
  for (const double squeeze : {1.0, 0.4}) {
    Block block(3, MaterialModel::neo_hookean, 3.0);
    block.elements.rely_on_damping(0.7, 0);
    block.elements.set_time_step(2 * 0.7 / std::sqrt(block.elements.rest_omega_squared()));
    std::vector<Vec3> x = block.moved(block.random_field(7, 0.05)), exact = zeros(x.size()), single = exact;
    for (Vec3& place : x) place.y() *= squeeze;
    block.elements.add_elastic_forces(x, exact);
    exact = zeros(x.size());
    const std::vector<Vec3> v = block.random_field(8, 1);
    block.elements.add_damping_forces(v, exact);
    block.elements.add_damping_forces_single(v, single);
    double largest = 0, difference = 0;
    Vec3 sum = Vec3::Zero();
    for (std::size_t p = 0; p < x.size(); ++p) {
      largest = std::max(largest, exact[p].norm());
      difference = std::max(difference, (single[p] - exact[p]).norm());
      sum += single[p] - exact[p];
    }
    EXPECT_GT(difference, 0);
    EXPECT_LT(difference, 3e-7 * largest);
    EXPECT_LT(sum.norm(), 1e-13 * largest);
  }
}

// Under compression the bound holds as well: power iteration uses the differences of the forces about the
// compressed state.
TEST(FiniteElements, FrequencyBoundHoldsUnderCompression) {
  Block block;
  for (Vec3& place : block.x) place.y() *= 0.5;
  std::vector<Vec3> v = block.random_field(5, 1), base = zeros(v.size());
  block.elements.add_elastic_forces(block.x, base);
  const double bound = block.elements.max_omega_squared();
  EXPECT_GT(bound, 2 * block.elements.rest_omega_squared());
  double highest = 0;
  for (int i = 0; i < 300; ++i) {
    double norm = 0;
    for (const Vec3& a : v) norm += a.squaredNorm();
    constexpr double h = 1e-6;
    for (Vec3& a : v) a *= h / std::sqrt(norm);
    std::vector<Vec3> force = zeros(v.size());
    block.elements.add_elastic_forces(block.moved(v), force);
    double size = 0;
    for (std::size_t p = 0; p < v.size(); ++p) {
      v[p] = (base[p] - force[p]) / block.mass[p] / h;
      size += v[p].squaredNorm();
    }
    highest = std::sqrt(size);
  }
  EXPECT_LT(highest, bound);
  EXPECT_GT(highest, 0.3 * bound);
}

}  // namespace
}  // namespace duet::finite_elements_test
