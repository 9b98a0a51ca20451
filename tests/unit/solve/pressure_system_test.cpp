#include "sim/solve/pressure_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/margin.h"
#include "tests/support/tet_meshes.h"
#include <gtest/gtest.h>

#include "sim/solve/conjugate_residual.h"

namespace duet::pressure_system_test {
namespace {

using test::expect_below;

constexpr double dt = 0.01;  // s
// Far below what rounding leaves, so that solves end at the rounding.
constexpr PressureSettings exact{1e-14, 400};

// Returns bodies with the particles and nodal volumes of a mesh of the given density (kg/m^3).
Bodies bodies_of(const TetMesh& mesh, double density) {
  Bodies bodies;
  Particles& particles = bodies.particles;
  particles.x = mesh.nodes;
  particles.v.resize(mesh.nodes.size(), Vec3::Zero());
  particles.mass = test::corner_masses(mesh, density);
  for (double m : particles.mass) particles.inverse_mass.push_back(1 / m);
  bodies.nodal_volumes.add(mesh.tets, mesh.nodes);
  bodies.nodal_volumes.finalize(particles.inverse_mass, mesh.nodes);
  return bodies;
}

// Sets the wanted rates of the nodal volumes to those that stop the changes by `v`.
void stop_rates(const Bodies& bodies, PressureScratch& scratch, const std::vector<Vec3>& v) {
  bodies.nodal_volumes.divergence(v, scratch.rate);
  for (double& rate : scratch.rate) rate *= -1;
}

// Returns the velocities nearest to `v` (in kinetic energy) that change no nodal volume.
std::vector<Vec3> projected(const Bodies& bodies, const std::vector<Vec3>& v,
                            PressureSettings settings = exact) {
  PressureScratch scratch;
  stop_rates(bodies, scratch, v);
  find_pressures(bodies, nullptr, dt, settings, scratch);
  std::vector<Vec3> result = v;
  for (std::size_t i = 0; i < v.size(); ++i) result[i] += scratch.change.particle[i];
  return result;
}

// Returns the inner product with the masses.
double product(const Bodies& bodies, const std::vector<Vec3>& u, const std::vector<Vec3>& v) {
  double sum = 0;
  for (std::size_t i = 0; i < u.size(); ++i) sum += bodies.particles.mass[i] * u[i].dot(v[i]);
  return sum;
}

std::vector<Vec3> difference(std::vector<Vec3> a, const std::vector<Vec3>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

double size(const Bodies& bodies, const std::vector<Vec3>& v) { return std::sqrt(product(bodies, v, v)); }

// The projection to velocities without divergence is idempotent and self-adjoint in the mass inner product.
TEST(PressureSystem, ProjectionIsIdempotentAndSelfAdjoint) {
  const Bodies bodies = bodies_of(test::shaken_lattice(Vec3i(3, 4, 3), 0.1, 1), 800);
  const std::size_t n = bodies.particles.size();
  const auto u = test::random_vectors(n, 2), v = test::random_vectors(n, 3);
  const auto Pu = projected(bodies, u), Pv = projected(bodies, v);
  std::vector<double> rate;
  bodies.nodal_volumes.divergence(Pv, rate);
  double largest = 0;
  for (std::size_t i = 0; i < rate.size(); ++i)
    largest = std::max(largest, std::abs(rate[i]) / bodies.nodal_volumes.rest_volume(i));
  expect_below(largest, 1e-12, "divergence left, 1/s");  // velocities are 1 m/s over 1 m
  // The residual that rounding leaves is amplified by the condition number of the system, some 1e3.
  expect_below(size(bodies, difference(projected(bodies, Pv), Pv)) / size(bodies, v), 1e-12, "P P v - P v");
  const double scale = size(bodies, u) * size(bodies, v);
  expect_below(std::abs(product(bodies, Pu, v) - product(bodies, u, Pv)) / scale, 1e-12, "<Pu, v> - <u, Pv>");
  EXPECT_LT(size(bodies, Pv), 0.95 * size(bodies, v)) << "a third of the freedoms is constrained";
  EXPECT_GT(size(bodies, Pv), 0.5 * size(bodies, v));
}

// Every iterate of the search is a combination of pressure gradients, each of which keeps linear and angular
// momentum. So momentum is kept wherever the search stops.
TEST(PressureSystem, KeepsMomentumWhereverItStops) {
  const Bodies bodies = bodies_of(test::shaken_lattice(Vec3i(3, 4, 3), 0.1, 1), 800);
  const auto v = test::random_vectors(bodies.particles.size(), 3);
  for (const int iterations : {0, 1, 3, 200}) {
    const auto change = difference(projected(bodies, v, {1e-14, iterations}), v);
    EXPECT_EQ(size(bodies, change) > 0, iterations > 0);
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      const Vec3 impulse = bodies.particles.mass[i] * change[i];
      linear += impulse;
      angular += bodies.particles.x[i].cross(impulse);
      sum += impulse.norm();
    }
    // Adding and subtracting rounds every velocity, of some 1 m/s, once.
    EXPECT_LE(linear.norm(), 1e-14 * sum + 1e-30) << iterations;
    EXPECT_LE(angular.norm(), 1e-14 * sum + 1e-30) << iterations;
  }
}

// Conjugate residuals minimize the residual in the norm of the diagonal preconditioner, so it cannot grow
// from one iteration to the next.
TEST(PressureSystem, MoreIterationsNeverLeaveMore) {
  const Bodies bodies = bodies_of(test::shaken_lattice(Vec3i(3, 4, 3), 0.1, 1), 800);
  const auto v = test::random_vectors(bodies.particles.size(), 3);
  double before = std::numeric_limits<double>::infinity();
  for (int iterations = 0; iterations < 50; ++iterations) {
    std::vector<double> rate;
    bodies.nodal_volumes.divergence(projected(bodies, v, {1e-14, iterations}), rate);
    double squared = 0;
    for (std::size_t i = 0; i < rate.size(); ++i)
      squared += rate[i] * rate[i] / bodies.nodal_volumes.diagonal(i);
    EXPECT_LE(squared, before * (1 + 1e-12)) << iterations;
    before = squared;
  }
  expect_below(std::sqrt(before) / size(bodies, v), 1e-6, "residual left, over the size of v");
}

// A body is compressed by 6 %. Newton's method on the nodal volumes converges quadratically: each step leaves
// at most the square of the relative error before.
TEST(PressureSystem, OneStepRestoresVolumes) {
  Bodies bodies = bodies_of(test::shaken_lattice(Vec3i(4, 4, 4), 0.1, 1), 800);
  for (Vec3& x : bodies.particles.x) x.y() *= 0.94;
  NodalVolumes& rings = bodies.nodal_volumes;
  const auto max_error = [&] {
    rings.linearize(bodies.particles.x);
    double largest = 0;
    for (std::size_t i = 0; i < rings.size(); ++i)
      largest = std::max(largest, std::abs(rings.volume(i) / rings.rest_volume(i) - 1));
    return largest;
  };
  PressureScratch scratch;
  scratch.rate.resize(rings.size());
  double error = max_error();
  EXPECT_NEAR(error, 0.06, 1e-12);
  for (int step = 0; step < 3; ++step) {
    for (std::size_t i = 0; i < rings.size(); ++i)
      scratch.rate[i] = (rings.rest_volume(i) - rings.volume(i)) / dt;
    EXPECT_TRUE(find_pressures(bodies, nullptr, dt, {1e-10, 400}, scratch).converged);
    for (std::size_t p = 0; p < bodies.particles.size(); ++p)
      bodies.particles.x[p] += dt * scratch.change.particle[p];
    const double next = max_error();
    expect_below(next, std::max(error * error, 1e-9), "largest error of a one-ring");
    error = next;
  }
}

// Particles without inverse mass keep their velocity, and all others change theirs.
TEST(PressureSystem, PinnedParticlesStay) {
  TetMesh mesh = test::shaken_lattice(Vec3i(3, 3, 3), 0.1, 1);
  Bodies bodies = bodies_of(mesh, 800);
  const auto v = test::random_vectors(mesh.nodes.size(), 3);
  bodies.nodal_volumes = {};
  bodies.nodal_volumes.add(mesh.tets, mesh.nodes);
  for (std::size_t i = 0; i < mesh.nodes.size(); i += 3) bodies.particles.inverse_mass[i] = 0;
  bodies.nodal_volumes.finalize(bodies.particles.inverse_mass, mesh.nodes);
  const auto after = projected(bodies, v, {1e-6, 400});
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    if (i % 3 == 0)
      EXPECT_EQ(after[i], v[i]);
    else
      EXPECT_NE(after[i], v[i]);
  }
}

// Water in a glass: walls and bottom hold the water that gravity has set in motion. The mean pressure of a
// tetrahedron's four nodes acts, and it is exactly rho g times the depth, because the pressure is linear.
// (Nodal pressures are only determined up to modes that cancel in every tetrahedron. A lattice whose nodes
// can be colored such that every tetrahedron has one node of each of four colors has three such modes, which
// no particle feels.)
TEST(PressureSystem, PressureInAGlassIsHydrostatic) {
  const Vec3i cells(5, 8, 4);
  const double density = 800, g = 9.8, top = 4;  // kg/m^3, m/s^2, m
  TetMesh mesh = box_lattice(cells.cast<double>(), cells);
  std::mt19937 random(7);
  const auto is_free = [&](const Vec3& x) {
    return std::abs(x.x()) < 2.4 && std::abs(x.z()) < 1.9 && x.y() > -3.9;
  };
  for (Vec3& x : mesh.nodes)
    if (is_free(x) && x.y() < 3.9) x += 0.1 * test::random_vector(random);
  Bodies bodies = bodies_of(mesh, density);
  std::vector<Vec3> v(mesh.nodes.size(), Vec3::Zero());
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    if (is_free(mesh.nodes[i]))
      v[i].y() = -g * dt;
    else
      bodies.particles.inverse_mass[i] = 0;
  }
  bodies.nodal_volumes = {};
  bodies.nodal_volumes.add(mesh.tets, mesh.nodes);
  bodies.nodal_volumes.finalize(bodies.particles.inverse_mass, mesh.nodes);
  PressureScratch scratch;
  stop_rates(bodies, scratch, v);
  find_pressures(bodies, nullptr, dt, {1e-15, 400}, scratch);
  double fastest = 0, off = 0;
  for (std::size_t i = 0; i < v.size(); ++i)
    fastest = std::max(fastest, (v[i] + scratch.change.particle[i]).norm());
  for (const Tet& tet : mesh.tets) {
    double pressure = 0, depth = 0;
    bool is_inside = true;  // near the walls few particles feel pressures, which are not all determined
    for (const int i : tet) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(i)];
      pressure += scratch.pressure[static_cast<std::size_t>(i)] / 4;
      depth += (top - x.y()) / 4;
      is_inside &= is_free(x);
    }
    if (is_inside) off = std::max(off, std::abs(pressure / (density * g * dt) - depth));
  }
  expect_below(fastest / (g * dt), 1e-9, "motion that is left");
  expect_below(off, 1e-9, "pressure off the depth, m of water");
}

}  // namespace
}  // namespace duet::pressure_system_test
