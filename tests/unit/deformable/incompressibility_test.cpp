#include "sim/deformable/incompressibility.h"

#include <cmath>
#include <numeric>

#include "tests/support/tet_meshes.h"
#include <gtest/gtest.h>

namespace duet::incompressibility_test {
namespace {

using test::corner_masses;
using test::random_vectors;
using test::shaken_lattice;

// A lattice with jittered nodes, with particles of 800 kg/m^3 and its nodal volumes.
struct Body {
  TetMesh mesh = shaken_lattice(Vec3i(3, 4, 2), 0.1, 1);
  std::vector<double> mass = corner_masses(mesh, 800), inverse_mass;
  NodalVolumes rings;
  Body() {
    for (double m : mass) inverse_mass.push_back(1 / m);
    rings.add(mesh.tets, mesh.nodes);
    rings.finalize(inverse_mass, mesh.nodes);
  }
  // Returns the nodal volumes at the positions `x`, m^3.
  std::vector<double> volumes(const std::vector<Vec3>& x) {
    rings.linearize(x);
    std::vector<double> result;
    for (std::size_t i = 0; i < rings.size(); ++i) result.push_back(rings.volume(i));
    return result;
  }
};

std::vector<double> random_pressures(std::size_t count) {
  std::vector<double> q;
  for (const Vec3& v : random_vectors(count, 5)) q.push_back(1000 * v.x());
  return q;
}

// Returns x + amount v.
std::vector<Vec3> moved(const std::vector<Vec3>& x, double amount, const std::vector<Vec3>& v) {
  std::vector<Vec3> result = x;
  for (std::size_t i = 0; i < x.size(); ++i) result[i] += amount * v[i];
  return result;
}

// Nodal volumes add up to the volume of the body, and at rest to its mass over its density.
TEST(NodalVolumes, AddUpToTheBody) {
  Body body;
  double volume = 0, rest = 0;
  const auto x = moved(body.mesh.nodes, 0.3, random_vectors(body.mesh.nodes.size(), 2));
  for (double v : body.volumes(x)) volume += v;
  for (std::size_t i = 0; i < body.rings.size(); ++i) {
    rest += body.rings.rest_volume(i);
    EXPECT_NEAR(800 * body.rings.rest_volume(i), body.mass[i], 1e-12 * body.mass[i]);
  }
  EXPECT_NEAR(body.rings.volume_error(body.mesh.nodes), 0, 1e-14);
  EXPECT_NEAR(body.rings.volume_error(x), std::abs(volume / rest - 1), 1e-13);
  auto twice = body.mesh.nodes;
  for (Vec3& p : twice) p *= 2;
  EXPECT_NEAR(body.rings.volume_error(twice), 7, 1e-12);
}

// Volumes are cubic in the positions, and the difference formula with five points is exact for cubics. So the
// bound is the rounding of sums over some 24 tetrahedra. divergence_at() gives the same without linearize().
TEST(NodalVolumes, DivergenceIsTheDerivativeOfTheVolumes) {
  Body body;
  const auto x = moved(body.mesh.nodes, 0.2, random_vectors(body.mesh.nodes.size(), 3));
  const auto v = random_vectors(x.size(), 4);
  const auto p2 = body.volumes(moved(x, 2, v)), p1 = body.volumes(moved(x, 1, v)),
             m1 = body.volumes(moved(x, -1, v)), m2 = body.volumes(moved(x, -2, v));
  body.rings.linearize(x);
  std::vector<double> rate;
  body.rings.divergence(v, rate);
  ASSERT_EQ(rate.size(), x.size());
  for (std::size_t i = 0; i < rate.size(); ++i)
    EXPECT_NEAR(rate[i], (8 * (p1[i] - m1[i]) - (p2[i] - m2[i])) / 12, 1e-12) << i;

  std::vector<double> at_once;
  body.rings.linearize(body.mesh.nodes);
  body.rings.divergence_at(x, v, at_once);
  ASSERT_EQ(at_once.size(), rate.size());
  for (std::size_t i = 0; i < rate.size(); ++i) EXPECT_NEAR(at_once[i], rate[i], 1e-14) << i;
}

// The pressure gradient is the adjoint of the divergence in the mass inner product, q . D v = <M^-1 D^T q,
// v>, to rounding. Otherwise the pressure system would not be symmetric, and pressures would change momentum.
TEST(NodalVolumes, GradientIsTheAdjointOfTheDivergence) {
  Body body;
  const auto x = moved(body.mesh.nodes, 0.3, random_vectors(body.mesh.nodes.size(), 3));
  const auto v = random_vectors(x.size(), 4);
  body.rings.linearize(x);
  const std::vector<double> q = random_pressures(body.rings.size());
  std::vector<Vec3> w(x.size());
  body.rings.pressure_velocity(q, w);
  std::vector<double> rate;
  body.rings.divergence(v, rate);
  const double power = std::inner_product(q.begin(), q.end(), rate.begin(), 0.0);
  double work = 0, size = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    work += body.mass[i] * w[i].dot(v[i]);
    size += std::abs(body.mass[i] * w[i].dot(v[i]));
  }
  EXPECT_NEAR(work, power, 1e-14 * size);

  // The diagonal is that of the product D M^-1 D^T.
  for (const std::size_t i : {0UL, 17UL, 30UL}) {
    std::vector<double> unit(body.rings.size(), 0);
    unit[i] = 1;
    body.rings.pressure_velocity(unit, w);
    body.rings.divergence(w, rate);
    EXPECT_NEAR(body.rings.diagonal(i), rate[i], 1e-14 * rate[i]);
  }
}

// Rigid motions change no volume, and pressures no momentum and no angular momentum.
TEST(NodalVolumes, RigidMotionsKeepThemAndPressuresMomentum) {
  Body body;
  const auto x = moved(body.mesh.nodes, 0.3, random_vectors(body.mesh.nodes.size(), 3));
  body.rings.linearize(x);
  std::vector<Vec3> rigid;
  for (const Vec3& p : x) rigid.push_back(Vec3(1, -2, 3) + Vec3(2, 1, -1).cross(p));
  std::vector<double> rate;
  body.rings.divergence(rigid, rate);
  for (double r : rate) EXPECT_NEAR(r, 0, 1e-13);

  std::vector<Vec3> w(x.size());
  body.rings.pressure_velocity(random_pressures(body.rings.size()), w);
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  double size = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    linear += body.mass[i] * w[i];
    angular += x[i].cross(body.mass[i] * w[i]);
    size += body.mass[i] * w[i].norm();
  }
  EXPECT_LT(linear.norm(), 1e-15 * size);
  EXPECT_LT(angular.norm(), 1e-15 * size);
}

}  // namespace
}  // namespace duet::incompressibility_test
