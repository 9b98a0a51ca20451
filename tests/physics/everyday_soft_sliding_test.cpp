// Bodies that slide and roll over a soft body: the lines of its mesh are no obstacles, and its faces drive no
// body on.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/base/rotation.h"
#include "sim/step/world.h"

namespace duet::everyday_soft_sliding_test {
namespace {

constexpr double gravity = 9.8;  // m/s^2

// Returns a slab of 3 x 0.3 x 0.8 sizes. Its lower side is pinned, and the middle of its upper side is at the
// origin.
scene::Scene slab(const Vec3i& cells, double youngs_modulus, double size, double damping = 0.01) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -gravity, 0);
  scene.fps = 24 / std::sqrt(size);
  const Vec3 extent = size * Vec3(3, 0.3, 0.8);
  scene::DeformableBody& body =
      test::add_soft_box(scene, "slab", Vec3(0, -extent.y() / 2, 0), extent, 1, youngs_modulus * size);
  body.shape.cells = cells;
  scene.materials.front().damping = damping * std::sqrt(size);
  for (int k = 0; k <= cells.z(); ++k) {
    const double z = extent.z() * (static_cast<double>(k) / cells.z() - 0.5);
    body.pins.push_back({.from = Vec3(-extent.x() / 2, -extent.y() / 2, z),
                         .to = Vec3(extent.x() / 2, -extent.y() / 2, z),
                         .radius = 1e-3 * size,
                         .body = ""});
  }
  return scene;
}

// Kinds of bodies that slide.
enum class Slider { box, turned_box, disc, mesh_cube, soft_box };

// A body that slides over the slab.
struct Sliding {
  Slider slider = Slider::box;
  double friction = 0;
  Vec3i cells = Vec3i(12, 2, 3);
  double youngs_modulus = 2e6;  // Pa, of the slab, for the size 1
  double speed = 1.5;           // m/s, for the size 1
  double size = 1;
  double shortest = 1;    // longest step over that of the rule
  double damping = 0.01;  // s, of the soft bodies, for the size 1
};

// Adds the sliding body, with its lower side on the slab.
void add_slider(scene::Scene& scene, const Sliding& c) {
  const double s = c.size, thickness = 0.25 * s;
  const Vec3 place(-0.9 * s, thickness / 2, 0.03 * s), velocity(c.speed * std::sqrt(s), 0, 0);
  if (c.slider == Slider::soft_box) {
    const double gap = 0.02 * s;  // about the distance that the two surfaces keep
    scene::DeformableBody& body = test::add_soft_box(scene, "slider", place + Vec3(0, gap, 0),
                                                     Vec3(0.5 * s, thickness, 0.5 * s), 2, 2e6 * s);
    scene.materials.back().damping = c.damping * std::sqrt(s);
    body.placement.velocity = velocity;
    for (scene::DeformableBody& soft : scene.deformable) soft.collision_friction = c.friction;
    return;
  }
  const double mass = 1000 * s * s * s / 16;
  scene::RigidBody& body =
      c.slider == Slider::mesh_cube
          ? test::add_mesh(scene, "slider",
                           std::make_shared<TriangleMesh>(
                               test::box_mesh(s * Vec3(-0.25, -0.125, -0.25), s * Vec3(0.25, 0.125, 0.25))),
                           1, mass)
          : test::add_box(scene, "slider", place, Vec3(0.5 * s, thickness, 0.5 * s), mass);
  if (c.slider == Slider::disc)
    body.shape = {.kind = scene::ShapeKind::cylinder, .radius = 0.25 * s, .length = thickness};
  if (c.slider == Slider::turned_box) body.placement.orientation = exponential(Vec3(0, 0.4, 0));
  body.placement.position = place;
  body.placement.velocity = velocity;
  body.friction = c.friction;
}

// Returns the velocity (m/s) of the sliding body, rigid or soft.
Vec3 velocity_of(const Bodies& bodies) {
  if (!bodies.rigid.state.empty()) return bodies.rigid.state.front().velocity;
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  for_each_particle(bodies.deformable.back(), [&](std::size_t p) {
    momentum += bodies.particles.mass[p] * bodies.particles.v[p];
    mass += bodies.particles.mass[p];
  });
  return momentum / mass;
}

