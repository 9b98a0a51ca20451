#include "sim/scene/solids.h"

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::scene {

LevelSet level_set(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
      return LevelSet::sphere(shape.radius);
    case ShapeKind::capsule:
      return LevelSet::capsule(shape.radius, shape.length);
    case ShapeKind::cylinder:
      return LevelSet::cylinder(shape.radius, shape.length);
    case ShapeKind::torus:
      return LevelSet::torus(shape.radius, shape.tube);
    case ShapeKind::box:
    case ShapeKind::mesh:
      break;
  }
  return LevelSet::box(shape.size);
}

const Solid& Solids::of(const RigidBody& body) {
  const Shape& shape = body.shape;
  if (shape.kind != ShapeKind::mesh)
    return other_ = make_solid(level_set(shape), body.sample_spacing, detail_);
  if (!shape.mesh)
    throw Error(ExitStatus::usage,
                fmt::format("rigid.{}.shape.mesh: the scene was read without its meshes", body.name));
  const MeshKey key{shape.mesh.get(), shape.scale, shape.cells, body.sample_spacing.value_or(0)};
  const auto [entry, is_new] = meshes_.try_emplace(key);
  if (is_new) entry->second = make_solid(*shape.mesh, shape.scale, shape.cells, body.sample_spacing);
  return entry->second;
}

}  // namespace duet::scene
