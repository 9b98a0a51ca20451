// Laws that every internal force keeps: springs, altitude springs, membranes, bending elements.
#include "sim/deformable/forces/internal_forces.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/deformable/forces/shell_bending.h"
#include "sim/deformable/self_contact/thin_bodies.h"

namespace duet::internal_forces_test {
namespace {

std::vector<Vec3> zeros(std::size_t n) { return std::vector<Vec3>(n, Vec3::Zero()); }

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

// A body with one kind of force, whose particles have between 0.5 and 1.5 kg.
struct Specimen {
  std::string name;
  InternalForces forces;
  std::vector<Vec3> rest;
  std::vector<double> mass, inverse_mass;

  Specimen(std::string title, std::vector<Vec3> x, const std::function<void(Specimen&)>& fill)
      : name(std::move(title)), rest(std::move(x)) {
    std::mt19937 random(7);
    for (std::size_t i = 0; i < rest.size(); ++i) {
      mass.push_back(1 + 0.5 * test::random_vector(random).x());
      inverse_mass.push_back(1 / mass.back());
    }
    fill(*this);
    forces.finalize(mass, inverse_mass, mass);
    forces.choose_altitudes(rest);
  }
  // Returns a random vector for each particle with components of up to `size`.
  std::vector<Vec3> field(unsigned seed, double size) const {
    std::mt19937 random(seed);
    std::vector<Vec3> result;
    for (std::size_t i = 0; i < rest.size(); ++i) result.push_back(size * test::random_vector(random));
    return result;
  }
  // Returns the positions at rest with random displacements of up to `size` (m).
  std::vector<Vec3> moved(unsigned seed, double size) const {
    std::vector<Vec3> x = field(seed, size);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += rest[i];
    return x;
  }
  std::vector<Vec3> elastic(const std::vector<Vec3>& x) {
    std::vector<Vec3> force = zeros(x.size());
    forces.add_elastic_forces(x, force);
    return force;
  }
  std::vector<Vec3> damping(const std::vector<Vec3>& v) {
    std::vector<Vec3> force = zeros(v.size());
    forces.add_damping_forces(v, force);
    return force;
  }
  std::vector<Vec3> differential(const std::vector<Vec3>& dx) {
    std::vector<Vec3> force = zeros(dx.size());
    forces.add_force_differentials(dx, force);
    return force;
  }
};

// Returns one specimen for each kind of force.
std::vector<Specimen> specimens() {
  const Sheet sheet = panel(Vec2(1, 1.4), 3, 4);
  // The shell and the rod are curved at rest.
  std::vector<Vec3> arched = sheet.nodes;
  for (Vec3& x : arched) x.y() = 0.4 * x.x() * x.x() - 0.2 * x.z() * x.z();
  const Curve spiral = helix(0.5, 0.3, 1.5, 14);
  const TetMesh block = box_lattice(Vec3(1, 1.2, 0.9), Vec3i(2, 2, 2));
  std::vector<Specimen> all;
  all.emplace_back("edge springs", sheet.nodes, [&](Specimen& s) {
    for (const SheetEdge& e : edges(sheet))
      s.forces.edge_springs.add(edge_spring(e.a, e.b, s.rest, 300, 0.5, s.inverse_mass));
  });
  all.emplace_back("bending springs", sheet.nodes, [&](Specimen& s) {
    for (const SheetEdge& e : edges(sheet))
      if (e.other_opposite >= 0)
        s.forces.bending_springs.add(
            edge_spring(e.opposite, e.other_opposite, s.rest, 20, 0.5, s.inverse_mass));
  });
  all.emplace_back("altitude springs", block.nodes,
                   [&](Specimen& s) { s.forces.altitude_springs.add(block.tets, s.rest, 400, 0.5); });
  all.emplace_back("membranes", arched, [&](Specimen& s) {
    s.forces.membranes.add(sheet.triangles, s.rest, membrane_moduli(2e4, 0.3, 0.01, 0.02));
  });
  for (const auto& x : {sheet.nodes, arched})
    all.emplace_back(x == arched ? "bending of a curved shell" : "bending of a flat shell", x,
                     [&](Specimen& s) {
                       for (const ShellBending& element :
                            shell_bending(sheet.triangles, edges(sheet), s.rest, 2, 0.3, 0.02))
                         s.forces.shell_bending.add(element);
                     });
  all.emplace_back("rod", spiral.nodes, [&](Specimen& s) {
    for (int i = 0; i + 1 < static_cast<int>(s.rest.size()); ++i) {
      s.forces.edge_springs.add(rod_element(i, i + 1, s.rest, 500, 0.02));
      if (i > 0) s.forces.rod_bending.add(rod_bending(i - 1, i, i + 1, s.rest, 1, 0.02));
    }
  });
  return all;
}

// Returns the largest component of a whole field. Bounds are relative to it, because single components can be
// small and then have fewer correct digits.
double largest(const std::vector<Vec3>& field) {
  double most = 0;
  for (const Vec3& v : field) most = std::max(most, v.cwiseAbs().maxCoeff());
  return most;
}

// Returns the product of a matrix over particles with `v`.
std::vector<Vec3> product(const std::vector<ParticleBlock>& blocks, const std::vector<Vec3>& v) {
  std::vector<Vec3> sum = zeros(v.size());
  for (const ParticleBlock& block : blocks) {
    const auto row = static_cast<std::size_t>(block.row), column = static_cast<std::size_t>(block.column);
    sum[row] += block.block * v[column];
    if (row != column) sum[column] += block.block.transpose() * v[row];
  }
  return sum;
}

// The force is -dE/dx by central differences, to 1e-6 of the largest force.
TEST(InternalForces, AreTheGradientOfTheEnergy) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(1, 0.05);
    s.forces.choose_altitudes(x);
    const std::vector<Vec3> force = s.elastic(x);
    const double h = 1e-5, scale = largest(force);
    ASSERT_GT(scale, 0);
    for (std::size_t i = 0; i < x.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        std::vector<Vec3> up = x, down = x;
        up[i][k] += h;
        down[i][k] -= h;
        const double slope = (s.forces.energy(up) - s.forces.energy(down)) / (2 * h);
        EXPECT_NEAR(force[i][k], -slope, 1e-6 * scale) << i << ' ' << k;
      }
  }
}

