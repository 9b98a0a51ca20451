// Implicit steps of stiff bodies that touch: their matrix is factorized, so that conjugate gradients need few
// iterations, and they gain no energy, also where bodies overlap at the start.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/elastic_state.h"
#include "tests/support/energy.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::stiff_implicit_test {
namespace {

// Returns a scene with implicit steps and one material, of the density (kg/m^3), Young's modulus (Pa),
// damping (s) and bending factor that are given.
scene::Scene implicit_scene(double density, double youngs_modulus, double damping, double bending_factor) {
  scene::Scene scene;
  scene.title = "test";
  scene.fps = 24;
  scene.solver.integration = scene::Integration::implicit;
  scene::Material& material = test::add_material(scene, "material");
  material.density = density;
  material.youngs_modulus = youngs_modulus;
  material.poisson_ratio = 0.3;
  material.damping = damping;
  material.bending_factor = bending_factor;
  return scene;
}

// Returns a curtain that hangs from its upper edge, and a rigid ball of `mass` (kg) that flies into it.
scene::Scene curtain_and_ball(double youngs_modulus, double mass) {
  scene::Scene scene = implicit_scene(300, youngs_modulus, 0.01, 0.1);
  scene::DeformableBody& cloth = test::add_panel(scene, "cloth", Vec3(0, 2, 0), Vec2(1, 1), 10, 0.004);
  cloth.placement.orientation = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  cloth.pins = {{Vec3(0.5, 0, -0.5), Vec3(0.5, 0, 0.5), 1e-3, {}}};
  scene::RigidBody& ball = test::add_ball(scene, "ball", Vec3(-0.3, 1.9, 0), 0.2, mass);
  ball.placement.velocity = Vec3(4, 1, 0);
  return scene;
}

// Returns the total energy (J), with the potential energy from the height of the center of mass.
double energy_of(const World& world) {
  double potential = 0;
  for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
    potential -= world.bodies.particles.mass[p] * world.gravity.dot(world.bodies.particles.x[p]);
  for (std::size_t i = 0; i < world.bodies.rigid.size(); ++i)
    potential -=
        world.bodies.rigid.properties[i].mass * world.gravity.dot(world.bodies.rigid.state[i].pose.position);
  return test::mechanical_energy(world) + potential;
}

// Without the factorization a substep takes up to 13,600 iterations, and its solves end without having
// converged. Energy may rise by rounding and the tolerance of the solves only.
TEST(StiffImplicit, CurtainsNeedFewIterationsAndLoseEnergy) {
  double most = 0, gained = 0;
  for (const double youngs_modulus : {1e6, 1e8})
    for (const double mass : {1.0, 30.0}) {
      Simulation simulation(curtain_and_ball(youngs_modulus, mass),
                            test::plan(curtain_and_ball(youngs_modulus, mass)));
      double least = energy_of(simulation.world());
      const double motion = kinetic_energy(simulation.world().bodies);
      for (int frame = 0; frame < 8; ++frame) {
        simulation.advance_frame();
        const FrameStats stats = simulation.stats();
        most = std::max(most, static_cast<double>(stats.cg_iterations) / stats.substeps);
        gained = std::max(gained, (energy_of(simulation.world()) - least) / motion);
        least = std::min(least, energy_of(simulation.world()));
      }
      EXPECT_LT(simulation.world().bodies.rigid.state.back().velocity.x(), 3.9) << "it was hit";
    }
  test::expect_below(most, 5000, "iterations of a substep");
  test::expect_below(gained, 1e-3, "energy gained, over that of the ball");
}

// Returns a limp rope over a static bar along z, with weights of 1 and 2 kg at its ends. Its nodes lie on a
// circle that it just touches the bar on, so that its segments overlap the bar.
scene::Scene rope_over_bar(double youngs_modulus, double damping, double radius) {
  scene::Scene scene = implicit_scene(100, youngs_modulus, damping, 0);
  constexpr double thickness = 0.01;
  const double around = radius + thickness / 2;
  std::vector<Vec3> points{Vec3(-around, -0.8, 0), Vec3(-around, -0.4, 0)};
  for (int i = 0; i <= 12; ++i) {
    const double angle = std::numbers::pi * (1 - i / 12.0);
    points.emplace_back(around * std::cos(angle), around * std::sin(angle), 0);
  }
  points.emplace_back(around, -0.4, 0);
  points.emplace_back(around, -0.8, 0);
  scene::DeformableBody& rope = test::add_rope(scene, "rope", points, 60, thickness);
  rope.attach = {"light", "heavy"};
  test::add_box(scene, "light", Vec3(-around, -0.84, 0), Vec3::Constant(0.1), 1).friction = 0;
  test::add_box(scene, "heavy", Vec3(around, -0.84, 0), Vec3::Constant(0.1), 2).friction = 0;
  scene::RigidBody& bar = scene.rigid.emplace_back();
  bar.name = "bar";
  bar.shape.kind = scene::ShapeKind::cylinder;
  bar.shape.radius = radius;
  bar.shape.length = 0.3;
  bar.placement.orientation = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
  bar.is_static = true;
  return scene;
}

// The overlaps are opened over many steps, whose other gains of energy are checked meanwhile. Without that
// ropes gained more than all that moves. The stretch that makes room holds E A (pi d)^2 / (2 L) = 7 mJ, with
// d = 0.9 mm between an arc and its chord and the length L = 1.9 m, of 1 J that moves.
TEST(StiffImplicit, RopesThatOverlapABarAtTheStartGainNoEnergy) {
  double gained = 0;
  for (const double damping : {3e-4, 1e-3})
    for (const double radius : {0.05, 0.1})
      gained = std::max(gained, test::gain_of(rope_over_bar(5e7, damping, radius), 6));
  test::expect_below(gained, 0.01, "energy gained, over that of the motion");
}

}  // namespace
}  // namespace duet::stiff_implicit_test
