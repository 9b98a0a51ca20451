// Shells, rods and mass-spring volumes in whole simulations.
#include <algorithm>
#include <cmath>

#include "tests/support/elastic_state.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::cloth_test {
namespace {

// Returns kinetic, elastic and potential energy, in J.
double total_energy(const World& world) {
  return test::mechanical_energy(world) + gravitational_energy(world.bodies, world.gravity);
}

// Returns a cloth of 0.3 m that is held along one edge and let go from the horizontal.
scene::Scene hanging_cloth(bool springs, double damping) {
  scene::Scene scene;
  scene.title = "test";
  scene::Material& material = test::add_material(scene, "cloth");
  material.density = 400;
  material.youngs_modulus = 2e4;
  material.poisson_ratio = 0.3;
  material.damping = damping;
  material.bending_factor = 10;
  material.has_springs = material.has_bending_springs = springs;
  material.springs = {10, damping > 0 ? 1.0 : 0.0};
  material.bending_springs = {0.1, damping > 0 ? 1.0 : 0.0};
  scene::DeformableBody& cloth = test::add_panel(scene, "cloth", Vec3::Zero(), Vec2(0.3, 0.3), 4, 0.001);
  cloth.pins = {{Vec3(-0.15, 0, -0.15), Vec3(0.15, 0, -0.15), 1e-3, {}}};
  scene.solver.max_time_step = 1;
  return scene;
}

// With damping and gravity alone the total energy never rises. The step is small, because elasticity is
// explicit and the energy that its rule conserves differs from the true one by an oscillation of second order
// in the step.
TEST(Cloth, HangingWithDampingLosesEnergyAtEveryFrame) {
  for (const bool springs : {false, true}) {
    SCOPED_TRACE(springs ? "springs" : "elements");
    scene::Scene scene = hanging_cloth(springs, 0.02);
    scene.solver.cfl = 0.1;
    scene.solver.cg_tolerance = 1e-6;
    Simulation simulation(scene, test::plan(scene));
    const double start = total_energy(simulation.world());
    double last = start;
    for (int frame = 0; frame < 48; ++frame) {
      simulation.advance_frame();
      const double now = total_energy(simulation.world());
      EXPECT_LT(now, last) << frame;
      last = now;
    }
    // The cloth's weight of 0.36 N does a work of m g L/2 (J) when its middle falls by half of its length. A
    // quarter of that must be lost, because the cloth still swings with some of it.
    EXPECT_GT(start - last, 0.25 * 0.4 * 0.09 * 9.8 * 0.15);
  }
}

// Without damping, the total energy may differ from the start only by the oscillation of the explicit rule,
// which is of second order in the step: half a percent of the energy of the swing. The test runs for 100
// periods of a rigid plate of this length, T = 2 pi sqrt(2 L / (3 g)) = 0.9 s (outside of long tests for 30);
// a drift would add up to more than the bound of 1 %.
TEST(Cloth, HangingWithoutDampingKeepsItsEnergyForAHundredPeriods) {
  const int periods = test::runs_in_full() ? 100 : 30;
  for (const bool springs : {false, true}) {
    SCOPED_TRACE(springs ? "springs" : "elements");
    scene::Scene scene = hanging_cloth(springs, 0);
    scene.solver.cfl = 0.15;
    scene.deformable[0].self_collision =
        false;  // it flutters, and where it touched itself it would lose some
    Simulation simulation(scene, test::plan(scene));
    const double start = total_energy(simulation.world());
    const double swing = 0.4 * 0.09 * 9.8 * 0.15;  // J, from flat to hanging
    double worst = 0;
    const double period = 2 * EIGEN_PI * std::sqrt(2 * 0.3 / (3 * 9.8));
    while (simulation.stats().time < periods * period) {
      simulation.advance_frame();
      worst = std::max(worst, std::abs(total_energy(simulation.world()) - start) / swing);
    }
    EXPECT_GT(kinetic_energy(simulation.world().bodies), 0.01 * swing) << "it still moves";
    test::expect_below(worst, 0.01, springs ? "energy error of springs" : "energy error of elements");
  }
}

// Returns the relative change of the angular momentum of a panel that spins in free space for a second.
double angular_momentum_defect(double cfl, bool keep_spin) {
  scene::Scene scene = hanging_cloth(false, 0.01);
  scene.solver.keep_spin = keep_spin;
  scene.gravity.setZero();
  scene.solver.cfl = cfl;
  scene.deformable[0].pins.clear();
  scene.deformable[0].placement.angular_velocity = Vec3(1, 2, 3);
  scene.deformable[0].placement.velocity = Vec3(0.3, 0, 0);
  Simulation simulation(scene, test::plan(scene));
  const FrameStats before = simulation.stats();
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  const FrameStats after = simulation.stats();
  EXPECT_LT((after.momentum - before.momentum).norm(), 1e-10 * before.momentum.norm());
  return (after.angular_momentum - before.angular_momentum).norm() / before.angular_momentum.norm();
}

// Internal forces give no momentum. With `keep_spin` the angular momentum is kept to rounding. Without it,
// moving positions by v^{n+1/2} leaves a defect of second order in the step: half of the step leaves a
// quarter of the defect, and the bound of 1/3.4 corresponds to an order of 1.75.
TEST(Cloth, FreeMotionKeepsMomentum) {
  test::expect_below(angular_momentum_defect(0.7, true), 1e-12, "angular momentum");
  const double defect = angular_momentum_defect(0.125, false);
  test::expect_below(defect, 1e-4, "without keep_spin");
  test::expect_below(3.4 * defect / angular_momentum_defect(0.25, false), 1, "times what theory says");
}

// A hanging rope of many segments takes the shape of the catenary. For a rope 1.2 times as long as the
// distance of its ends, the sag is 0.2857 of that distance. The bound of 1 % leaves room for the rope's
// stretch and its 60 segments.
TEST(Rope, HangsInTheCatenary) {
  scene::Scene scene;
  scene.title = "test";
  scene::Material& hemp = test::add_material(scene, "hemp");
  hemp.youngs_modulus = 1e7;
  hemp.damping = 0.05;
  hemp.bending_factor = 0;
  // The rope starts as an arc of a circle of the right length, from end to end.
  std::vector<Vec3> arc;
  const double half = 1.0265;  // rad: half / sin(half) = 1.2
  for (int i = 0; i <= 40; ++i) {
    const double angle = half * (2.0 * i / 40 - 1);
    arc.emplace_back(0.5 * std::sin(angle) / std::sin(half),
                     0.5 * (std::cos(half) - std::cos(angle)) / std::sin(half), 0);
  }
  scene::DeformableBody& rope = test::add_rope(scene, "rope", arc, 60, 0.01);
  rope.pins = {{Vec3(-0.5, 0, 0), {}, 1e-3, {}}, {Vec3(0.5, 0, 0), {}, 1e-3, {}}};
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 96; ++frame) simulation.advance_frame();
  const auto& x = simulation.world().bodies.particles.x;
  double lowest = 0;
  for (const Vec3& place : x) lowest = std::min(lowest, place.y());
  // For the catenary, sinh(u) / u = 1.2 at u = 1.0645, and the sag is (cosh u - 1) / (2 u).
  const double u = 1.0645, sag = (std::cosh(u) - 1) / (2 * u);
  EXPECT_NEAR(-lowest, sag, 0.01 * sag);
}

