// Soft bodies that turn in implicit steps as long as a frame, stiff or soft, damped or not, in flight, as
// they land, and as they roll over a rigid body: energy never rises.
#include <algorithm>
#include <cmath>

#include "tests/support/energy.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"

#include "sim/base/rotation.h"
#include "sim/step/world.h"

namespace duet::everyday_soft_thrown_test {
namespace {

using scene::Integration;

constexpr double gravity = 9.8, density = 1000;  // m/s^2, kg/m^3

// A bone and its flesh fall freely side by side, with nothing between them, so the flesh must not be
// strained. In implicit steps the particles inside the bone used to be a step's fall behind it: flesh with a
// damping of 1 s then stored 3 % of the energy of the fall after 0.1 s, and more with short steps than with
// long ones.
TEST(EverydaySoftThrown, ABoneFallsWithItsFlesh) {
  double strain = 0;
  for (const Integration integration : {Integration::implicit, Integration::semi_implicit})
    for (const double size : {0.01, 0.5})
      for (const double damping : {1e-4, 0.02, 1.0}) {
        scene::Scene scene = test::free_space();
        scene.gravity = Vec3(0, -gravity, 0);
        scene.solver.integration = integration;
        scene.fps = 2 / std::sqrt(size / gravity);
        scene.solver.max_time_step = 0.5 / scene.fps;
        scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3::Zero(), Vec3::Constant(size),
                                                          2, 100 * density * gravity * size);
        scene.materials[0].damping = damping;
        flesh.attach = {"bone"};
        test::add_box(scene, "bone", Vec3::Zero(), Vec3::Constant(size / 4), density * std::pow(size / 4, 3));
        Simulation simulation(scene, test::plan(scene));
        for (int frame = 0; frame < 4; ++frame) simulation.advance_frame();
        strain = std::max(strain, simulation.stats().elastic / simulation.stats().kinetic);
      }
  // The residual of the solves, 1e-3 m/s, is at most that fraction of the energy of the fall.
  test::expect_below(strain, 1e-5, "elastic energy over that of the fall");
}

// How a body is thrown.
struct Throw {
  double youngs_modulus = 0;  // over density times gravity times size
  double damping = 0;         // over sqrt(size / gravity), the scale of the time of a fall by the size
  double turn = 0;            // rad in a step
  bool has_bone = false;
  bool is_rod = false;
  bool lands = true;  // on a capsule that rolls on the ground; false: it flies
};

// Returns the thrown body, with implicit steps of half a frame.
scene::Scene thrown(const Throw& how, double size) {
  scene::Scene scene = test::on_ground(0.5);
  if (!how.lands) scene.ground.reset();
  scene.gravity = Vec3(0, -gravity, 0);
  scene.fps = 3 / std::sqrt(size / gravity);
  scene.solver.integration = Integration::implicit;
  scene.solver.max_time_step = 0.5 / scene.fps;
  const Vec3 place(0.15 * size, 2 * size, 0.1 * size);
  scene::DeformableBody& soft = test::add_soft_box(scene, "soft", place, Vec3(0.7, 0.5, 0.6) * size, 2,
                                                   how.youngs_modulus * density * gravity * size);
  scene.materials[0].density = density;
  scene.materials[0].poisson_ratio = 0.3;
  scene.materials[0].damping = how.damping * std::sqrt(size / gravity);
  if (how.is_rod) {
    soft.shape.kind = scene::DeformableKind::rod;
    soft.shape.points = {Vec3(-0.4, 0, 0) * size, Vec3(0.4, 0, 0) * size};
    soft.shape.segments = 5;
    soft.thickness = 0.05 * size;
  }
  soft.placement.orientation = exponential(Vec3(0.3, 0.5, 0.2));
  soft.placement.velocity = Vec3(0.5, -1, 0.2) * std::sqrt(gravity * size);
  soft.placement.angular_velocity = how.turn / scene.solver.max_time_step * Vec3(0.48, 0.6, 0.64);
  if (how.has_bone) {
    soft.attach = {"bone"};
    scene::RigidBody& bone = test::add_box(scene, "bone", place, Vec3::Constant(0.1 * size),
                                           2 * density * std::pow(0.1 * size, 3));
    bone.placement.velocity = scene.deformable[0].placement.velocity;
    bone.placement.angular_velocity = scene.deformable[0].placement.angular_velocity;
  }
  if (!how.lands) return scene;
  scene::RigidBody log;
  log.name = "log";
  log.shape = {.kind = scene::ShapeKind::capsule, .radius = 0.3 * size, .length = size};
  log.density = density;
  log.placement.position = Vec3(0, 0.3 * size, 0);
  log.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  log.friction = 0.5;
  scene.rigid.push_back(log);
  return scene;
}

// The first steps in which a stiff body turns used to stretch it, up to several times the energy of its
// motion, and a damped one grew by a constant factor in every step, to 1e12 J in 20 frames.
TEST(EverydaySoftThrown, LongImplicitStepsGainNoEnergy) {
  constexpr int frames = 12;
  double gain = 0;
  test::Cases cases(7);  // 5 of 32
  const auto look_at = [&](const Throw& how, double size) {
    if (cases.takes()) gain = std::max(gain, test::gain_of(thrown(how, size), frames));
  };
  for (const double damping : {1e-4, 1e-2, 0.3, 10.0})
    for (const double youngs_modulus : {1e2, 1e4, 1e6})
      for (const bool has_bone : {false, true})
        look_at({.youngs_modulus = youngs_modulus, .damping = damping, .turn = 0.2, .has_bone = has_bone},
                has_bone ? 1.0 : 0.03);
  for (const double damping : {1e-4, 0.3, 10.0})
    for (const double turn : {0.03, 0.2})
      look_at({.youngs_modulus = 1e6, .damping = damping, .turn = turn, .has_bone = true, .lands = false},
              0.03);
  for (const double damping : {1e-4, 0.3})
    look_at({.youngs_modulus = 1e4, .damping = damping, .turn = 0.2, .is_rod = true}, 0.03);
  // A step may gain 2e-5 of the kinetic plus elastic energy, and a frame has two steps if none is repeated.
  test::expect_below(gain, 1e-3, "energy gained, over what moves");
}

}  // namespace
}  // namespace duet::everyday_soft_thrown_test