// Damping forces in single precision differ by the rounding of floats, and their sum vanishes as exactly as
// in double precision. Those of membranes are computed in double precision always.
TEST(InternalForces, DampingInSinglePrecisionIsOffByItsRounding) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    s.forces.choose_altitudes(s.rest);
    s.elastic(s.moved(1, 0.05));
    const std::vector<Vec3> v = s.field(2, 1), exact = s.damping(v);
    std::vector<Vec3> difference = zeros(v.size());
    s.forces.add_damping_forces_single(v, difference);
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < v.size(); ++i) sum += difference[i], difference[i] -= exact[i];
    const double scale = largest(exact);
    EXPECT_EQ(largest(difference) > 0, s.name != "membranes");
    EXPECT_LT(largest(difference), 1e-6 * scale);
    EXPECT_LT(sum.norm(), 1e-13 * scale);
  }
}

// At rest there are neither forces nor energy, to rounding.
TEST(InternalForces, VanishAtRest) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    const double scale = largest(s.elastic(s.moved(1, 0.05)));
    EXPECT_LT(largest(s.elastic(s.rest)), 1e-12 * scale);
    EXPECT_LT(s.forces.energy(s.rest), 1e-12 * s.forces.energy(s.moved(1, 0.05)));
  }
}

// Elastic and damping forces have neither sum nor moment, to rounding.
TEST(InternalForces, HaveNoResultantAndNoMoment) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(2, 0.2);
    s.forces.choose_altitudes(x);
    std::vector<Vec3> force = s.elastic(x);
    const std::vector<Vec3> damping = s.damping(s.field(3, 1));
    for (std::size_t i = 0; i < x.size(); ++i) force[i] += damping[i];
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
}

// If the body and its velocities turn, forces and differentials turn with them, to rounding.
TEST(InternalForces, TurnWithTheBody) {
  std::mt19937 random(5);
  const Mat3 turn = test::random_rotation(random).toRotationMatrix();
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(2, 0.2), v = s.field(3, 1);
    std::vector<Vec3> turned, v_turned;
    for (std::size_t i = 0; i < x.size(); ++i) {
      turned.push_back(turn * x[i] + Vec3(3, -2, 1));
      v_turned.push_back(turn * v[i]);
    }
    s.forces.choose_altitudes(x);
    const std::vector<Vec3> elastic = s.elastic(x), damping = s.damping(v), differential = s.differential(v);
    s.forces.choose_altitudes(turned);
    const std::vector<Vec3> elastic_turned = s.elastic(turned), damping_turned = s.damping(v_turned),
                            differential_turned = s.differential(v_turned);
    const auto expect_turned = [&](const std::vector<Vec3>& now, const std::vector<Vec3>& before) {
      for (std::size_t i = 0; i < now.size(); ++i)
        EXPECT_LT((now[i] - turn * before[i]).norm(), 1e-12 * largest(before));
    };
    expect_turned(elastic_turned, elastic);
    expect_turned(damping_turned, damping);
    expect_turned(differential_turned, differential);
  }
}