// Returns the deceleration over g after the body has sunk in, minus the friction asked for. Without friction,
// a body loses only what waves in the slab take away.
double added_friction(const Sliding& c) {
  scene::Scene scene = slab(c.cells, c.youngs_modulus, c.size, c.damping);
  add_slider(scene, c);
  if (c.shortest < 1) {
    const Simulation by_rule(scene, test::plan(scene));
    scene.solver.max_time_step = c.shortest * by_rule.sizes().time_step;
  }
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  simulation.advance_frame();
  const Vec3 before = velocity_of(simulation.world().bodies);
  constexpr int frames = 10;
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  const Vec3 change = velocity_of(simulation.world().bodies) - before;
  return -change.x() * scene.fps / (frames * gravity) - c.friction;
}

std::string name_of(const Sliding& c) {
  constexpr const char* sliders[] = {"box", "turned box", "disc", "mesh", "soft box"};
  return fmt::format("{}, mu {}, cells {}, E {:g}, v {}, size {}, steps {}, damping {}",
                     sliders[static_cast<int>(c.slider)], c.friction, c.cells.x(), c.youngs_modulus, c.speed,
                     c.size, c.shortest, c.damping);
}

// Checks that the mesh changes the deceleration by less than `most` g.
void expect_slides(const Sliding& c, double most) {
  test::expect_below(std::abs(added_friction(c)), most, name_of(c));
}

// The deceleration is mu g to 1e-3 g. Edges and vertices of the mesh that catch the lower edges of a body
// would brake it many times as much.
TEST(EverydaySoftSliding, RigidBodiesFeelTheFrictionGiven) {
  test::Cases cases(3);  // 3 of 8
  for (const Slider slider : {Slider::box, Slider::turned_box, Slider::disc, Slider::mesh_cube})
    for (const double friction : {0.0, 0.2})
      if (cases.takes()) expect_slides({slider, friction}, 1e-3);
}

// The mesh, its stiffness, speed, size and step must not matter.
TEST(EverydaySoftSliding, OnAnyMeshAtAnySpeedSizeAndStep) {
  test::Cases cases(2);  // 4 of 7: one of the meshes, sizes, and so on
  const auto look_at = [&](const Sliding& c, double most) {
    if (cases.takes()) expect_slides(c, most);
  };
  look_at({.slider = Slider::turned_box, .cells = Vec3i(7, 1, 2)}, 1e-3);
  look_at({.cells = Vec3i(25, 3, 7)}, 1e-3);
  look_at({.slider = Slider::turned_box, .friction = 0.2, .shortest = 0.25}, 1e-3);
  look_at({.slider = Slider::turned_box, .speed = 3}, 1e-3);
  for (const double size : {0.02, 50.0}) look_at({.slider = Slider::turned_box, .size = size}, 1e-3);
  // On the softest slab the body lies 6 mm deep, and the damped motion that it drives through the slab costs
  // energy.
  look_at({.slider = Slider::turned_box, .youngs_modulus = 2e5}, 3e-3);
}

// The surfaces of two soft bodies keep their distance by repulsions; the bound is a measurement with a
// margin. When the couple of friction at two surfaces took a part of it, 1.5 % of the friction was missing on
// the coarse slab.
TEST(EverydaySoftSliding, SoftOnSoftToo) {
  test::Cases cases(2);  // 4 of 8, with and without friction
  for (const Vec3i& cells : {Vec3i(12, 2, 3), Vec3i(7, 1, 2)})
    for (const double friction : {0.0, 0.1, 0.3, 0.2})
      if (cases.takes())
        expect_slides({.slider = Slider::soft_box, .friction = friction, .cells = cells, .speed = 3}, 3e-3);
}

// With the trapezoidal rule, strongly damped surfaces hopped on each other, and 0.007 of a friction
// coefficient of 0.3 was missing.
TEST(EverydaySoftSliding, DampedSoftOnSoftToo) {
  test::Cases cases(2);  // 3 of 6
  for (const double damping : {0.03, 0.06})
    for (const double friction : {0.3, 0.0, 0.1})
      if (cases.takes())
        expect_slides({.slider = Slider::soft_box, .friction = friction, .speed = 3, .damping = damping},
                      1e-3);
}

