// Implicit steps of stiff bodies that touch: their matrix is factorized, so that conjugate gradients need few
// iterations, and the solves converge.
#include <algorithm>

#include "tests/support/elastic_state.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::stiff_implicit_test {
namespace {

// Returns a curtain that hangs from its upper edge, and a rigid ball of `mass` (kg) that flies into it.
scene::Scene curtain_and_ball(double youngs_modulus, double mass) {
  scene::Scene scene;
  scene.title = "test";
  scene.fps = 24;
  scene::Material& material = test::add_material(scene, "cloth");
  material.density = 300;
  material.youngs_modulus = youngs_modulus;
  material.poisson_ratio = 0.3;
  material.damping = 0.01;
  material.bending_factor = 0.1;
  scene::DeformableBody& cloth = test::add_panel(scene, "cloth", Vec3(0, 2, 0), Vec2(1, 1), 10, 0.004);
  cloth.placement.orientation = Quat(Eigen::AngleAxisd(1.5707963267948966, Vec3::UnitZ()));
  cloth.pins = {{Vec3(0.5, 0, -0.5), Vec3(0.5, 0, 0.5), 1e-3, {}}};
  scene::RigidBody& ball = test::add_ball(scene, "ball", Vec3(-0.3, 1.9, 0), 0.2, mass);
  ball.placement.velocity = Vec3(4, 1, 0);
  scene.solver.integration = scene::Integration::implicit;
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

// Without the factorization a frame takes 10,000 to 60,000 iterations, and its solves end without having
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
  test::expect_below(most, 2000, "iterations of a substep");
  test::expect_below(gained, 1e-3, "energy gained, over that of the ball");
}

}  // namespace
}  // namespace duet::stiff_implicit_test
