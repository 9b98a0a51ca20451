#include "tests/support/everyday.h"

#include <fmt/format.h>

namespace duet::test {

std::string name_of(Support support) {
  switch (support) {
    case Support::ground:
      return "ground";
    case Support::static_box:
      return "static_box";
    case Support::tiles:
      return "tiles";
    case Support::mesh:
      return "mesh";
    case Support::kinematic_box:
      return "kinematic_box";
    case Support::dynamic_box:
      return "dynamic_box";
  }
  return "";
}

void add_support(scene::Scene& scene, Support support, double size) {
  const Vec3 extent(70 * size, 4 * size, 10 * size), middle(30 * size, -2 * size, 0);
  const auto fix = [](scene::RigidBody& body) {
    body.is_static = true;
    body.mass.reset();
  };
  switch (support) {
    case Support::ground:
      scene.ground = scene::Ground{.look = {}};
      return;
    case Support::static_box:
      return fix(add_box(scene, "floor", middle, extent, 1));
    case Support::mesh: {
      auto mesh = std::make_shared<TriangleMesh>(box_mesh(-extent / 2, extent / 2));
      scene::RigidBody& floor = add_mesh(scene, "floor", mesh, 1, 1);
      floor.placement.position = middle;
      return fix(floor);
    }
    case Support::kinematic_box: {
      scene::RigidBody& floor = add_box(scene, "floor", middle, extent, 1);
      floor.is_kinematic = true;
      floor.mass.reset();
      return;
    }
    case Support::tiles:
      for (int i = -1; i < 25; ++i)
        fix(add_box(scene, fmt::format("tile{}", i), Vec3((2.6 * i + 2.3) * size, -2 * size, 0),
                    Vec3(2.6, 4, 10) * size, 1));
      return;
    case Support::dynamic_box:  // 1e6 times as heavy as a cube of water of the given size
      scene.ground = scene::Ground{.height = -extent.y(), .look = {}};
      add_box(scene, "floor", middle, extent, 1e6 * size * size * size * 1000);
      return;
  }
}

scene::Shape scaled(scene::Shape shape, double size) {
  shape.size *= size;
  shape.radius *= size;
  shape.length *= size;
  shape.tube *= size;
  if (shape.kind == scene::ShapeKind::mesh) shape.scale *= size;
  return shape;
}

scene::RigidBody& add_shape(scene::Scene& scene, const EverydayShape& everyday, double size, double above) {
  scene::RigidBody body;
  body.name = "body";
  body.shape = scaled(everyday.shape, size);
  if (everyday.mesh) {
    body.shape.mesh = everyday.mesh;
    body.shape.scale = size;
  }
  body.density = 1000;
  body.placement.orientation = everyday.orientation;
  body.placement.position = Vec3(0, above + size * everyday.height, 0);
  scene.rigid.push_back(body);
  return scene.rigid.back();
}

std::size_t index_of_shape(const Bodies& bodies) { return index_of_name(bodies.rigid.name, "body"); }

std::vector<EverydayShape> shapes_that_lie_flat() {
  using scene::Shape;
  using scene::ShapeKind;
  return {
      {"cube", {.kind = ShapeKind::box, .size = Vec3(1, 1, 1)}, Quat::Identity(), 0.5},
      {"slab", {.kind = ShapeKind::box, .size = Vec3(1.2, 0.1, 0.7)}, Quat::Identity(), 0.05},
      {"upright_cylinder",
       {.kind = ShapeKind::cylinder, .radius = 0.4, .length = 0.8},
       Quat::Identity(),
       0.4},
      {"lying_cylinder",
       {.kind = ShapeKind::cylinder, .radius = 0.3, .length = 0.8},
       exponential(Vec3(EIGEN_PI / 2, 0, 0)),
       0.3},
      {"ring", {.kind = ShapeKind::torus, .radius = 0.5, .tube = 0.15}, Quat::Identity(), 0.15},
      {"lying_capsule",
       {.kind = ShapeKind::capsule, .radius = 0.3, .length = 0.6},
       exponential(Vec3(EIGEN_PI / 2, 0, 0)),
       0.3},
      {"ball", {.kind = ShapeKind::sphere, .radius = 0.5}, Quat::Identity(), 0.5},
      {"mesh",
       {.kind = ShapeKind::mesh},
       Quat::Identity(),
       0.3,
       std::make_shared<TriangleMesh>(box_mesh(-Vec3(0.5, 0.3, 0.4), Vec3(0.5, 0.3, 0.4)))},
  };
}

std::vector<EverydayShape> shapes_that_roll() {
  using scene::ShapeKind;
  const Quat across = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  return {
      {"ball", {.kind = ShapeKind::sphere, .radius = 0.5}, Quat::Identity(), 0.5},
      {"cylinder", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.8}, across, 0.5},
      {"coin", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.1}, across, 0.5},
      {"roll", {.kind = ShapeKind::cylinder, .radius = 0.2, .length = 3}, across, 0.2},
      {"capsule", {.kind = ShapeKind::capsule, .radius = 0.5, .length = 1}, across, 0.5},
      {"tire", {.kind = ShapeKind::torus, .radius = 0.35, .tube = 0.15}, across, 0.5},
  };
}

}  // namespace duet::test
