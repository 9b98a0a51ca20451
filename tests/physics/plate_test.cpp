// Deflections of shells against beam and plate theory, for cells of many shapes.
#include <cmath>
#include <string>

#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::plate_test {
namespace {

using Cells = Eigen::Vector2i;

constexpr double length = 0.5, width = 0.1, thickness = 0.01, modulus = 1e7, density = 1000;

// Returns a flat panel from x = -length / 2 to length / 2.
scene::Scene plate(double nu, const Cells& cells, double panel_width = width) {
  scene::Scene scene = test::free_space();
  scene::Material& material = test::add_material(scene, "rubber");
  material.density = density;
  material.youngs_modulus = modulus;
  material.poisson_ratio = nu;
  scene::DeformableBody& body =
      test::add_panel(scene, "plate", Vec3::Zero(), Vec2(length, panel_width), 1, thickness);
  body.shape.panel_cells = cells;
  body.self_collision = false;
  return scene;
}

// Returns the vertical displacements (m) of all particles under the vertical `load` (N) if the particles with
// `held` cannot move. The forces of a flat panel without tension are linear in vertical displacements.
Eigen::VectorXd deflections(World& world, const std::vector<bool>& held, const Eigen::VectorXd& load) {
  const std::vector<Vec3>& rest = world.bodies.particles.x;
  const Eigen::Index n = load.size();
  constexpr double probe = 1e-6;  // m
  Eigen::MatrixXd stiffness(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    std::vector<Vec3> x = rest, force(rest.size(), Vec3::Zero());
    x[static_cast<std::size_t>(j)].y() += probe;
    world.bodies.forces.shell_bending.add_elastic_forces(x, force);
    for (Eigen::Index i = 0; i < n; ++i) stiffness(i, j) = -force[static_cast<std::size_t>(i)].y() / probe;
  }
  Eigen::VectorXd free_load = load;
  for (Eigen::Index i = 0; i < n; ++i)
    if (held[static_cast<std::size_t>(i)]) {
      stiffness.row(i).setZero();
      stiffness.col(i).setZero();
      stiffness(i, i) = 1;
      free_load[i] = 0;
    }
  return stiffness.ldlt().solve(free_load);
}

// Returns the deflection of the free end of a cantilever under its own weight, relative to w L^4 / (8 E I).
// Two rows of particles are held. The piece bends from the middle between them on, so L is less by half a
// cell.
double cantilever(double nu, const Cells& cells) {
  const scene::Scene scene = plate(nu, cells);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const Particles& particles = world.bodies.particles;
  const double cell = length / cells.x();
  std::vector<bool> held;
  Eigen::VectorXd load(static_cast<Eigen::Index>(particles.size()));
  for (std::size_t p = 0; p < particles.size(); ++p) {
    held.push_back(particles.x[p].x() < -length / 2 + 1.01 * cell);
    load[static_cast<Eigen::Index>(p)] = particles.mass[p];
  }
  const Eigen::VectorXd sag = deflections(world, held, load);
  double tip = 0;
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.x[p].x() > length / 2 - 1e-9) tip += sag[static_cast<Eigen::Index>(p)] / (cells.y() + 1);
  const double rigidity = modulus * std::pow(thickness, 3) / 12;  // E I per width
  return tip / (density * thickness * std::pow(length - cell / 2, 4) / (8 * rigidity));
}

// The stiffness must not depend on the shape of the cells: the deflection of the hinges that bending was made
// of before was 1.07 to 1.91 times that of beam theory. With nu = 0, the bound of 1.5 % is the error of the
// coarsest panel, 8 cells long. With nu = 0.3, the held rows keep the panel from curving across, which makes
// it stiffer by up to 4 % than a beam.
TEST(Plate, CantileverBendsAsBeamTheorySaysForAllCells) {
  for (const Cells& cells : {Cells(8, 2), Cells(16, 4), Cells(20, 2), Cells(24, 1), Cells(40, 2),
                             Cells(10, 6), Cells(9, 9), Cells(12, 3)}) {
    SCOPED_TRACE(std::to_string(cells.x()) + " x " + std::to_string(cells.y()));
    test::expect_below(std::abs(cantilever(0, cells) - 1), 0.015, "deflection with nu = 0");
    test::expect_below(std::abs(cantilever(0.3, cells) - 0.98), 0.03, "deflection with nu = 0.3");
  }
}

// A square plate whose four edges are held (but may turn) sags by 0.004062 q a^4 / D under a uniform load,
// for any nu (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, table 8). Linear elements
// converge with the square of their size.
TEST(Plate, SimplySupportedSquareSagsAsPlateTheorySays) {
  for (const Cells& cells : {Cells(16, 16), Cells(24, 8), Cells(8, 24)}) {
    SCOPED_TRACE(std::to_string(cells.x()) + " x " + std::to_string(cells.y()));
    const scene::Scene scene = plate(0.3, cells, length);
    Simulation simulation(scene, test::plan(scene));
    World& world = simulation.world();
    const Particles& particles = world.bodies.particles;
    std::vector<bool> held;
    Eigen::VectorXd load(static_cast<Eigen::Index>(particles.size()));
    for (std::size_t p = 0; p < particles.size(); ++p) {
      const Vec3& x = particles.x[p];
      held.push_back(std::max(std::abs(x.x()), std::abs(x.z())) > length / 2 - 1e-9);
      load[static_cast<Eigen::Index>(p)] = particles.mass[p];
    }
    const double sag = deflections(world, held, load).maxCoeff();
    const double rigidity = modulus * std::pow(thickness, 3) / (12 * (1 - 0.3 * 0.3));
    const double expected = 0.004062 * density * thickness * std::pow(length, 4) / rigidity;
    test::expect_below(std::abs(sag / expected - 1), 0.05, "sag");
  }
}

// The simulator comes to rest where beam theory says, with cells of 1 to 2, in both integrations.
TEST(Plate, CantileverComesToRestWhereBeamTheorySays) {
  for (const scene::Integration integration :
       {scene::Integration::semi_implicit, scene::Integration::implicit}) {
    const double gravity = 0.05;
    scene::Scene scene = plate(0, Cells(10, 1));
    scene.gravity = Vec3(0, -gravity, 0);
    scene.materials[0].damping = 0.2;
    scene.solver.integration = integration;
    const double cell = length / 10, free = length - cell / 2;
    scene.deformable[0].pins = {
        {Vec3(-length / 2, 0, -width / 2), Vec3(-length / 2, 0, width / 2), 1.01 * cell, {}}};
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 72; ++frame) simulation.advance_frame();
    double lowest = 0;
    for (const Vec3& x : simulation.world().bodies.particles.x) lowest = std::min(lowest, x.y());
    const double expected =
        density * thickness * gravity * std::pow(free, 4) / (8 * modulus * std::pow(thickness, 3) / 12);
    test::expect_below(std::abs(-lowest / expected - 1), 0.02, "deflection");
  }
}

}  // namespace
}  // namespace duet::plate_test