// Checks that a body that rolls, or slides without friction, never gets faster: damping takes energy and
// nothing gives any. At its start the body sinks in.
void expect_never_faster(const scene::Shape& shape, double lowest, double friction, const Vec3i& cells,
                         double damping, double shortest) {
  SCOPED_TRACE(fmt::format("shape {}, friction {}, cells {}, damping {}, steps {}",
                           static_cast<int>(shape.kind), friction, cells.x(), damping, shortest));
  scene::Scene scene = slab(cells, 2e6, 1);
  scene.materials.front().damping = damping;
  scene::RigidBody& body = test::add_ball(scene, "body", Vec3(-1, lowest, 0.03), lowest, 1);
  body.shape = shape;
  body.mass.reset();
  body.density = 1000;
  body.friction = friction;
  if (shape.kind != scene::ShapeKind::sphere) body.placement.orientation = exponential(Vec3(M_PI / 2, 0, 0));
  body.placement.velocity = Vec3(1, 0, 0);
  body.placement.angular_velocity = Vec3(0, 0, -1 / lowest);
  if (shortest < 1) {
    const Simulation by_rule(scene, test::plan(scene));
    scene.solver.max_time_step = shortest * by_rule.sizes().time_step;
  }
  Simulation simulation(scene, test::plan(scene));
  const auto energy = [&] {
    const FrameStats stats = simulation.stats();
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double kinetic = simulation.stats().kinetic;
  double least = energy(), rise = 0, fastest = 0;
  for (int frame = 0; frame < 24; ++frame) {
    simulation.advance_frame();
    rise = std::max(rise, energy() - least);
    least = std::min(least, energy());
    const Vec3& v = simulation.world().bodies.rigid.state.front().velocity;
    fastest = std::max(fastest, std::hypot(v.x(), v.z()));
  }
  test::expect_below(rise / kinetic, 1e-3, "rise of the energy, of what moves");
  test::expect_below(fastest, 1.002, "speed, m/s");  // as it springs, it may take that from its spin
}

// A contact normal that tilts forward as a body passes from face to face would drive it on.
TEST(EverydaySoftSliding, WhatRollsGetsNoFaster) {
  const scene::Shape ball{.kind = scene::ShapeKind::sphere, .radius = 0.2};
  const scene::Shape capsule{.kind = scene::ShapeKind::capsule, .radius = 0.15, .length = 0.3};
  const scene::Shape cylinder{.kind = scene::ShapeKind::cylinder, .radius = 0.2, .length = 0.3};
  const Vec3i coarse(12, 2, 3), fine(30, 3, 8);
  test::Cases cases(3);  // 3 of 8: a ball with and without friction, and a cylinder
  const auto look_at = [&](const scene::Shape& shape, double lowest, double friction, const Vec3i& cells,
                           double damping, double shortest) {
    if (cases.takes()) expect_never_faster(shape, lowest, friction, cells, damping, shortest);
  };
  for (const double shortest : {1.0, 0.3})
    for (const double friction : {0.5, 0.0}) look_at(ball, 0.2, friction, coarse, 0.01, shortest);
  look_at(ball, 0.2, 0.5, fine, 0.01, 1);
  look_at(capsule, 0.15, 0.5, coarse, 0.01, 1);
  look_at(cylinder, 0.2, 0.5, coarse, 0.01, 1);
  look_at(ball, 0.2, 0.5, fine, 3e-4, 1);
}

// Returns a light cylinder (300 kg/m^3) that rolls at 1 m/s along a slab of 1e6 Pa on the ground, whose cells
// are half as large as its radius of `radius` (m).
scene::Scene light_cylinder(double radius, double length, double friction, double damping) {
  scene::Scene scene = test::on_ground(friction);
  scene::DeformableBody& slab =
      test::add_soft_box(scene, "slab", Vec3(0, 0.5 * radius, 0), radius * Vec3(20, 1, 2), 1, 1e7 * radius);
  slab.shape.cells = Vec3i(40, 2, 4);
  scene.materials.front().damping = damping;
  scene::RigidBody& body = test::add_ball(scene, "cylinder", radius * Vec3(-8, 2, 0), radius, 1);
  body.shape = {.kind = scene::ShapeKind::cylinder, .radius = radius, .length = length};
  body.mass.reset();
  body.density = 300;
  body.friction = friction;
  body.placement.orientation = exponential(Vec3(M_PI / 2, 0, 0));
  body.placement.velocity = Vec3(1, 0, 0);
  body.placement.angular_velocity = Vec3(0, 0, -1 / radius);
  return scene;
}

// The edges of the slab touch the side of the cylinder at one place, which moves along them as it rolls. As
// places on planes that turn with the cylinder they were pushed out in every step, and gave it 2.7 % of its
// energy in a second; in implicit steps it lost 40 %.
TEST(EverydaySoftSliding, LightCylindersRollOn) {
  test::Cases cases(3);  // 3 of 8
  for (const auto integration : {scene::Integration::semi_implicit, scene::Integration::implicit})
    for (const double length : {0.3, 0.12})
      for (const double friction : {0.5, 0.0}) {
        if (!cases.takes()) continue;
        SCOPED_TRACE(fmt::format("length {}, friction {}, implicit {}", length, friction,
                                 integration == scene::Integration::implicit));
        scene::Scene scene = light_cylinder(0.1, length, friction, 0);
        scene.solver.integration = integration;
        Simulation simulation(scene, test::plan(scene));
        const auto energy = [&] {
          const FrameStats stats = simulation.stats();
          return stats.kinetic + stats.potential + stats.elastic;
        };
        const double kinetic = simulation.stats().kinetic, first = energy();
        double least = first, rise = 0;
        for (int frame = 0; frame < 12; ++frame) {
          simulation.advance_frame();
          rise = std::max(rise, energy() - least);
          least = std::min(least, energy());
        }
        test::expect_below(rise / kinetic, 1e-3, "rise of the energy, of what moves");
        test::expect_below((first - least) / kinetic, 0.03, "loss of the energy, of what moves");
      }
}

// Without friction the normal forces on a round body pass through its axis, so that its spin stays. In
// implicit steps of a tenth of its size, a capsule kept 0.76 of its speed with friction, and gained a fifth
// of its spin without.
TEST(EverydaySoftSliding, WhatRollsInImplicitStepsKeepsItsSpeed) {
  constexpr int frames = 8;
  const scene::Shape shapes[] = {{.kind = scene::ShapeKind::sphere, .radius = 0.1},
                                 {.kind = scene::ShapeKind::capsule, .radius = 0.1, .length = 0.2},
                                 {.kind = scene::ShapeKind::cylinder, .radius = 0.1, .length = 0.3}};
  test::Cases cases(3);  // 4 of 12
  for (const scene::Shape& shape : shapes)
    for (const double friction : {0.5, 0.0})
      for (const double modulus : {1e6, 1e7}) {
        if (!cases.takes()) continue;
        SCOPED_TRACE(
            fmt::format("shape {}, friction {}, {} Pa", static_cast<int>(shape.kind), friction, modulus));
        scene::Scene scene = slab(Vec3i(12, 2, 3), modulus, 1);
        scene.solver.integration = scene::Integration::implicit;
        scene::RigidBody& body = test::add_ball(scene, "body", Vec3(-1, 0.1, 0.03), 0.1, 1);
        body.shape = shape;
        body.mass.reset();
        body.density = 1000;
        body.friction = friction;
        if (shape.kind != scene::ShapeKind::sphere)
          body.placement.orientation = exponential(Vec3(std::numbers::pi / 2, 0, 0));
        body.placement.velocity = Vec3(2, 0, 0);
        body.placement.angular_velocity = Vec3(0, 0, -20);
        Simulation simulation(scene, test::plan(scene));
        for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
        const RigidState& state = simulation.world().bodies.rigid.state.front();
        test::expect_below(std::abs(state.velocity.x() - 2) / 2, 5e-3, "change of the speed, 1");
        test::expect_below(std::abs(state.velocity.z()) / 2, 5e-3, "speed across, 1");
        test::expect_below(std::abs(state.angular_velocity.z() + 20) / 20, 5e-3, "change of the spin, 1");
      }
}

}  // namespace
}  // namespace duet::everyday_soft_sliding_test
