// Deflections of soft bodies against beam theory.
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/solve/conjugate_gradient.h"
#include "sim/step/step.h"

namespace duet::beam_test {
namespace {

constexpr double length = 1, height = 0.2, modulus = 1e7, density = 1000, gravity = 1;

// Returns a beam that is clamped at x = 0, with `cells` lattice cells along its height and one across.
// Poisson's ratio is 0, so that its width does not matter.
scene::Scene cantilever(int cells) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -gravity, 0);
  const double cell = height / cells;
  scene::DeformableBody& beam =
      test::add_soft_box(scene, "beam", Vec3(length / 2, 0, 0), Vec3(length, height, cell), 1, modulus);
  beam.shape.cells = Vec3i(static_cast<int>(length / height) * cells, cells, 1);
  scene.materials[0].density = density;
  scene.materials[0].poisson_ratio = 0;
  return scene;
}

// Holds the particles at x = 0.
void clamp(Particles& particles) {
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.x[p].x() < 1e-9) particles.inverse_mass[p] = 0;
}

// Returns how far (m) the middle of the free end has sunk from the positions `rest` to the positions
// `loaded`.
double sag(const std::vector<Vec3>& rest, const std::vector<Vec3>& loaded) {
  double sum = 0;
  int count = 0;
  for (std::size_t p = 0; p < rest.size(); ++p)
    if (rest[p].x() > length - 1e-9) {
      sum += rest[p].y() - loaded[p].y();
      ++count;
    }
  return sum / count;
}

// The static linear system K u = f over the particles that are free, as conjugate_gradient() needs it.
struct StaticSystem {
  World& world;
  void apply(const std::vector<Vec3>& u, std::vector<Vec3>& out) {
    out.assign(u.size(), Vec3::Zero());
    world.bodies.forces.add_force_differentials(u, out);
    for (Vec3& force : out) force = -force;
    project(out);
  }
  void project(std::vector<Vec3>& u) const {
    for (std::size_t p = 0; p < u.size(); ++p)
      if (is_held(world.bodies.particles, p)) u[p].setZero();
  }
  double inner(const std::vector<Vec3>& a, const std::vector<Vec3>& b) const {
    double sum = 0;
    for (std::size_t p = 0; p < a.size(); ++p) sum += a[p].dot(b[p]);
    return sum;
  }
  struct Measure {
    double inner, norm;
  };
  Measure measure(const std::vector<Vec3>& a) const {
    const double squared = inner(a, a);
    return {squared, std::sqrt(squared)};
  }
  static void subtract(const std::vector<Vec3>& a, const std::vector<Vec3>& b, std::vector<Vec3>& out) {
    out = a;
    axpy(-1, b, out);
  }
  static void copy(const std::vector<Vec3>& from, std::vector<Vec3>& to) { to = from; }
  static void accumulate(double) {}
  static void axpy(double alpha, const std::vector<Vec3>& x, std::vector<Vec3>& y) {
    for (std::size_t p = 0; p < x.size(); ++p) y[p] += alpha * x[p];
  }
  static void xpay(const std::vector<Vec3>& x, double beta, std::vector<Vec3>& y) {
    for (std::size_t p = 0; p < x.size(); ++p) y[p] = x[p] + beta * y[p];
  }
};

// Returns the tip deflection (m) for small displacements: the one at which the elements' forces balance the
// weight.
double static_deflection(int cells) {
  const scene::Scene scene = cantilever(cells);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  Particles& particles = world.bodies.particles;
  clamp(particles);
  std::vector<Vec3> weight(particles.size(), Vec3::Zero()), moved = particles.x;
  world.bodies.forces.add_elastic_forces(particles.x, weight);
  world.bodies.forces.linearize();
  for (std::size_t p = 0; p < particles.size(); ++p)
    weight[p] = is_held(particles, p) ? Vec3(Vec3::Zero()) : Vec3(particles.mass[p] * world.gravity);
  StaticSystem system{world};
  std::vector<Vec3> u(particles.size(), Vec3::Zero()), residual, direction, image;
  const CgResult result = conjugate_gradient(system, weight, 1e-6 * system.measure(weight).norm, 20000, u,
                                             residual, direction, image);
  EXPECT_TRUE(result.converged);
  StaticSystem::axpy(1, u, moved);
  return sag(particles.x, moved);
}

// delta = q L^4 / (8 E I) + q L^2 / (2 k G A): bending and shear of a cantilever under its own weight
// (Timoshenko), with G = E/2 and k = 5/6. Linear elements converge with the square of their size, so halving
// it must leave less than 0.4 of the error; a wrong stiffness would leave an error that does not fall.
TEST(Beam, CantileverBendsAsBeamTheorySays) {
  const double strain = density * gravity * length / modulus, slender = length / height;
  const double expected = strain * length * (12 * slender * slender / 8 + 2 / (2 * 5.0 / 6));
  double last = 1;
  for (const int cells : {2, 4, 8, 16}) {
    const double error = std::abs(static_deflection(cells) / expected - 1);
    EXPECT_LT(error, 0.4 * last) << "linear elements: errors fall with the square of their size";
    last = error;
  }
  test::expect_below(last, 0.03, "tip deflection");
}

// The simulator must come to rest where the forces balance, in both integrations, to 1e-3. Half of critical
// damping for the lowest mode of 3.2 Hz leaves 3 % of the swing after each period, which is far below the
// bound after two seconds.
TEST(Beam, CantileverComesToRestWhereItsForcesBalance) {
  for (const scene::Integration integration :
       {scene::Integration::semi_implicit, scene::Integration::implicit}) {
    scene::Scene scene = cantilever(2);
    scene.materials[0].damping = 0.05;
    scene.solver.integration = integration;
    scene.solver.max_time_step = 1.0 / 24;
    scene.solver.cg_tolerance = 1e-6;
    Simulation simulation(scene, test::plan(scene));
    Particles& particles = simulation.world().bodies.particles;
    clamp(particles);
    const std::vector<Vec3> rest = particles.x;
    for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
    const double expected = static_deflection(2);
    EXPECT_NEAR(sag(rest, particles.x), expected, 1e-3 * expected);
  }
}

}  // namespace
}  // namespace duet::beam_test
