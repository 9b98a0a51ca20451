// Deformable bodies that enclose others and overlap them slightly at the start stay around them and deform,
// and copies of bodies in one place are parted.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::everyday_soft_enclosing_test {
namespace {

// Pairs of a rigid and a deformable body of which one encloses the other.
enum class Pair { rope_over_bar, rope_around_post, soft_ring_around_rod, soft_rod_in_ring };

constexpr double inner_radius = 0.2;  // of the enclosed body, over the size

const char* name_of(Pair pair) {
  constexpr const char* names[] = {"rope over bar", "rope around post", "soft ring around rod",
                                   "soft rod in ring"};
  return names[static_cast<std::size_t>(pair)];
}

// A pair whose enclosing body is too tight.
struct Case {
  Pair pair;
  bool is_static;    // whether the rigid body is static
  double tightness;  // over the size
  double size = 1;   // m
};

std::string text_of(const Case& c) {
  return fmt::format("{}, {}, tightness {}, size {}", name_of(c.pair), c.is_static ? "static" : "free",
                     c.tightness, c.size);
}

// Adds the rigid cylinder or torus of a case.
void add_rigid(scene::Scene& scene, const Case& c) {
  scene::RigidBody& body =
      test::add_box(scene, "rigid", Vec3::Zero(), Vec3::Ones(), 100 * std::pow(c.size, 3));
  body.is_static = c.is_static;
  if (c.is_static) body.mass.reset();
  body.friction = 0;
  if (c.pair == Pair::soft_rod_in_ring) {
    body.shape.kind = scene::ShapeKind::torus;
    body.shape.radius = (inner_radius + 0.1) * c.size;
    body.shape.tube = 0.1 * c.size;
    return;
  }
  body.shape.kind = scene::ShapeKind::cylinder;
  body.shape.radius = inner_radius * c.size;
  body.shape.length = 1.5 * c.size;
  if (c.pair == Pair::soft_ring_around_rod) body.shape.radius += c.tightness * c.size;
  if (c.pair == Pair::rope_over_bar)
    body.placement.orientation = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
}

// Adds the rope of a case, whose middle line is bent to `radius` (m).
void add_rope(scene::Scene& scene, const Case& c, double radius, double thickness) {
  std::vector<Vec3> points = {Vec3(-radius, -c.size, 0)};
  if (c.pair == Pair::rope_over_bar) {
    for (int i = 0; i <= 16; ++i) {
      const double angle = std::numbers::pi * i / 16;
      points.emplace_back(-radius * std::cos(angle), radius * std::sin(angle), 0);
    }
    points.emplace_back(radius, -c.size, 0);
  }
  scene::DeformableBody& rope = test::add_rope(scene, "soft", points, 100, thickness);
  rope.self_collision = false;
  if (c.pair == Pair::rope_over_bar) return;
  rope.shape.kind = scene::DeformableKind::helix;
  rope.shape.points.clear();
  rope.shape.radius = radius;
  rope.shape.pitch = 0.05 * c.size;
  rope.shape.turns = 4;
  rope.shape.segments = 128;
}

// Adds the deformable body of a case.
void add_soft(scene::Scene& scene, const Case& c) {
  const double thickness = 0.02 * c.size;
  switch (c.pair) {
    case Pair::rope_over_bar:
    case Pair::rope_around_post:
      test::add_material(scene, "thin").youngs_modulus = 1e7;
      add_rope(scene, c, (inner_radius - c.tightness) * c.size + thickness / 2, thickness);
      break;
    case Pair::soft_ring_around_rod:
    case Pair::soft_rod_in_ring: {
      scene::DeformableBody& body = test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3::Ones(), 1, 1e6);
      const bool is_ring = c.pair == Pair::soft_ring_around_rod;
      body.shape.kind = is_ring ? scene::DeformableKind::torus : scene::DeformableKind::cylinder;
      body.shape.surface.kind = is_ring ? scene::ShapeKind::torus : scene::ShapeKind::cylinder;
      body.shape.surface.radius = (is_ring ? inner_radius + 0.1 : inner_radius + c.tightness) * c.size;
      body.shape.surface.tube = 0.1 * c.size;
      body.shape.surface.length = c.size;
      body.shape.spacing = 0.07 * c.size;
      break;
    }
  }
  scene.materials.back().damping = 1e-3 * c.size;
}

scene::Scene scene_of(const Case& c) {
  scene::Scene scene = test::free_space();
  add_rigid(scene, c);
  add_soft(scene, c);
  scene.fps = 100 / c.size;
  scene.solver.max_time_step = 1 / scene.fps;
  return scene;
}

