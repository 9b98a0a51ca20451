// Rings on rings, balls and rods: stacks of coaxial rings and of rings that are shifted a little come to
// rest, and rings do not enter what they lie or fall on. Coaxial rings touch all along a circle, and shifted
// ones where they cross, at places that run around the rings as these move.
#include <algorithm>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/contact/detection/max_penetration.h"
#include "sim/step/world.h"

namespace duet::everyday_rigid_rings_test {
namespace {

using scene::ShapeKind;
using test::Support;

constexpr double gravity = 9.8;  // m/s^2

// A ring: a torus with the radius of its center line and that of its tube (m).
struct Ring {
  double radius = 0.15, tube = 0.04;
};
constexpr Ring life_ring{}, tyre{0.22, 0.09}, hoop{0.4, 0.02};

Quat tilted(double degrees, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(degrees * double{EIGEN_PI} / 180, axis.normalized()));
}

scene::RigidBody& add(scene::Scene& scene, const scene::Shape& shape, const Vec3& position,
                      const Quat& orientation = Quat::Identity()) {
  scene::RigidBody body;
  body.name = fmt::format("body{}", scene.rigid.size());
  body.shape = shape;
  body.placement.position = position;
  body.placement.orientation = orientation;
  body.density = 800;
  body.friction = 0.6;
  scene.rigid.push_back(body);
  return scene.rigid.back();
}

scene::RigidBody& add_ring(scene::Scene& scene, const Ring& ring, const Vec3& position,
                           const Quat& orientation = Quat::Identity()) {
  return add(scene, {.kind = ShapeKind::torus, .radius = ring.radius, .tube = ring.tube}, position,
             orientation);
}

scene::Scene scene_on(Support support, double step) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -gravity, 0);
  test::add_support(scene, support, 0.4);
  if (step > 0) scene.solver.max_time_step = step;
  return scene;
}

// What a run shows.
struct Seen {
  double rise = 0;     // J: greatest rise of the energy above an earlier value
  double fall = 0;     // J: by how much the energy is lower at the end
  double overlap = 0;  // m: deepest overlap at the end of a frame
  double kinetic = 0;  // J: kinetic energy at the end
  double weight = 0;   // N: of the lightest dynamic body
  double moved = 0;    // m: displacement of the last body
};

Seen run(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const RigidBodies& rigid = world.bodies.rigid;
  const auto energy = [&] {
    return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
  };
  Seen seen;
  seen.weight = 1e9;
  for (const RigidProperties& properties : rigid.properties)
    if (properties.is_dynamic()) seen.weight = std::min(seen.weight, gravity / properties.inverse_mass);
  const auto last = std::find(rigid.name.begin(), rigid.name.end(), scene.rigid.back().name);
  const auto b = static_cast<std::size_t>(last - rigid.name.begin());
  const Vec3 from = rigid.state[b].pose.position;
  const double start = energy();
  double least = start;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    seen.rise = std::max(seen.rise, energy() - least);
    least = std::min(least, energy());
    seen.overlap = std::max(seen.overlap, max_penetration(world.bodies, world.contact_filter()));
  }
  seen.fall = start - energy();
  seen.kinetic = kinetic_energy(world.bodies);
  seen.moved = (rigid.state[b].pose.position - from).norm();
  return seen;
}

// Adds a stack whose every second ring is shifted by `shift` (m), in a direction of `degrees` to the axis x.
void add_stack(scene::Scene& scene, const Ring& ring, int count, double shift, double degrees) {
  const Vec3 along = tilted(degrees, Vec3::UnitY()) * Vec3::UnitX();
  for (int i = 0; i < count; ++i)
    add_ring(scene, ring, shift * (i % 2) * along + Vec3(0, (2 * i + 1) * ring.tube, 0));
}

// Three rings sank into each other by a third of their tube, and four tyres gained 18 J.
TEST(EverydayRigidRings, StackedCoaxiallyRest) {
  double rise = 0, overlap = 0, kinetic = 0;
  test::Cases cases(2);  // 13 of 27
  for (const Ring& ring : {life_ring, tyre, hoop})
    for (const int count : {2, 3, 8})
      for (const double step : {0.0, 1e-3, 0.04}) {
        if (!cases.takes()) continue;
        SCOPED_TRACE(fmt::format("{} rings of {} m, steps of {} s", count, ring.radius, step));
        scene::Scene scene = scene_on(Support::ground, step);
        add_stack(scene, ring, count, 0, 0);
        const Seen seen = run(scene, 48);
        const double scale = seen.weight * ring.tube;
        EXPECT_LT(seen.rise, 1e-3 * scale);
        EXPECT_LT(seen.overlap, 1e-4 * ring.tube);
        EXPECT_LT(seen.kinetic, 1e-6 * scale);
        rise = std::max(rise, seen.rise / scale);
        overlap = std::max(overlap, seen.overlap / ring.tube);
        kinetic = std::max(kinetic, seen.kinetic / scale);
      }
  test::expect_below(rise, 1e-3, "rise of the energy over weight times tube");
  test::expect_below(overlap, 1e-4, "overlap over tube");
  test::expect_below(kinetic, 1e-6, "kinetic energy at the end over weight times tube");
}

