#include "tests/support/scenes.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace duet::test {

scene::Scene free_space() {
  scene::Scene scene;
  scene.title = "test";
  scene.gravity.setZero();
  return scene;
}

scene::Scene on_ground(double friction, double restitution) {
  scene::Scene scene;
  scene.title = "test";
  scene.ground = scene::Ground{.friction = friction, .restitution = restitution, .look = {}};
  return scene;
}

scene::RigidBody& add_box(scene::Scene& scene, std::string_view name, const Vec3& position, const Vec3& size,
                          double mass) {
  scene::RigidBody body;
  body.name = name;
  body.shape.kind = scene::ShapeKind::box;
  body.shape.size = size;
  body.placement.position = position;
  body.mass = mass;
  scene.rigid.push_back(body);
  return scene.rigid.back();
}

scene::RigidBody& add_mesh(scene::Scene& scene, std::string_view name, std::shared_ptr<TriangleMesh> mesh,
                           double scale, double mass) {
  scene::RigidBody body;
  body.name = name;
  body.shape.kind = scene::ShapeKind::mesh;
  body.shape.mesh = std::move(mesh);
  body.shape.scale = scale;
  body.mass = mass;
  scene.rigid.push_back(body);
  return scene.rigid.back();
}

scene::RigidBody& add_ball(scene::Scene& scene, std::string_view name, const Vec3& position, double radius,
                           double mass) {
  scene::RigidBody body;
  body.name = name;
  body.shape.kind = scene::ShapeKind::sphere;
  body.shape.radius = radius;
  body.placement.position = position;
  body.mass = mass;
  scene.rigid.push_back(body);
  return scene.rigid.back();
}

scene::DeformableBody& add_soft_box(scene::Scene& scene, std::string_view name, const Vec3& position,
                                    const Vec3& size, int cells, double youngs_modulus) {
  scene::Material material;
  material.name = std::string("material of ").append(name);
  material.youngs_modulus = youngs_modulus;
  scene.materials.push_back(material);
  scene::DeformableBody body;
  body.name = name;
  body.shape.size = size;
  body.shape.cells = Vec3i::Constant(cells);
  body.placement.position = position;
  body.material = material.name;
  scene.deformable.push_back(body);
  return scene.deformable.back();
}

std::size_t index_of_name(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw std::out_of_range("no body is called `" + name + "`");
  return static_cast<std::size_t>(found - names.begin());
}

EffectSet plan(const scene::Scene& scene) { return scene::plan_effects(scene).active(); }

Vec3 center_of(const Bodies& bodies, std::size_t index) {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for_each_particle(bodies.deformable[index], [&](std::size_t p) {
    sum += bodies.particles.mass[p] * bodies.particles.x[p];
    mass += bodies.particles.mass[p];
  });
  return sum / mass;
}

}  // namespace duet::test
