// Bodies that overlap at the start: overlaps of all kinds of bodies are found with their depth, and separated
// without adding energy.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/step/step.h"

namespace duet::everyday_soft_overlap_test {
namespace {

// Bodies that overlap a host at the start.
enum class Guest { soft_box, soft_ball, cloth, rope, particle, rigid_box, rigid_ball };
// Bodies that a guest is inside of.
enum class Host { ground, static_box, static_mesh, kinematic_box, light_box, heavy_ball, soft_box };

constexpr double half = 0.5;  // Distance from a host's center to its top, over the size.

const char* name_of(Guest guest) {
  constexpr const char* names[] = {"soft box", "soft ball", "cloth",     "rope",
                                   "particle", "rigid box", "rigid ball"};
  return names[static_cast<std::size_t>(guest)];
}
const char* name_of(Host host) {
  constexpr const char* names[] = {"ground",    "static box", "static mesh", "kinematic box",
                                   "light box", "heavy ball", "soft box"};
  return names[static_cast<std::size_t>(host)];
}

// Adds a ball of tetrahedra.
scene::DeformableBody& add_soft_ball(scene::Scene& scene, std::string_view name, const Vec3& position,
                                     double radius, double youngs_modulus) {
  scene::DeformableBody& ball = test::add_soft_box(scene, name, position, Vec3::Ones(), 1, youngs_modulus);
  ball.shape.kind = scene::DeformableKind::sphere;
  ball.shape.surface.kind = scene::ShapeKind::sphere;
  ball.shape.surface.radius = radius;
  ball.shape.spacing = radius / 2;
  return ball;
}

// Adds a host whose top, a face or a pole, is at the origin.
void add_host(scene::Scene& scene, Host host, double size, double youngs_modulus) {
  const Vec3 middle(0, -half * size, 0), extent = Vec3::Constant(size);
  const double mass = 1000 * size * size * size;
  switch (host) {
    case Host::ground:
      scene.ground = scene::Ground{.look = {}};
      return;
    case Host::static_mesh: {
      auto mesh = std::make_shared<TriangleMesh>(test::box_mesh(-extent / 2, extent / 2));
      scene::RigidBody& box = test::add_mesh(scene, "host", mesh, 1, 1);
      box.placement.position = middle;
      box.is_static = true;
      box.mass.reset();
      return;
    }
    case Host::heavy_ball:
      test::add_ball(scene, "host", middle, half * size, 100 * mass);
      return;
    case Host::soft_box:
      test::add_soft_box(scene, "host", middle, extent, 3, youngs_modulus);
      return;
    default:
      break;
  }
  scene::RigidBody& box = test::add_box(scene, "host", middle, extent, mass / 100);
  box.is_static = host == Host::static_box;
  box.is_kinematic = host == Host::kinematic_box;
  if (host != Host::light_box) box.mass.reset();
}

// Adds a guest of half the host's size, flat or a ball, whose lowest point is `depth` (m) below the host's
// top.
void add_guest(scene::Scene& scene, Guest guest, double size, double depth, double youngs_modulus) {
  const double extent = size / 2, mass = 1000 * extent * extent * extent;
  const Vec3 middle(0.05 * size, extent / 2 - depth, 0.03 * size), thin = middle - Vec3(0, extent / 2, 0);
  const double thickness = 0.05 * extent;
  const auto pass = [&](scene::DeformableBody& body) {
    body.placement.position += Vec3(0, thickness / 2, 0);
    scene.materials.back().youngs_modulus = youngs_modulus;
  };
  switch (guest) {
    case Guest::soft_box:
      test::add_soft_box(scene, "guest", middle, Vec3::Constant(extent), 3, youngs_modulus);
      return;
    case Guest::soft_ball:
      add_soft_ball(scene, "guest", middle, extent / 2, youngs_modulus);
      return;
    case Guest::cloth:
      test::add_material(scene, "thin");
      pass(test::add_panel(scene, "guest", thin, Vec2(extent, extent), 4, thickness));
      return;
    case Guest::rope:
      test::add_material(scene, "thin");
      pass(test::add_rope(scene, "guest",
                          {thin - Vec3(extent / 2, 0, 0), thin, thin + Vec3(extent / 2, 0, 0)}, 6,
                          thickness));
      return;
    case Guest::particle: {
      scene::DeformableBody& body = test::add_soft_box(scene, "guest", middle, Vec3::Ones(), 1);
      body.shape.kind = scene::DeformableKind::particle;
      body.shape.radius = extent / 2;
      return;
    }
    case Guest::rigid_box:
      test::add_box(scene, "guest", middle, Vec3::Constant(extent), mass);
      return;
    case Guest::rigid_ball:
      test::add_ball(scene, "guest", middle, extent / 2, mass);
      return;
  }
}

// A guest in a host.
struct Case {
  Guest guest;
  Host host;
  double size = 1;              // m
  double depth = 0.1;           // over the size
  double youngs_modulus = 1e6;  // Pa
};

std::string text_of(const Case& c) {
  return fmt::format("{} in {}, size {}, depth {}, {} Pa", name_of(c.guest), name_of(c.host), c.size, c.depth,
                     c.youngs_modulus);
}

// Returns the scene of a case, with frames as long as a few passages of a wave through the body.
scene::Scene scene_of(const Case& c) {
  scene::Scene scene = test::free_space();
  add_host(scene, c.host, c.size, c.youngs_modulus);
  add_guest(scene, c.guest, c.size, c.depth * c.size, c.youngs_modulus);
  scene.fps = 100 * std::sqrt(c.youngs_modulus / 1e6) / c.size;
  scene.solver.max_time_step = 1 / scene.fps;
  return scene;
}

// Returns whether contact between the two exists: particles do not touch soft bodies.
bool may_touch(const Case& c) { return !(c.guest == Guest::particle && c.host == Host::soft_box); }

// Returns the center of mass (m) of all particles and bodies.
Vec3 center_of_mass(const Bodies& bodies) {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
    sum += bodies.particles.mass[p] * bodies.particles.x[p];
    mass += bodies.particles.mass[p];
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    sum += bodies.rigid.properties[i].mass * bodies.rigid.state[i].pose.position;
    mass += bodies.rigid.properties[i].mass;
  }
  return sum / mass;
}

// Checks that initial overlaps are removed by moving whole bodies. The only deformation is what contact makes
// of the gap that rounding leaves, so the energy stays below 1e-6 E size^3, and the center of mass of free
// bodies stays.
void expect_parted(const Case& c) {
  SCOPED_TRACE(text_of(c));
  const scene::Scene scene = scene_of(c);
  Simulation simulation(scene, test::plan(scene));
  ASSERT_EQ(simulation.initial_overlaps().size(), 1U);
  const InitialOverlap& overlap = simulation.initial_overlaps().front();
  // The tetrahedra of a ball cut off a fraction of their size from it, and beside the pole of a ball the
  // surface falls away, so round bodies have a wider bound.
  const bool is_round = c.guest == Guest::soft_ball || c.host == Host::heavy_ball;
  EXPECT_NEAR(overlap.depth, c.depth * c.size, (is_round ? 0.02 : 1e-4) * c.size);
  EXPECT_EQ(overlap.left, 0);
  EXPECT_GE(simulation.stats().max_penetration, 0.95 * overlap.depth);
  const bool free = c.host == Host::light_box || c.host == Host::heavy_ball || c.host == Host::soft_box;
  const Vec3 center = center_of_mass(simulation.world().bodies);
  const double stored = c.youngs_modulus * c.size * c.size * c.size;
  for (int frame = 1; frame <= 2; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    EXPECT_LE(stats.substeps, 200) << frame;
    test::expect_below(stats.max_penetration, 2e-3 * c.size, "penetration, m");
    test::expect_below((stats.kinetic + stats.elastic) / stored, 1e-6, "energy over E size^3");
  }
  if (free)
    test::expect_below((center_of_mass(simulation.world().bodies) - center).norm() / c.size, 1e-6, "center");
}

// A kind of body that is left out of the search stays overlapped, and contact then throws it.
TEST(EverydaySoftOverlap, AllKindsArePartedWithoutEnergy) {
  test::Cases cases(3);
  for (const Guest guest : {Guest::soft_box, Guest::soft_ball, Guest::cloth, Guest::rope, Guest::particle,
                            Guest::rigid_box, Guest::rigid_ball})
    for (const Host host : {Host::ground, Host::static_box, Host::static_mesh, Host::kinematic_box,
                            Host::light_box, Host::heavy_ball, Host::soft_box})
      if (const Case c{guest, host}; may_touch(c) && cases.takes()) expect_parted(c);
}

// Neither depth, stiffness nor size may matter; absolute lengths in the search would show at the ends of the
// range.
TEST(EverydaySoftOverlap, OfAnyDepthStiffnessAndSizeAsWell) {
  test::Cases cases(5);  // 6 of 27
  for (const double depth : {0.002, 0.02, 0.2})
    for (const double youngs_modulus : {1e3, 1e6, 1e9})
      for (const double size : {0.01, 1.0, 100.0})
        if (cases.takes()) expect_parted({Guest::soft_ball, Host::static_box, size, depth, youngs_modulus});
}

// A body that lies completely inside another leaves in the exit direction with the shortest path: here
// upwards, by 1 - 0.3 + 0.25 m.
TEST(EverydaySoftOverlap, BodiesInsideOthersLeaveByTheShortestPath) {
  for (const bool soft_inside : {true, false}) {
    scene::Scene scene = test::free_space();
    const Vec3 off(0.1, 0.3, -0.2);
    if (soft_inside) {
      scene::RigidBody& block = test::add_box(scene, "block", Vec3::Zero(), Vec3(2, 2, 2), 1);
      block.is_static = true;
      block.mass.reset();
      add_soft_ball(scene, "ball", off, 0.25, 1e5);
    } else {
      scene::DeformableBody& block = test::add_soft_box(scene, "block", Vec3::Zero(), Vec3(2, 2, 2), 2, 1e5);
      block.pins = {{.from = Vec3(-1, -1, -1), .to = {}, .radius = 0.1, .body = {}}};
      test::add_ball(scene, "ball", off, 0.25, 10);
    }
    Simulation simulation(scene, test::plan(scene));
    ASSERT_EQ(simulation.initial_overlaps().size(), 1U);
    const InitialOverlap& overlap = simulation.initial_overlaps().front();
    const Vec3 way = overlap.first == "ball" ? overlap.first_moves : overlap.second_moves;
    EXPECT_NEAR(way.y(), 1 - 0.3 + 0.25, 0.01) << soft_inside;
    EXPECT_NEAR(way.norm(), way.y(), 1e-3) << soft_inside;
    simulation.advance_frame();
    EXPECT_LT(simulation.stats().kinetic + simulation.stats().elastic, 1e-3);
  }
}

// Overlapping bodies in a pile are separated together, with all overlaps gone at once and no energy added.
TEST(EverydaySoftOverlap, PilesArePartedTogether) {
  scene::Scene scene = test::on_ground();
  scene.gravity.setZero();
  for (int i = 0; i < 3; ++i) {
    if (i % 2 == 0)
      test::add_soft_box(scene, fmt::format("soft{}", i), Vec3(0.01 * i, 0.45 + 0.9 * i, 0), Vec3::Ones(), 2);
    else
      test::add_box(scene, fmt::format("rigid{}", i), Vec3(0.01 * i, 0.45 + 0.9 * i, 0), Vec3::Ones(), 100);
  }
  Simulation simulation(scene, test::plan(scene));
  EXPECT_EQ(simulation.initial_overlaps().size(), 3U);
  for (const InitialOverlap& overlap : simulation.initial_overlaps()) EXPECT_EQ(overlap.left, 0);
  simulation.advance_frame();
  EXPECT_LT(simulation.stats().max_penetration, 1e-3);
  EXPECT_LT(simulation.stats().kinetic + simulation.stats().elastic, 1e-3);
}

// Bodies that joints and attachments connect move as one: they do not count as overlapping each other, and
// they keep their arrangement.
TEST(EverydaySoftOverlap, JointsAndAttachmentsMoveTogether) {
  scene::Scene scene = test::on_ground();
  scene.gravity.setZero();
  test::add_box(scene, "bone0", Vec3(-0.2, 0.1, 0), Vec3(0.5, 0.1, 0.1), 1);
  test::add_box(scene, "bone1", Vec3(0.2, 0.1, 0), Vec3(0.5, 0.1, 0.1), 1);
  scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3(0, 0.1, 0), Vec3(1.2, 0.4, 0.4), 6);
  flesh.attach = {"bone0", "bone1"};
  test::add_joint(scene, scene::JointType::weld, "bone0", "bone1", Vec3(0, 0.1, 0));
  Simulation simulation(scene, test::plan(scene));
  ASSERT_EQ(simulation.initial_overlaps().size(), 1U);  // of the flesh and the ground
  EXPECT_NEAR(simulation.initial_overlaps().front().depth, 0.1, 1e-9);
  const Bodies& bodies = simulation.world().bodies;
  simulation.advance_frame();
  EXPECT_NEAR(bodies.rigid.state[0].pose.position.y(), 0.2, 1e-3);
  EXPECT_NEAR(bodies.rigid.state[1].pose.position.y(), 0.2, 1e-3);
  EXPECT_LT(simulation.stats().kinetic + simulation.stats().elastic, 1e-3);
}