// Differentials and damping are symmetric and never add energy, also in strongly deformed states where
// springs are compressed.
TEST(InternalForces, DifferentialsAndDampingAreSemidefinite) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    for (const double size : {0.05, 0.6}) {
      const std::vector<Vec3> x = s.moved(4, size);
      s.forces.choose_altitudes(x);
      s.elastic(x);
      for (unsigned seed = 10; seed < 20; ++seed) {
        const std::vector<Vec3> u = s.field(seed, 1), v = s.field(seed + 100, 1);
        for (const auto& apply : {&Specimen::differential, &Specimen::damping}) {
          const std::vector<Vec3> Au = (s.*apply)(u), Av = (s.*apply)(v);
          const double scale = std::sqrt(dot(Au, Au) * dot(v, v));
          EXPECT_NEAR(dot(Au, v), dot(u, Av), 1e-12 * scale);
          EXPECT_LE(dot(Au, u), 0);
        }
      }
    }
  }
}

// Particles that turn with the angular velocity w about an axis have the velocities v = w x r, and
// v + t w x (w x r) a time t later. The viscous forces that these have in the state of before are those of
// Green's strain rate t F'^T F', which the turn forces take away. Rates of lengths are off by their third
// power of w t. Springs on curvatures have none.
TEST(InternalForces, TurnForcesLeaveNoDampingOfATurn) {
  std::vector<Specimen> all = specimens();
  const TetMesh block = box_lattice(Vec3(1, 1.2, 0.9), Vec3i(2, 2, 2));
  all.emplace_back("elements", block.nodes, [&](Specimen& s) {
    s.forces.elements.add(block.tets, s.rest, {lame_parameters(1e4, 0.3, 0.1), {}, 0});
  });
  const Vec3 spin(3, -5, 4);
  const double t = 0.01;
  for (Specimen& s : all) {
    if (s.forces.rod_bending.size() > 0 || s.forces.shell_bending.size() > 0) continue;
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(6, 0.05);
    s.forces.choose_altitudes(x);
    s.elastic(x);
    std::vector<Vec3> v, later;
    for (const Vec3& r : x) {
      v.push_back(spin.cross(r));
      later.push_back(v.back() + t * spin.cross(v.back()));
    }
    std::vector<Vec3> force = s.damping(later);
    const double alone = largest(force);
    ASSERT_GT(alone, 0);
    s.forces.add_turn_forces(v, t, force);
    EXPECT_LT(largest(force), 0.5 * spin.squaredNorm() * t * t * alone);
  }
}

// Turn forces that are computed with the elastic forces are, bit for bit, those of a pass of their own.
TEST(InternalForces, KeptTurnForcesAreThoseOfAPassOfTheirOwn) {
  std::vector<Specimen> all = specimens();
  const TetMesh block = box_lattice(Vec3(1, 1.2, 0.9), Vec3i(3, 3, 3));
  all.emplace_back("elements", block.nodes, [&](Specimen& s) {
    s.forces.elements.add(block.tets, s.rest, {lame_parameters(1e4, 0.3, 0.1), {}, 0});
  });
  for (Specimen& s : all) {
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(6, 0.05), v = s.field(7, 3);
    s.forces.choose_altitudes(x);
    for (const double seconds : {0.0, 0.01}) {
      std::vector<Vec3> one_by_one = s.elastic(x), together = zeros(x.size());
      s.forces.add_turn_forces(v, seconds, one_by_one);
      const Turn turn{v, seconds};
      s.forces.add_elastic_forces(x, together, &turn);
      s.forces.add_kept_turn_forces(turn, together);
      EXPECT_EQ(together, one_by_one) << seconds << " s";
    }
  }
}

