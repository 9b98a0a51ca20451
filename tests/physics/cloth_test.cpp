// Shells, rods and mass-spring volumes in whole simulations.
#include <algorithm>
#include <cmath>

#include "tests/support/elastic_state.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::cloth_test {
namespace {

double total_energy(const World& world) {
  return test::mechanical_energy(world) + gravitational_energy(world.bodies, world.gravity);
}

// A cloth of 0.3 m held along one edge, let go flat.
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

// A small step: elasticity is explicit, and what its rule has for an energy swings with the square of the
// step.
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
    // J, what its weight of 0.36 N does where it falls by half of its length, of which it still swings with
    // some.
    EXPECT_GT(start - last, 0.25 * 0.4 * 0.09 * 9.8 * 0.15);
  }
}

// A free pendulum of its length would take 0.9 s to swing to and fro; 100 times that. Without damping nothing
// may be lost or won but what the oscillation of the rule's error makes, which is of second order in the
// step.
TEST(Cloth, HangingWithoutDampingKeepsItsEnergyForAHundredPeriods) {
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
    while (simulation.stats().time < 100 * period) {
      simulation.advance_frame();
      worst = std::max(worst, std::abs(total_energy(simulation.world()) - start) / swing);
    }
    EXPECT_GT(kinetic_energy(simulation.world().bodies), 0.01 * swing) << "it still moves";
    test::expect_below(worst, 0.01, springs ? "energy error of springs" : "energy error of elements");
  }
}

// What a panel that spins in free space loses of its angular momentum in a second, as a part of it.
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

// What keeps the panel together gives it no momentum. Left to itself, moving positions by v^{n+1/2} leaves a
// defect of the angular momentum of second order in the step: a quarter at half of it, 3.4 where the order
// is 1.75.
TEST(Cloth, FreeMotionKeepsMomentum) {
  test::expect_below(angular_momentum_defect(0.7, true), 1e-12, "angular momentum");
  const double defect = angular_momentum_defect(0.125, false);
  test::expect_below(defect, 1e-4, "without keep_spin");
  test::expect_below(3.4 * defect / angular_momentum_defect(0.25, false), 1, "times what theory says");
}

// A hanging chain of rod pieces takes the shape of the catenary: its sag for a rope 1.2 times as long as the
// distance of its ends is 0.2857 of it.
TEST(Rope, HangsInTheCatenary) {
  scene::Scene scene;
  scene.title = "test";
  scene::Material& hemp = test::add_material(scene, "hemp");
  hemp.youngs_modulus = 1e7;
  hemp.damping = 0.05;
  hemp.bending_factor = 0;
  // The arc of a circle of that length, from end to end.
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
  // sinh(u)/u = 1.2 at u = 1.0645; the sag is (cosh u - 1) / (2 u)
  const double u = 1.0645, sag = (std::cosh(u) - 1) / (2 * u);
  EXPECT_NEAR(-lowest, sag, 0.01 * sag);
}

scene::Scene spring_box() {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "box", Vec3(0, 0.501, 0), Vec3(1, 1, 1), 3);
  scene.materials[0].has_springs = true;
  scene.materials[0].springs = {2e4, 1};
  return scene;
}

double min_volume(const Bodies& bodies, const std::vector<Tet>& tets) {
  double least = 1e9;
  for (const Tet& t : tets)
    least = std::min(least, tet_volume(bodies.particles.x[static_cast<std::size_t>(t[0])],
                                       bodies.particles.x[static_cast<std::size_t>(t[1])],
                                       bodies.particles.x[static_cast<std::size_t>(t[2])],
                                       bodies.particles.x[static_cast<std::size_t>(t[3])]));
  return least;
}

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

// Flattened, turned inside out, thrown at random into its box: altitude springs bring every tet back.
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

// A cloth on a ball and a ground touches them with half of its thickness.
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

// What pins hold stays where it is to the last bit, whatever pulls and falls.
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
