// Bodies that rock on round ones, and bodies that tip over an edge, keep their energy: contact without slip
// and without impacts does no work, though its place moves along a body or turns about it.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_rocking_test {
namespace {

using scene::ShapeKind;

Quat about(const Vec3& axis, double degrees) {
  return Quat(Eigen::AngleAxisd(degrees * double{EIGEN_PI} / 180, axis));
}

// Returns the sum of kinetic energy and energy of gravity, J.
double energy(const World& world) {
  return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
}

// A body that rocks on a static one about the axis z, both of the size 1.
struct Rocker {
  std::string name;
  scene::Shape below, above;
  Quat below_orientation = Quat::Identity(), above_orientation = Quat::Identity();
  double height = 0;  // of the center of the rocking body above that of the static one
};

std::vector<Rocker> rockers() {
  const Quat along_z = about(Vec3::UnitX(), 90), along_x = about(Vec3::UnitZ(), 90);
  const scene::Shape cylinder{.kind = ShapeKind::cylinder, .radius = 0.3, .length = 1},
      ball{.kind = ShapeKind::sphere, .radius = 0.3}, beam{.kind = ShapeKind::box, .size = Vec3(1, 0.1, 0.2)};
  return {{"beam on cylinder", cylinder, beam, along_z, Quat::Identity(), 0.35},
          {"beam on ball", ball, beam, Quat::Identity(), Quat::Identity(), 0.35},
          {"cylinder across cylinder",
           cylinder,
           {.kind = ShapeKind::cylinder, .radius = 0.05, .length = 1},
           along_z,
           along_x,
           0.35},
          {"capsule across cylinder",
           cylinder,
           {.kind = ShapeKind::capsule, .radius = 0.05, .length = 1},
           along_z,
           along_x,
           0.35}};
}

// Returns the largest change of energy of a rocking body within four seconds of its pendulum's time, relative
// to the kinetic energy with which it passes the middle. It starts balanced, with an angular velocity that
// leads to about five degrees.
double change_while_rocking(const Rocker& rocker, double size, double step) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.fps = 24 / std::sqrt(size);
  if (step > 0) scene.solver.max_time_step = step * std::sqrt(size);
  scene::RigidBody body;
  body.name = "below";
  body.friction = 1;
  body.shape = test::scaled(rocker.below, size);
  body.placement.orientation = rocker.below_orientation;
  body.is_static = true;
  scene.rigid.push_back(body);
  body.name = "above";
  body.shape = test::scaled(rocker.above, size);
  body.placement.orientation = rocker.above_orientation;
  body.placement.position = Vec3(0, rocker.height * size, 0);
  const double spin = 0.45 / std::sqrt(size);  // rad/s
  body.placement.angular_velocity = Vec3(0, 0, spin);
  body.placement.velocity = Vec3(-0.05 * size * spin, 0, 0);  // it rolls
  body.is_static = false;
  body.density = 1000;
  scene.rigid.push_back(body);
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const double start = energy(world), moving = kinetic_energy(world.bodies);
  double change = 0;
  for (int frame = 0; frame < 96; ++frame) {
    simulation.advance_frame();
    change = std::max(change, std::abs(energy(world) - start) / moving);
  }
  return change;
}

// With all of a contact's impulse at the end of the step, the bodies of size 1 lose two thirds of their
// energy in the default steps.
TEST(EverydayRigidRocking, OnRoundBodiesKeepsItsEnergy) {
  for (const Rocker& rocker : rockers())
    for (const double size : {0.01, 1.0, 30.0})
      for (const double step : {0.0, 0.005})
        test::expect_below(change_while_rocking(rocker, size, step), step > 0 ? 0.0005 : 0.01,
                           fmt::format("{} of size {}, steps of {} s", rocker.name, size, step));
}

// A box or an upright cylinder of the height 1 that tips over an edge.
struct Tipping {
  std::string name;
  scene::Shape shape;
  double half_width = 0;  // m
};

// Returns the largest change of energy of a body that tips over an edge from the angle `degrees` beyond its
// balance, while it leans by less than 41 degrees, relative to its kinetic energy then. Farther on a thin
// pole slips, also with a friction coefficient of 1.
double change_while_tipping(const Tipping& tipping, double degrees, double size, double step) {
  scene::Scene scene = test::on_ground(1);
  scene.fps = 48 / std::sqrt(size);
  scene.gravity = Vec3(0, -9.8, 0);
  if (step > 0) scene.solver.max_time_step = step * std::sqrt(size);
  scene::RigidBody body;
  body.name = "body";
  body.friction = 1;
  body.density = 1000;
  body.shape = test::scaled(tipping.shape, size);
  const double balance = std::atan2(tipping.half_width, 0.5) + degrees * double{EIGEN_PI} / 180;
  body.placement.orientation = Quat(Eigen::AngleAxisd(-balance, Vec3::UnitZ()));
  body.placement.position =
      size * (body.placement.orientation * Vec3(-tipping.half_width, 0.5, 0));  // about the lowest edge
  scene.rigid.push_back(body);
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const std::size_t index = test::index_of_shape(world.bodies);
  const auto up = [&] { return (world.bodies.rigid.state[index].pose.orientation * Vec3::UnitY()).y(); };
  const double start = energy(world);
  double change = 0, moving = 0;
  for (int frame = 0; frame < 96 && up() > 0.75; ++frame) {
    const double before = change;
    simulation.advance_frame();
    if (up() <= 0.75) return before / moving;
    change = std::max(change, std::abs(energy(world) - start));
    moving = kinetic_energy(world.bodies);
  }
  return change / moving;
}

// With all of a contact's impulse at the end of the step, they gain 0.8 to 2 % of their kinetic energy in the
// default steps.
TEST(EverydayRigidRocking, TippingOverAnEdgeKeepsEnergy) {
  const std::vector<Tipping> bodies{
      {"pole", {.kind = ShapeKind::box, .size = Vec3(0.05, 1, 0.05)}, 0.025},
      {"wardrobe", {.kind = ShapeKind::box, .size = Vec3(0.3, 1, 0.5)}, 0.15},
      {"domino", {.kind = ShapeKind::box, .size = Vec3(0.2, 1, 0.5)}, 0.1},
      {"cylinder", {.kind = ShapeKind::cylinder, .radius = 0.15, .length = 1}, 0.15}};
  for (const Tipping& body : bodies)
    for (const double size : {0.01, 1.0, 30.0})
      for (const double step : {0.0, 0.005})
        test::expect_below(change_while_tipping(body, 3, size, step), step > 0 ? 0.001 : 0.005,
                           fmt::format("{} of size {}, steps of {} s", body.name, size, step));
}

}  // namespace
}  // namespace duet::everyday_rigid_rocking_test