// The diagonal block of each particle is what damping does to the velocity of that particle alone. Membranes
// give no blocks.
TEST(InternalForces, DampingBlocksAreThoseOfTheOperator) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    s.elastic(s.moved(1, 0.05));
    std::vector<SymmetricBlock> blocks(s.rest.size());
    s.forces.add_damping_blocks(blocks);
    double scale = 0;
    for (std::size_t p = 0; p < s.rest.size(); ++p)
      for (int k = 0; k < 3; ++k) {
        std::vector<Vec3> v = zeros(s.rest.size());
        v[p][k] = 1;
        const Vec3 expected = s.name == "membranes" ? Vec3(Vec3::Zero()) : Vec3(-s.damping(v)[p]);
        scale = std::max(scale, expected.norm());
        EXPECT_LT((blocks[p] * v[p] - expected).norm(), 1e-12 * (scale + 1)) << p << ' ' << k;
      }
    EXPECT_EQ(scale == 0, s.name == "membranes");
  }
}

// Under tension nothing has to be projected, and the differentials are the derivative of the forces. The
// random displacements are small against the bends of the curved shell, so that none of its springs is
// compressed.
TEST(InternalForces, DifferentialsAreTheDerivativeUnderTension) {
  for (Specimen& s : specimens()) {
    // Differentials of altitude springs leave out the rotation of the altitude.
    if (s.forces.altitude_springs.size() > 0) continue;
    SCOPED_TRACE(s.name);
    std::vector<Vec3> x = s.moved(4, 0.002);
    for (Vec3& place : x) place *= 1.5;
    const std::vector<Vec3> dx = s.field(6, 1);
    const double h = 1e-6;
    std::vector<Vec3> up = x, down = x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      up[i] += h * dx[i];
      down[i] -= h * dx[i];
    }
    const std::vector<Vec3> above = s.elastic(up), below = s.elastic(down);
    s.elastic(x);
    const std::vector<Vec3> change = s.differential(dx);
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LT((change[i] - (above[i] - below[i]) / (2 * h)).norm(), 1e-6 * largest(change));
  }
}

// Returns the highest omega^2 of the forces at the last elastic evaluation, by power iteration, rad^2/s^2.
double highest_omega_squared(Specimen& s) {
  double highest = 0;
  std::vector<Vec3> mode = s.field(9, 1);
  for (int i = 0; i < 400; ++i) {
    const double norm = std::sqrt(dot(mode, mode));
    for (Vec3& u : mode) u /= norm;
    std::vector<Vec3> next = s.differential(mode);
    for (std::size_t p = 0; p < next.size(); ++p) next[p] *= -s.inverse_mass[p];
    highest = std::sqrt(dot(next, next));
    mode = std::move(next);
  }
  return highest;
}

// The highest frequency of the assembly, by power iteration, is below the bound, at rest and stretched. The
// ratio of the bound to it is at most 3.5 (6.5 for altitude springs, 1.5 for rods): at a ratio of 4 half of
// the allowed time step is wasted.
TEST(InternalForces, FrequencyBoundHoldsAtRestAndStretched) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    for (const double stretch : {1.0, 1.3}) {
      std::vector<Vec3> x = s.rest;
      for (Vec3& place : x) place *= stretch;
      s.forces.choose_altitudes(x);
      s.elastic(x);
      const double highest = highest_omega_squared(s);
      const double bound = s.forces.max_omega_squared();
      EXPECT_LE(highest, bound * (1 + 1e-12)) << stretch;
      EXPECT_GE(highest, bound / (s.name == "altitude springs" ? 6.5
                                  : s.name == "rod"            ? 1.5
                                                               : 3.5))
          << stretch;
    }
  }
}

// Zero-length springs hold the particles of elements to anchors that never move, or to other particles. The
// stiffnesses of both add up: with springs of the elements' own frequency the larger of the two bounds is too
// small.
TEST(InternalForces, BoundOfElementsWithSpringsIsASum) {
  const TetMesh block = box_lattice(Vec3(1, 1.2, 0.9), Vec3i(2, 2, 2));
  for (const bool to_particles : {false, true}) {
    double alone = 0;  // rad^2/s^2, the bound of the elements
    for (const double gain : {0.0, 0.5, 1.0, 2.0}) {
      SCOPED_TRACE(testing::Message() << gain << " to particles " << to_particles);
      std::vector<Vec3> x = block.nodes;
      x.insert(x.end(), block.nodes.begin(), block.nodes.end());
      const int count = static_cast<int>(block.nodes.size());
      Specimen s("elements and springs", x, [&](Specimen& of) {
        of.forces.elements.add(block.tets, of.rest, {lame_parameters(1e4, 0.3, 0), {}, 0});
        for (int p = 0; p < count; ++p) {
          if (!to_particles) of.inverse_mass[as_index(count + p)] = 0;
          if (gain > 0)
            of.forces.zero_length_springs.add({p, count + p, gain * alone * of.mass[as_index(p)], 0});
        }
      });
      s.elastic(s.rest);
      s.forces.linearize();
      if (gain == 0) alone = s.forces.max_omega_squared();
      const double highest = highest_omega_squared(s), bound = s.forces.max_omega_squared();
      EXPECT_LE(highest, bound * (1 + 1e-12));
      EXPECT_GE(highest, bound / 4);
      EXPECT_DOUBLE_EQ(s.forces.elastic_omega_squared(), bound);
      EXPECT_DOUBLE_EQ(s.forces.rest_omega_squared(), bound);
      if (gain == 1) {
        EXPECT_GT(highest, 1.3 * alone) << "the larger bound would not hold";
      }
    }
  }
}