// Checks that neither body moves by more than some depths of the overlap, and that the energy stays below
// that of a strain of depth over radius in the whole deformable body.
void expect_opened_in_place(const Case& c) {
  SCOPED_TRACE(text_of(c));
  const scene::Scene scene = scene_of(c);
  Simulation simulation(scene, test::plan(scene));
  ASSERT_EQ(simulation.initial_overlaps().size(), 1U);
  const InitialOverlap& overlap = simulation.initial_overlaps().front();
  const double depth = overlap.depth;
  EXPECT_LE(overlap.first_moves.norm() + overlap.second_moves.norm(), 5 * depth + 1e-3 * c.size);
  const Bodies& bodies = simulation.world().bodies;
  const Vec3 center = test::center_of(bodies, 0), rigid = bodies.rigid.state[0].pose.position;
  const scene::Material& material = scene.materials.back();
  double mass = 0;
  for (const double m : bodies.particles.mass) mass += m;
  const double strain = depth / (inner_radius * c.size);
  const double stored = material.youngs_modulus * mass / material.density * strain * strain;
  for (int frame = 1; frame <= 4; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    test::expect_below((stats.kinetic + stats.elastic) / stored, 0.6, "energy over E V strain^2");
  }
  test::expect_below(simulation.stats().max_penetration / (0.5 * depth + 3e-4 * c.size), 1,
                     "penetration over its bound");
  test::expect_below((test::center_of(bodies, 0) - center).norm() / (depth + 1e-3 * c.size), 5,
                     "displacement of the deformable body over its bound");
  test::expect_below((bodies.rigid.state[0].pose.position - rigid).norm() / (depth + 1e-3 * c.size), 5,
                     "displacement of the rigid body over its bound");
}

// Without the bound on displacements, the rope is moved past the end of the bar, and the ring off the rod.
TEST(EverydaySoftEnclosing, SlightOverlapsAreOpenedInPlace) {
  test::Cases cases(10);
  for (const Pair pair :
       {Pair::rope_over_bar, Pair::rope_around_post, Pair::soft_ring_around_rod, Pair::soft_rod_in_ring})
    for (const bool is_static : {true, false})
      for (const double tightness : {5e-4, 2e-3, 1e-2})
        for (const double size : {0.01, 1.0, 100.0})
          if (cases.takes()) expect_opened_in_place({pair, is_static, tightness, size});
}

// Links of a chain that overlap because it is pulled too far are moved together a little, and stay linked.
// Contact cannot open the overlap of a soft ring that is too tight for a soft rod, so that scene is refused.
TEST(EverydaySoftEnclosing, SoftChainsStayLinkedAndTightSoftRingsAreRefused) {
  const auto add_ring = [](scene::Scene& scene, std::string_view name,
                           double radius) -> scene::DeformableBody& {
    scene::DeformableBody& ring = test::add_soft_box(scene, name, Vec3::Zero(), Vec3::Ones(), 1, 1e6);
    ring.shape.kind = scene::DeformableKind::torus;
    ring.shape.surface.kind = scene::ShapeKind::torus;
    ring.shape.surface.radius = radius;
    ring.shape.surface.tube = 0.1;
    ring.shape.spacing = 0.07;
    return ring;
  };
  scene::Scene chain = test::free_space();
  for (int i = 0; i < 2; ++i) {
    scene::DeformableBody& ring = add_ring(chain, fmt::format("ring{}", i), 0.4);
    ring.placement.position = Vec3(0.602 * i, 0, 0);
    ring.placement.orientation = Quat(Eigen::AngleAxisd(i * std::numbers::pi / 2, Vec3::UnitX()));
  }
  const Simulation linked(chain, test::plan(chain));
  ASSERT_EQ(linked.initial_overlaps().size(), 1U);
  const InitialOverlap& overlap = linked.initial_overlaps().front();
  EXPECT_GT(overlap.depth, 1e-4);
  EXPECT_LE((overlap.first_moves - overlap.second_moves).norm(), 0.03);
  EXPECT_EQ(overlap.left, 0);

  scene::Scene tight = test::free_space();
  add_ring(tight, "ring", 0.3);
  add_soft(tight, {Pair::soft_rod_in_ring, false, 2e-3});
  EXPECT_THROW(Simulation(tight, test::plan(tight)), SceneError);
}

// Between two walls a ball leaves toward the wider side, unless the wedge is so narrow that it would go far.
// Without the bound on displacements, it leaves narrow wedges as well.
TEST(EverydaySoftEnclosing, BallsLeaveWideWedgesAndDeformInNarrowOnes) {
  constexpr double radius = 0.1, depth = 0.002;
  for (const double degrees : {4.0, 30.0}) {
    SCOPED_TRACE(degrees);
    scene::Scene scene = test::free_space();
    for (const double side : {-1.0, 1.0}) {
      const Quat turn(Eigen::AngleAxisd(-side * degrees / 180 * std::numbers::pi, Vec3::UnitZ()));
      const Vec3 outward = turn * Vec3(side, 0, 0);
      scene::RigidBody& wall = test::add_box(scene, fmt::format("wall{}", side),
                                             (0.5 + radius - depth) * outward, Vec3(1, 2, 2), 1);
      wall.placement.orientation = turn;
      wall.is_static = true;
      wall.mass.reset();
      wall.friction = 0;
    }
    scene::DeformableBody& ball = test::add_soft_box(scene, "ball", Vec3::Zero(), Vec3::Ones(), 1, 1e6);
    ball.shape.kind = scene::DeformableKind::sphere;
    ball.shape.surface.kind = scene::ShapeKind::sphere;
    ball.shape.surface.radius = radius;
    ball.shape.spacing = radius / 4;
    Simulation simulation(scene, test::plan(scene));
    ASSERT_GE(simulation.initial_overlaps().size(), 1U);
    const InitialOverlap& overlap = simulation.initial_overlaps().front();
    const double way = overlap.first_moves.norm() + overlap.second_moves.norm();
    if (degrees < 10) {
      EXPECT_LE(way, 2 * depth);
      EXPECT_GT(overlap.left, 0);
    } else {
      EXPECT_GT(way, depth);
      EXPECT_LE(way, 5 * depth);
      EXPECT_EQ(overlap.left, 0);
    }
  }
}