// With `OverlapPolicy::refuse` the scene is an error that names the body and the depth.
TEST(EverydaySoftOverlap, IsRefusedIfTheSceneSaysSo) {
  for (const Guest guest : {Guest::soft_box, Guest::cloth, Guest::rigid_ball})
    for (const Host host : {Host::ground, Host::light_box, Host::soft_box}) {
      scene::Scene scene = scene_of({guest, host});
      scene.solver.initial_overlap = scene::OverlapPolicy::refuse;
      try {
        const Simulation simulation(scene, test::plan(scene));
        FAIL() << name_of(guest) << " in " << name_of(host);
      } catch (const SceneError& error) {
        EXPECT_EQ(error.status(), ExitStatus::usage);
        ASSERT_EQ(error.problems().size(), 1U);
        const std::string text = error.problems().front().text();
        EXPECT_NE(text.find("`guest`"), std::string::npos) << text;
        EXPECT_NE(text.find("overlap by 0.1 m"), std::string::npos) << text;
      }
    }
}

// No displacement frees a ball between two walls that are too close. The ball deforms, slowly enough for the
// energy to exceed that of the final state by at most a tenth.
TEST(EverydaySoftOverlap, WhatMustDeformGainsTheEnergyOfThat) {
  for (const double youngs_modulus : {1e4, 1e6, 1e8})
    for (const double depth : {0.02, 0.1}) {
      SCOPED_TRACE(fmt::format("{} Pa, depth {}", youngs_modulus, depth));
      scene::Scene scene = test::free_space();
      for (const double side : {-1.0, 1.0}) {
        scene::RigidBody& wall = test::add_box(scene, fmt::format("wall{}", side),
                                               Vec3(0, side * (1 - depth), 0), Vec3(2, 1, 2), 1);
        wall.is_static = true;
        wall.mass.reset();
        wall.friction = 0;
      }
      add_soft_ball(scene, "ball", Vec3::Zero(), 0.5, youngs_modulus);
      // The damping time is a fraction of the time that a wave takes through the ball.
      scene.materials.back().damping = 0.1 / std::sqrt(youngs_modulus / 1000);
      scene.fps = 24 * std::sqrt(youngs_modulus / 1e4);
      Simulation simulation(scene, test::plan(scene));
      EXPECT_EQ(simulation.initial_overlaps().size(), 2U);
      double most = 0;
      for (int frame = 0; frame < 24; ++frame) {
        simulation.advance_frame();
        most = std::max(most, simulation.stats().kinetic + simulation.stats().elastic);
      }
      EXPECT_LT(simulation.stats().max_penetration, 0.002);
      EXPECT_LT(simulation.stats().kinetic, 0.02 * simulation.stats().elastic);
      test::expect_below(most / simulation.stats().elastic, 1.1, "most energy over that at rest");
    }
}

}  // namespace
}  // namespace duet::everyday_soft_overlap_test