// Returns the bound of a stretched spring, strongly damped, beside a triangle that is stretched by `stretch`.
double bound_beside_membrane(double stretch) {
  const std::vector<Vec3> triangle{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1)};
  std::vector<Vec3> x = triangle;
  x.emplace_back(5, 0, 0);
  x.emplace_back(6, 0, 0);
  InternalForces forces;
  forces.membranes.add({{0, 1, 2}}, x, membrane_moduli(1e3, 0.3, 0.01, 0));
  const double k = 1e4;
  forces.edge_springs.add({{3, 4}, {1, -1}, 1, k, critical_viscosity<2>(100, k, {1, -1}, {1, 1})});
  const std::vector<double> ones(x.size(), 1);
  forces.finalize(ones, ones, ones);
  forces.rely_on_damping(0.7, 0.25);
  for (std::size_t i = 0; i < 3; ++i) x[i] *= stretch;
  x[4].x() = 6.5;
  std::vector<Vec3> force = zeros(x.size());
  forces.add_elastic_forces(x, force);
  return forces.max_omega_squared();
}

// A triangle that is compressed does not lower the bound of other forces. The stretched spring has the
// geometric stiffness k (1 - 1/1.5) between two masses of 1 kg.
TEST(InternalForces, CompressedMembranesDoNotLowerOtherBounds) {
  for (const double stretch : {0.2, 0.7, 1.0}) {
    const double spring = 2e4 / 3, bound = bound_beside_membrane(stretch);
    EXPECT_GE(bound, spring * (1 - 1e-12)) << stretch;
    EXPECT_LE(bound, 1.2 * spring) << stretch;
  }
}

// Altitude springs turn a tetrahedron right side out: at every stage of its collapse the force on the apex
// points outward.
TEST(AltitudeSprings, PushAnInvertedTetBack) {
  std::vector<Vec3> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.3, -0.8, 0.3)};
  ASSERT_GT(tet_volume(x[0], x[1], x[2], x[3]), 0);
  AltitudeSprings springs;
  springs.add({{0, 1, 2, 3}}, x, 100, 1);
  springs.finalize({1, 1, 1, 1});
  for (const double height : {-0.7, -0.3, -1e-3, 0.0, 1e-3, 0.3, 2.0}) {
    x[3].y() = height;
    std::vector<double> none;
    springs.choose(x);
    std::vector<Vec3> force = zeros(4);
    springs.add_elastic_forces(x, force, none);
    EXPECT_LT(force[3].y() + (force[3].y() == 0 ? force[0].y() : 0), 0) << height;
  }
}

// The blocks add up to the matrix of damping forces and force differentials, to rounding.
TEST(InternalForces, BlocksAddUpToTheMatrixOfTheirForces) {
  for (Specimen& s : specimens()) {
    SCOPED_TRACE(s.name);
    const std::vector<Vec3> x = s.moved(1, 0.1), v = s.field(2, 1);
    s.forces.choose_altitudes(x);
    s.elastic(x);
    const std::vector<Vec3> damping = s.damping(v), differential = s.differential(v);
    for (const BlockFactors factors : {BlockFactors{0.7, 0}, {0, 0.3}, {0.7, 0.3}}) {
      std::vector<ParticleBlock> blocks;
      s.forces.append_blocks(factors, blocks);
      std::vector<Vec3> sum = product(blocks, v);
      const double scale = largest(sum);
      ASSERT_GT(scale, 0);
      for (std::size_t i = 0; i < v.size(); ++i)
        sum[i] += factors.damping * damping[i] + factors.elasticity * differential[i];
      EXPECT_LT(largest(sum), 1e-12 * scale) << factors.damping << ' ' << factors.elasticity;
    }
  }
}

}  // namespace
}  // namespace duet::internal_forces_test