// Bodies in one place.
enum class Copies { soft, rigid, soft_and_rigid };

// Checks that `count` cubes in one place overlap by half of their size, and are parted without energy and
// with their common center of mass in place.
void expect_copies_parted(Copies kind, int count, int cells, double size) {
  SCOPED_TRACE(
      fmt::format("kind {}, {} copies, {} cells, size {}", static_cast<int>(kind), count, cells, size));
  scene::Scene scene = test::free_space();
  for (int i = 0; i < count; ++i) {
    const bool is_rigid = kind == Copies::rigid || (kind == Copies::soft_and_rigid && i % 2 == 0);
    const std::string name = fmt::format("copy{}", i);
    if (is_rigid)
      test::add_box(scene, name, Vec3(0, size, 0), Vec3::Constant(size), 1000 * std::pow(size, 3));
    else
      test::add_soft_box(scene, name, Vec3(0, size, 0), Vec3::Constant(size), cells, 1e6);
  }
  scene.fps = 100 / size;
  scene.solver.max_time_step = 1 / scene.fps;
  Simulation simulation(scene, test::plan(scene));
  ASSERT_EQ(simulation.initial_overlaps().size(), static_cast<std::size_t>(count * (count - 1) / 2));
  for (const InitialOverlap& overlap : simulation.initial_overlaps()) {
    EXPECT_NEAR(overlap.depth, size / 2, 0.01 * size);
    EXPECT_EQ(overlap.left, 0);
    EXPECT_GE((overlap.first_moves - overlap.second_moves).norm(), 0.999 * size);
  }
  simulation.advance_frame();
  const FrameStats stats = simulation.stats();
  test::expect_below((stats.kinetic + stats.elastic) / (1e6 * std::pow(size, 3)), 1e-6,
                     "energy over E size^3");
  test::expect_below(stats.max_penetration / size, 1e-4, "penetration over the size");
  const Bodies& bodies = simulation.world().bodies;
  Vec3 sum = Vec3::Zero();  // kg m, moment of mass about the common center at the start
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    sum += bodies.particles.mass[p] * (bodies.particles.x[p] - Vec3(0, size, 0));
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    sum += bodies.rigid.properties[i].mass * (bodies.rigid.state[i].pose.position - Vec3(0, size, 0));
  test::expect_below(sum.norm() / (1000 * std::pow(size, 4)), 1e-6, "center of mass over the size");
}

// Surfaces that coincide nowhere lie in the other body. Without points inside the bodies the depth is that of
// rounding, and the search tries every direction in steps of it, which takes minutes.
TEST(EverydaySoftEnclosing, CopiesInOnePlaceArePartedSymmetrically) {
  for (const Copies kind : {Copies::soft, Copies::rigid, Copies::soft_and_rigid})
    for (const double size : {0.01, 0.4, 100.0}) {
      expect_copies_parted(kind, 2, 3, size);
      expect_copies_parted(kind, 3, 2, size);
    }
  for (const int cells : {4, 8}) expect_copies_parted(Copies::soft, 2, cells, 0.4);
}

// The depth of two equal cubes, one of them displaced, is the width of their overlap, and at most half of
// their size: points inside one cube are no deeper in the other. It is measured to a cell of the lattice.
TEST(EverydaySoftEnclosing, DepthOfDisplacedCopiesIsTheirOverlap) {
  for (const double offset : {0.0, 0.1, 0.25, 0.5, 0.7, 0.95}) {
    SCOPED_TRACE(offset);
    scene::Scene scene = test::free_space();
    test::add_soft_box(scene, "a", Vec3::Zero(), Vec3::Ones(), 6);
    test::add_soft_box(scene, "b", Vec3(offset, 0, 0), Vec3::Ones(), 6);
    const Simulation simulation(scene, test::plan(scene));
    ASSERT_EQ(simulation.initial_overlaps().size(), 1U);
    const InitialOverlap& overlap = simulation.initial_overlaps().front();
    EXPECT_NEAR(overlap.depth, std::min(1 - offset, 0.5), offset < 0.5 ? 0.1 : 1e-3);
    const double way = (overlap.first_moves - overlap.second_moves).norm();
    EXPECT_NEAR(way, 1 - offset, 0.05);
  }
}

}  // namespace
}  // namespace duet::everyday_soft_enclosing_test