// Returns a mass-spring volume of 1 m that stands on the ground.
scene::Scene spring_box() {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "box", Vec3(0, 0.501, 0), Vec3(1, 1, 1), 3);
  scene.materials[0].has_springs = true;
  scene.materials[0].springs = {2e4, 1};
  return scene;
}

// Returns the smallest signed volume (m^3) of the tetrahedra, negative if one is inverted.
double min_volume(const Bodies& bodies, const std::vector<Tet>& tets) {
  double least = 1e9;
  for (const Tet& t : tets)
    least = std::min(least, tet_volume(bodies.particles.x[static_cast<std::size_t>(t[0])],
                                       bodies.particles.x[static_cast<std::size_t>(t[1])],
                                       bodies.particles.x[static_cast<std::size_t>(t[2])],
                                       bodies.particles.x[static_cast<std::size_t>(t[3])]));
  return least;
}

// A volume of springs alone, without finite elements, carries its weight: after a second it has lost less
// than a tenth of its height, hardly moves and does not sink into the ground.
TEST(MassSpringBox, StandsAndCarriesItsWeight) {
  const scene::Scene scene = spring_box();
  const EffectSet plan = test::plan(scene);
  EXPECT_FALSE(plan[index(Effect::deformable_elasticity)]);
  Simulation simulation(scene, plan);
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  double top = 0;
  for (const Vec3& x : simulation.world().bodies.particles.x) top = std::max(top, x.y());
  EXPECT_GT(top, 0.9);
  EXPECT_LT(simulation.stats().kinetic, 1);
  EXPECT_LT(simulation.stats().max_penetration, 2e-3);
}

