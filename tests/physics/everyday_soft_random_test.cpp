// Random small scenes of all kinds of bodies: soft volumes of three materials, cloth, rods, particles and
// bones in flesh, among rigid bodies of every shape, static, kinematic, jointed or free, of any size and
// softness, in both integrations. Whatever the scene is, energy never rises, bodies neither sink in nor fall
// through, no number stops being finite, and threads change no bit.
#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/full.h"
#include "tests/support/random_scenes.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/base/index.h"
#include "sim/base/rotation.h"
#include "sim/scene/schema.h"
#include "sim/step/world.h"

namespace duet::everyday_soft_random_test {
namespace {

using test::Draw;

// Returns a random material that is deformed by its own weight by at most 3 %.
scene::Material random_material(Draw& draw, double size, const std::string& name) {
  scene::Material material;
  material.name = name;
  material.density = std::pow(10, draw(2, 3.5));
  material.youngs_modulus = material.density * 9.8 * size * std::pow(10, draw(1.5, 3));
  material.poisson_ratio = draw(0, 0.45);
  material.damping = std::pow(10, draw(-4, -1)) * std::sqrt(size);
  material.model = static_cast<MaterialModel>(draw.below(material_model_count));
  return material;
}

// Returns a random volume, ball, panel, rod or particle of about a third of `size` (m).
scene::DeformableBody random_soft_body(Draw& draw, double size) {
  using scene::DeformableKind;
  scene::DeformableBody body;
  scene::DeformableShape& shape = body.shape;
  const auto edge = [&] { return size * draw(0.2, 0.6); };
  switch (draw.below(8)) {
    default: {
      shape.kind = DeformableKind::box;
      shape.size = Vec3(edge(), edge(), edge());
      shape.cells = Vec3i(1 + draw.below(3), 1 + draw.below(3), 1 + draw.below(3));
      break;
    }
    case 4:
      shape.kind = DeformableKind::sphere;
      shape.surface = {.kind = scene::ShapeKind::sphere, .radius = size * draw(0.2, 0.3)};
      shape.spacing = shape.surface.radius;
      break;
    case 5:
      shape.kind = DeformableKind::panel;
      shape.panel_size = Vec2(edge(), edge());
      shape.panel_cells = Eigen::Vector2i(3 + draw.below(4), 3 + draw.below(4));
      body.thickness = 0.02 * size;
      break;
    case 6: {
      shape.kind = DeformableKind::rod;
      const Vec3 half = edge() / 2 * draw.direction();
      shape.points = {-half, half};
      shape.segments = 4 + draw.below(6);
      body.thickness = 0.04 * size;
      break;
    }
    case 7:
      shape.kind = DeformableKind::particle;
      shape.radius = size * draw(0.05, 0.2);
      break;
  }
  return body;
}

// Returns a random scene and sets its `size` (m). The bodies stand in a column of cells, a size apart, so
// that none overlap; some rigid bodies are jointed to the one below, and some soft ones have a bone.
scene::Scene random_scene(std::uint64_t seed, double& size) {
  Draw draw(seed);
  size = std::pow(10, draw(-1.5, 0.5));
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8, 0);
  using scene::Accuracy;
  constexpr std::array levels{Accuracy::draft, Accuracy::standard, Accuracy::standard, Accuracy::fine};
  scene.solver = scene::preset(levels[as_index(draw.below(4))]);
  if (draw.below(3) == 0) scene.solver.integration = scene::Integration::implicit;
  const double friction = draw(0, 1), restitution = draw.below(3) == 0 ? 0 : draw(0, 1);
  scene.ground = scene::Ground{.friction = friction, .restitution = restitution, .look = {}};
  const int count = 2 + draw.below(4);
  int last_rigid = -1;  // rigid body that the next joint may connect to; -1: none
  for (int i = 0; i < count; ++i) {
    scene::Placement placement;
    placement.position = Vec3(draw(-0.4, 0.4), 0.8 + 1.1 * i, draw(-0.4, 0.4)) * size;
    placement.orientation = exponential(draw(0, 3) * draw.direction());
    placement.velocity = draw(0, 2) * std::sqrt(9.8 * size) * draw.direction();
    placement.angular_velocity = draw(0, 3) / std::sqrt(size) * draw.direction();
    const bool is_soft = draw.below(2) == 0;
    if (is_soft) {
      scene::DeformableBody body = random_soft_body(draw, size);
      body.name = fmt::format("soft{}", i);
      body.placement = placement;
      scene::Material material = random_material(draw, size, "material" + body.name);
      body.material = material.name;
      body.collision_friction = friction;
      body.incompressible = body.shape.is_volume() && draw.below(8) == 0;
      scene.materials.push_back(material);
      if (body.shape.kind == scene::DeformableKind::box && draw.below(4) == 0) {
        body.shape.cells.setConstant(2);  // so that the bone holds the particle in the middle
        scene::RigidBody bone;
        bone.name = fmt::format("bone{}", i);
        bone.shape = {.kind = scene::ShapeKind::box, .size = Vec3::Constant(0.1 * size)};
        bone.density = material.density * draw(1, 3);
        bone.placement = placement;
        scene.rigid.push_back(bone);
        body.attach.push_back(bone.name);
      }
      scene.deformable.push_back(body);
      continue;
    }
    scene::RigidBody body;
    body.name = fmt::format("body{}", i);
    body.shape = test::random_shape(draw, size);
    body.placement = placement;
    body.friction = friction;
    body.restitution = restitution;
    const int kind = draw.below(8);
    if (i == 0 && kind < 2) {
      (kind == 0 ? body.is_static : body.is_kinematic) = true;  // without motion, which would feed energy in
      body.placement.velocity.setZero();
      body.placement.angular_velocity.setZero();
    } else {
      body.density = std::pow(10, draw(2, 4));
    }
    scene.rigid.push_back(body);
    if (last_rigid >= 0 && draw.below(3) == 0) {
      scene.joints.push_back(
          test::random_joint(draw, fmt::format("joint{}", i), scene.rigid[as_index(last_rigid)], body));
    }
    last_rigid = static_cast<int>(scene.rigid.size()) - 1;
  }
  return scene;
}

constexpr int frames = 20;

// The bounds are those of test::keep_promises(), with overlaps of up to 5 % of the size. Of 600 scenes 4
// gained some 0.2 %: rigid bodies and particles that roll, turn and slide at once, and incompressible flesh.
TEST(EverydaySoftRandom, ScenesKeepTheirPromises) {
  test::expect_promises(test::runs_in_full() ? 60 : 10, 0.015, [](std::uint64_t seed) {
    double size = 1;
    const scene::Scene scene = random_scene(seed, size);
    return test::keep_promises(scene, size, frames, 0.05);
  });
}

}  // namespace
}  // namespace duet::everyday_soft_random_test
