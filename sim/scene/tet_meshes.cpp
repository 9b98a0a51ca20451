#include "sim/scene/tet_meshes.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/geometry/tet_mesh_check.h"
#include "sim/geometry/tet_quality.h"
#include "sim/geometry/tetrahedralizer.h"
#include "sim/scene/solids.h"

namespace duet::scene {
namespace {

[[noreturn]] void fail(const DeformableBody& body, const std::string& what) {
  throw Error(ExitStatus::usage, fmt::format("deformable.{}.shape: {}", body.name, what));
}

bool same_lattice(const DeformableBody& a, const DeformableBody& b) {
  return a.size == b.size && a.cells == b.cells && a.pattern == b.pattern;
}

bool same_surface(const DeformableBody& a, const DeformableBody& b) {
  const Shape &s = a.shape, &t = b.shape;
  return a.spacing == b.spacing && a.graded == b.graded && s.kind == t.kind && s.radius == t.radius &&
         s.length == t.length && s.tube == t.tube && s.mesh == t.mesh && s.scale == t.scale;
}

bool same_shape(const DeformableBody& a, const DeformableBody& b) {
  if (a.source != b.source) return false;
  switch (a.source) {
    case TetSource::surface:
      return same_surface(a, b);
    case TetSource::file:
      return a.tets == b.tets && a.shape.scale == b.shape.scale;
    case TetSource::lattice:
      break;
  }
  return same_lattice(a, b);
}

TetMesh filled(const DeformableBody& body) {
  const Shape& shape = body.shape;
  const LevelSet inside = shape.kind == ShapeKind::mesh
                              ? fine_level_set(in_frame(*shape.mesh, shape.scale, Pose{}), body.spacing)
                              : level_set(shape);
  const double spacing = body.spacing.value_or(default_spacing(inside));
  TetMesh mesh = tetrahedralize(inside, spacing, body.graded);
  const int parts = connected_parts(mesh);
  if (parts == 0)
    fail(body, fmt::format("no tetrahedron {:.3g} m wide fits inside; lower `spacing`", spacing));
  if (parts > 1)
    fail(body,
         fmt::format("tetrahedra {:.3g} m wide fall into {} parts where the shape is thin; lower `spacing`",
                     spacing, parts));
  return mesh;
}

TetMesh made(const DeformableBody& body) {
  const bool needs_mesh = body.source == TetSource::surface && body.shape.kind == ShapeKind::mesh;
  if ((needs_mesh && !body.shape.mesh) || (body.source == TetSource::file && !body.tets))
    fail(body, "the scene was read without its meshes");
  if (body.source == TetSource::surface) return filled(body);
  if (body.source == TetSource::lattice) return box_lattice(body.size, body.cells, body.pattern);
  TetMesh mesh = *body.tets;
  for (Vec3& x : mesh.nodes) x *= body.shape.scale;
  return mesh;
}

}  // namespace

const TetMesh& TetMeshes::of(const DeformableBody& body) {
  auto found =
      std::find_if(made_.begin(), made_.end(), [&](const Made& m) { return same_shape(m.body, body); });
  if (found == made_.end()) found = made_.insert(found, {body, made(body), 0});
  ++found->bodies;
  return found->mesh;
}

std::vector<TetSize> TetMeshes::sizes() const {
  std::vector<TetSize> sizes;
  for (const Made& one : made_) {
    const TetQuality quality = tet_quality(one.mesh);
    sizes.push_back({one.body.name, one.bodies, static_cast<int>(quality.tets), quality.smallest_altitude,
                     quality.least_angle, quality.largest_angle});
  }
  return sizes;
}

}  // namespace duet::scene