// A volume that is flattened, turned inside out, or squeezed to a tenth recovers: altitude springs bring
// every tetrahedron back to at least half of its volume.
TEST(MassSpringBox, RecoversFromInversion) {
  scene::Scene scene = spring_box();
  scene.ground.reset();
  scene.gravity.setZero();
  const TetMesh mesh = box_lattice(Vec3(1, 1, 1), Vec3i(3, 3, 3));
  for (const int damage : {0, 1, 2}) {
    SCOPED_TRACE(damage);
    Simulation simulation(scene, test::plan(scene));
    std::vector<Vec3>& x = simulation.world().bodies.particles.x;
    for (Vec3& place : x)
      place.y() = damage == 0 ? 0.5 : damage == 1 ? 1 - place.y() : 0.5 + 0.1 * (place.y() - 0.5);
    EXPECT_LT(min_volume(simulation.world().bodies, mesh.tets), damage == 2 ? 0.01 : 1e-12);
    for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
    const double cell = 1.0 / 27;
    EXPECT_GT(min_volume(simulation.world().bodies, mesh.tets), 0.5 * cell / 6);
  }
}

// The surface of a cloth lies half of its thickness from its particles, so these rest that far from a ball
// and from the ground. The bounds are a tenth of that distance. Contact that ignores the thickness leaves
// them at 0.
TEST(Cloth, RestsOnABallHalfOfItsThicknessAway) {
  scene::Scene scene = test::on_ground();
  scene::RigidBody& ball = test::add_ball(scene, "ball", Vec3(0, 0.3, 0), 0.3, 1);
  ball.mass.reset();
  ball.is_static = true;
  scene::Material& material = test::add_material(scene, "cloth");
  material.density = 300;
  material.youngs_modulus = 1e5;
  material.damping = 0.01;
  test::add_panel(scene, "cloth", Vec3(0, 0.65, 0), Vec2(0.8, 0.8), 16, 0.02);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 36; ++frame) {
    simulation.advance_frame();
    EXPECT_LT(simulation.stats().max_penetration, 5e-3);
  }
  const auto& x = simulation.world().bodies.particles.x;
  double nearest = 1, lowest = 1;
  for (const Vec3& place : x) {
    nearest = std::min(nearest, (place - Vec3(0, 0.3, 0)).norm() - 0.3);
    lowest = std::min(lowest, place.y());
  }
  EXPECT_NEAR(nearest, 0.01, 1e-3);
  EXPECT_GT(lowest, 0.01 - 1e-3);
}

// Pinned particles keep their position to the last bit and have no velocity, whatever pulls at them or falls
// on them. Any stage that moves particles without looking at the inverse mass would break this.
TEST(Cloth, PinnedParticlesNeverMove) {
  scene::Scene scene = hanging_cloth(true, 0.01);
  test::add_ball(scene, "ball", Vec3(0, 0.1, -0.1), 0.05, 0.05);
  Simulation simulation(scene, test::plan(scene));
  const Particles& particles = simulation.world().bodies.particles;
  const std::vector<Vec3> start = particles.x;
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  int pinned = 0;
  for (std::size_t p = 0; p < start.size(); ++p)
    if (particles.inverse_mass[p] == 0) {
      ++pinned;
      EXPECT_EQ(particles.x[p], start[p]);
      EXPECT_EQ(particles.v[p], Vec3::Zero());
    }
  EXPECT_EQ(pinned, 5);
}

}  // namespace
}  // namespace duet::cloth_test
