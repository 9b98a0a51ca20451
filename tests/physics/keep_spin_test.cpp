// Deformable bodies that nothing touches keep their angular momentum to rounding, and others are not
// corrected. The tests of bodies with bones are in tests/physics/everyday_soft_spin_test.cpp.
#include <cmath>
#include <functional>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::keep_spin_test {
namespace {

using test::add_soft_box;
using test::expect_above;
using test::expect_below;

Vec3 spin_of(const Simulation& simulation) {  // of one body, about its center of mass
  const Particles& particles = simulation.world().bodies.particles;
  double mass = 0;
  Vec3 center = Vec3::Zero();
  for (std::size_t p = 0; p < particles.size(); ++p) {
    mass += particles.mass[p];
    center += particles.mass[p] * particles.x[p];
  }
  const Momentum total = momentum(simulation.world().bodies);
  return total.angular - (center / mass).cross(total.linear);
}

// Returns the relative change of the spin in 12 frames of a body that tumbles, flies and falls.
double lost(scene::Scene scene) {
  scene.gravity = Vec3(0, -9.8, 0);
  scene.deformable[0].placement.velocity = Vec3(3, 5, -1);
  scene.deformable[0].placement.angular_velocity = Vec3(1, 5, 2);
  Simulation simulation(scene, test::plan(scene));
  const Vec3 before = spin_of(simulation);
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  return (spin_of(simulation) - before).norm() / before.norm();
}

// Returns a scene with one body of the given kind.
scene::Scene one(scene::DeformableKind kind) {
  scene::Scene scene = test::free_space();
  scene::DeformableBody& body = add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 3, 1e5);
  scene.materials[0].damping = 0.02;
  body.shape.kind = kind;
  return scene;
}

// Internal forces give no angular momentum, so its change is rounding. Without `keep_spin` moving positions
// takes more than 1e-5.
TEST(KeepSpin, HoldsForVolumesDampedOrNot) {
  scene::Scene scene = one(scene::DeformableKind::box);
  expect_below(lost(scene), 1e-12, "damped");
  scene.materials[0].damping = 0;
  expect_below(lost(scene), 1e-12, "undamped");
  scene.solver.keep_spin = false;
  expect_above(lost(scene), 1e-5, "undamped and left to itself");
}

// Damping in proportion to mass takes momentum and spin at its rate c, as exp(-c t); the correction must not
// give this spin back. Steps multiply velocities by exp(-c dt). What is left comes from deformation: the
// places and velocities at which a step evaluates damping belong to different times in it.
TEST(KeepSpin, IsTakenAwayByTheDampingOfMass) {
  scene::Scene scene = one(scene::DeformableKind::box);
  scene.materials[0].mass_damping = 2;
  expect_below(std::abs(lost(scene) - (1 - std::exp(-2 * 0.5))), 2e-5, "off the exponential");
}

// A straight rod has no inertia about its line, so the correction must not divide by it.
TEST(KeepSpin, HoldsForARodOnALine) {
  scene::Scene scene = one(scene::DeformableKind::rod);
  scene.deformable[0].shape.points = {Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0)};
  scene.deformable[0].shape.segments = 8;
  scene.deformable[0].thickness = 0.02;
  expect_below(lost(scene), 1e-12, "a rod");
}

// Returns whether 12 frames have the same bits with `keep_spin` and without.
bool leaves_alone(scene::Scene scene) {
  Simulation with(scene, test::plan(scene));
  scene.solver.keep_spin = false;
  Simulation without(scene, test::plan(scene));
  for (int frame = 0; frame < 12; ++frame) {
    with.advance_frame();
    without.advance_frame();
  }
  return with.stats().hash == without.stats().hash;
}

// Contact with another soft body changes spin, and the correction must not undo that.
TEST(KeepSpin, LeavesAloneWhatLiesOnAnotherSoftBody) {
  scene::Scene scene = test::on_ground(0.4);
  scene.ground.reset();
  scene::Pin pin;
  pin.from = Vec3(0, 0.5, 0);
  pin.radius = 2;
  add_soft_box(scene, "lower", Vec3(0, -0.5, 0), Vec3(2, 1, 2), 2, 1e5).pins.push_back(pin);
  add_soft_box(scene, "upper", Vec3(0, 0.5005, 0), Vec3(1, 1, 1), 2, 1e5).placement.velocity =
      Vec3(0.2, 0, 0);
  EXPECT_TRUE(leaves_alone(scene));
}

// The correction applies to bodies in free flight alone, together with the bones that fly with them. A body
// that the ground, a pin, a static body or a jointed bone holds gets its spin from outside.
TEST(KeepSpin, LeavesAloneWhatIsTouchedHeldOrTied) {
  scene::Scene scene = test::on_ground(0.4);
  scene::DeformableBody& body = add_soft_box(scene, "soft", Vec3(0, 0.499, 0), Vec3(1, 1, 1), 2, 1e5);
  body.placement.velocity = Vec3(1, 0, 0);
  EXPECT_TRUE(leaves_alone(scene)) << "sliding on the ground";

  scene.ground.reset();
  body.placement.angular_velocity = Vec3(0, 2, 1);
  EXPECT_FALSE(leaves_alone(scene)) << "in free fall";

  scene::Scene pinned = scene;
  scene::Pin pin;
  pin.from = Vec3(-0.5, -0.5, -0.5);
  pin.radius = 0.1;
  pinned.deformable[0].pins.push_back(pin);
  EXPECT_TRUE(leaves_alone(pinned)) << "held";

  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3(0, 0.5, 0), Vec3(0.6, 0.6, 0.6), 100);
  scene.deformable[0].attach = {"bone"};
  scene.deformable[0].shape.cells = Vec3i::Constant(4);
  EXPECT_FALSE(leaves_alone(scene)) << "bound to a bone that flies with it";

  scene::Scene hanging = scene;
  test::add_peg(hanging, "peg", Vec3(0, 2, 0));
  test::add_joint(hanging, scene::JointType::point, "peg", "bone", Vec3(0, 2, 0));
  EXPECT_TRUE(leaves_alone(hanging)) << "bound to a bone that hangs";

  bone.mass.reset();
  bone.is_static = true;
  EXPECT_TRUE(leaves_alone(scene)) << "bound to a static body";
  scene.deformable[0].attach_springs.emplace();
  EXPECT_TRUE(leaves_alone(scene)) << "tied to it by springs";
}

}  // namespace
}  // namespace duet::keep_spin_test