// Rings that are shifted by `shift` cross at two places. A stack of eight collapsed, and two rings rocked
// without end.
TEST(EverydayRigidRings, StackedAskewStand) {
  double rise = 0, overlap = 0, kinetic = 0, moved = 0;
  test::Cases cases(13);  // 15 of 192
  for (const double degrees : {0.0, 25.0})
    for (const Ring& ring : {life_ring, tyre})
      for (const int count : {2, 3, 4, 8})
        for (const double shift : {0.02, 0.1, 0.25, 0.5})  // over the tube
          for (const double step : {0.0, 4e-3, 0.04}) {
            if (!cases.takes()) continue;
            const Support support = count % 2 == 0 ? Support::ground : Support::kinematic_box;
            SCOPED_TRACE(fmt::format("{} rings of {} m on {}, shifted by {} tubes at {}, steps of {} s",
                                     count, ring.radius, test::name_of(support), shift, degrees, step));
            scene::Scene scene = scene_on(support, step);
            add_stack(scene, ring, count, shift * ring.tube, degrees);
            const Seen seen = run(scene, 96);
            const double scale = seen.weight * ring.tube;
            EXPECT_LT(seen.rise, 2e-3 * scale);
            EXPECT_LT(seen.overlap, 2e-4 * ring.tube);
            EXPECT_LT(seen.kinetic, 1e-3 * scale);
            EXPECT_LT(seen.moved, 0.1 * ring.tube);
            rise = std::max(rise, seen.rise / scale);
            overlap = std::max(overlap, seen.overlap / ring.tube);
            kinetic = std::max(kinetic, seen.kinetic / scale);
            moved = std::max(moved, seen.moved / ring.tube);
          }
  test::expect_below(rise, 2e-3, "rise of the energy over weight times tube");
  test::expect_below(overlap, 2e-4, "overlap over tube");
  test::expect_below(kinetic, 1e-3, "kinetic energy at the end over weight times tube");
  test::expect_below(moved, 0.1, "displacement of the top over tube");
}

// Rings of other radii fall onto a ring, level or tilted, shifted, elastic or not. The energy of the fall is
// that which is lost in the end.
TEST(EverydayRigidRings, ComeToRestAfterAFall) {
  double rise = 0, overlap = 0, kinetic = 0;
  test::Cases cases(5);  // 14 of 72
  for (const bool is_held : {false, true})
    for (const double size : {0.8, 1.0, 1.3})  // of the rings that fall, over the lower one
      for (const double shift : {0.0, 0.01, 0.1})
        for (const double degrees : {0.0, 20.0})
          for (const double restitution : {0.0, 0.4}) {
            if (!cases.takes()) continue;
            SCOPED_TRACE(fmt::format("{} {}, shifted by {} m, tilted by {}, restitution {}", size,
                                     is_held ? "on a held ring" : "on a ring", shift, degrees, restitution));
            scene::Scene scene = scene_on(Support::ground, 0);
            scene::RigidBody& lower = add_ring(scene, life_ring, Vec3(0, life_ring.tube, 0));
            lower.is_static = is_held;
            if (is_held) lower.density.reset();
            lower.restitution = restitution;
            for (int i = 0; i < 2; ++i)
              add_ring(scene, {size * life_ring.radius, life_ring.tube},
                       Vec3(shift, 0.25 + 0.25 * i, shift / 3), tilted(degrees, Vec3(1, 0, 0.3)))
                  .restitution = restitution;
            const Seen seen = run(scene, 120);
            EXPECT_LT(seen.rise, 5e-3 * seen.fall);
            EXPECT_LT(seen.overlap, 5e-4 * life_ring.tube);
            EXPECT_LT(seen.kinetic, 1e-2 * seen.fall);
            rise = std::max(rise, seen.rise / seen.fall);
            overlap = std::max(overlap, seen.overlap / life_ring.tube);
            kinetic = std::max(kinetic, seen.kinetic / seen.fall);
          }
  test::expect_below(rise, 5e-3, "rise of the energy over that of the fall");
  test::expect_below(overlap, 5e-4, "overlap over tube");
  test::expect_below(kinetic, 1e-2, "kinetic energy at the end over that of the fall");
}

// A ball and the cap of a rod sit in a ring, and a ring on a held ball; all touch along a circle. A rod lies
// across a ring and a ring across a held rod; they touch at two places. A ball in a ring needed 64 steps
// a frame.
TEST(EverydayRigidRings, RestOnBallsAndRods) {
  const scene::Shape ball{.kind = ShapeKind::sphere, .radius = 0.2},
      rod{.kind = ShapeKind::capsule, .radius = 0.05, .length = 0.5},
      thick_rod{.kind = ShapeKind::capsule, .radius = 0.2, .length = 0.3};
  const double t = life_ring.tube, above = std::sqrt(0.24 * 0.24 - 0.15 * 0.15);  // m
  double rise = 0, overlap = 0, kinetic = 0;
  for (int kind = 0; kind < 5; ++kind)
    for (const double step : {0.0, 2e-3}) {
      SCOPED_TRACE(fmt::format("kind {}, steps of {} s", kind, step));
      scene::Scene scene = scene_on(Support::ground, step);
      const auto hold = [](scene::RigidBody& body) {
        body.is_static = true;
        body.density.reset();
      };
      if (kind < 3) add_ring(scene, life_ring, Vec3(0, t, 0));
      if (kind == 0) add(scene, ball, Vec3(0, t + above, 0));
      if (kind == 1) hold(scene.rigid.back()), add(scene, thick_rod, Vec3(0, t + above + 0.15, 0));
      if (kind == 2) add(scene, rod, Vec3(0, 2 * t + 0.05, 0.01), tilted(90, Vec3::UnitX()));
      if (kind == 3) hold(add(scene, ball, Vec3(0, 0.2, 0)));
      if (kind == 3) add_ring(scene, life_ring, Vec3(0, 0.2 + above, 0));
      if (kind == 4) hold(add(scene, rod, Vec3(0, 0.05, 0), tilted(90, Vec3::UnitX())));
      if (kind == 4) add_ring(scene, life_ring, Vec3(0, 0.1 + t, 0));
      const Seen seen = run(scene, 48);
      const double scale = seen.weight * t;
      EXPECT_LT(seen.rise, 1e-3 * scale);
      EXPECT_LT(seen.overlap, 1e-4 * t);
      EXPECT_LT(seen.kinetic, 1e-3 * scale);
      rise = std::max(rise, seen.rise / scale);
      overlap = std::max(overlap, seen.overlap / t);
      kinetic = std::max(kinetic, seen.kinetic / scale);
    }
  test::expect_below(rise, 1e-3, "rise of the energy over weight times tube");
  test::expect_below(overlap, 1e-4, "overlap over tube");
  test::expect_below(kinetic, 1e-3, "kinetic energy at the end over weight times tube");
}

// A ball meets a free ring in its middle, without gravity and friction. The two part with the restitution
// times the speed of their approach along the axis, and neither turns.
TEST(EverydayRigidRings, PartFromABallAsTheRestitutionSays) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    scene::Scene scene = test::free_space();
    add_ring(scene, life_ring, Vec3::Zero());
    add(scene, {.kind = ShapeKind::sphere, .radius = 0.2}, Vec3(0, 0.3, 0)).placement.velocity =
        Vec3(0, -1, 0);
    for (scene::RigidBody& body : scene.rigid) {
      body.friction = 0;
      body.restitution = restitution;
    }
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
    const std::vector<RigidState>& state = simulation.world().bodies.rigid.state;
    const double apart = state[1].velocity.y() - state[0].velocity.y();
    test::expect_below(std::abs(apart - restitution), 1e-6, "speed of parting, off by, m/s");
    test::expect_below(state[0].angular_velocity.norm(), 1e-6, "angular velocity of the ring, rad/s");
  }
}

}  // namespace
// A can stands on a ring of its own radius: its rim lies all along the crest of the tube. When rounding
// decided which places of the crest are below the end of the can, one of 500 times the ring's mass was
// thrown.
TEST(EverydayRigidRings, BearCansOfTheirRadius) {
  for (const double radius : {0.02, 0.2, 2.0})
    for (const double part : {0.9999, 1.0, 1.0001})
      for (const double ratio : {1.0, 50.0, 500.0})
        for (const double step : {0.0, 1e-3}) {
          const double tube = radius / 10;
          scene::Scene scene = scene_on(Support::ground, step * std::sqrt(radius / 0.2));
          scene::RigidBody& ring = add_ring(scene, {radius, tube}, Vec3(0, tube, 0));
          ring.density.reset();
          ring.mass = 1;
          scene::RigidBody& can =
              add(scene, {.kind = ShapeKind::cylinder, .radius = part * radius, .length = radius},
                  Vec3(0, 2 * tube + radius / 2, 0));
          can.density.reset();
          can.mass = ratio;
          scene.fps = 24 * std::sqrt(0.2 / radius);
          Simulation simulation(scene, test::plan(scene));
          const auto energy = [&] { return simulation.stats().kinetic + simulation.stats().potential; };
          const double first = energy();
          double gain = 0, loss = 0;
          for (int frame = 0; frame < 12; ++frame) {
            simulation.advance_frame();
            gain = std::max(gain, energy() - first);
            loss = std::max(loss, first - energy());
          }
          const double scale = (1 + ratio) * gravity * radius;
          const std::string what =
              fmt::format("radius {} m, can of {} of it and {} kg, steps of {} s", radius, part, ratio, step);
          test::expect_below(gain / scale, 1e-4, "gain: " + what);
          test::expect_below(loss / scale, 1e-4, "sunk: " + what);
        }
}

}  // namespace duet::everyday_rigid_rings_test
