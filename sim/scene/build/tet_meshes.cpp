#include "sim/scene/build/tet_meshes.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/geometry/mesh/tet_mesh_check.h"
#include "sim/geometry/mesh/tet_quality.h"
#include "sim/geometry/meshing/tetrahedralizer.h"
#include "sim/scene/build/tet_cache.h"
#include "sim/scene/solids.h"

namespace duet::scene {
namespace {

[[noreturn]] void fail(const DeformableBody& body, const std::string& what) {
  throw Error(ExitStatus::usage, fmt::format("deformable.{}.shape: {}", body.name, what));
}

bool same_lattice(const DeformableShape& a, const DeformableShape& b) {
  return a.size == b.size && a.cells == b.cells && a.pattern == b.pattern;
}

bool same_surface(const DeformableShape& a, const DeformableShape& b) {
  const Shape &s = a.surface, &t = b.surface;
  return a.spacing == b.spacing && a.graded == b.graded && s.kind == t.kind && s.radius == t.radius &&
         s.length == t.length && s.tube == t.tube && s.mesh == t.mesh && s.scale == t.scale;
}

// Returns whether two shapes have the same tetrahedra.
bool same_shape(const DeformableShape& a, const DeformableShape& b) {
  if (a.kind != b.kind) return false;
  if (a.is_filled()) return same_surface(a, b);
  if (a.kind == DeformableKind::tets) return a.tets == b.tets && a.surface.scale == b.surface.scale;
  return same_lattice(a, b);
}

// Largest number of cells of the lattice over the bounding box of a surface that is filled. An explicit
// `spacing` can ask for no more (256 along each axis, and two at each end); each cell inside has about 12
// tetrahedra.
constexpr double max_lattice_cells = 260.0 * 260 * 260;

// Throws Error (usage) if the lattice over a surface has too many cells: the default spacing follows from the
// thickness, so that a body that is very thin for its size takes more than any machine has.
void check_lattice(const DeformableBody& body, const LevelSet& inside, double spacing) {
  const Vec3 size = inside.upper() - inside.lower();
  const double cells = (size / spacing + Vec3::Constant(2)).prod();
  if (cells <= max_lattice_cells) return;
  fail(body,
       fmt::format("is so thin for its size, {:.3g} m by {:.3g} m, that tetrahedra {:.2g} m wide need a "
                   "lattice of {:.2g} cells, must be <= {:.2g}; make it thicker, give a larger `spacing`, "
                   "or make it a shell or a rod",
                   inside.min_size(), size.maxCoeff(), spacing, cells, max_lattice_cells));
}

// Fills the surface of a body with tetrahedra (m, coordinates of the shape). Throws Error (usage) unless they
// form one connected part.
TetMesh filled(const DeformableBody& body) {
  const Shape& surface = body.shape.surface;
  const LevelSet inside =
      surface.kind == ShapeKind::mesh
          ? fine_level_set(in_frame(*surface.mesh, surface.scale, Pose{}), body.shape.spacing)
          : level_set(surface);
  const double spacing = body.shape.spacing.value_or(default_spacing(inside));
  check_lattice(body, inside, spacing);
  TetMesh mesh = tetrahedralize(inside, spacing, body.shape.graded ? CellSizes::graded : CellSizes::uniform);
  const int parts = connected_parts(mesh);
  if (parts == 0)
    fail(body, fmt::format("no tetrahedron {:.3g} m wide fits inside; lower `spacing`", spacing));
  if (parts > 1)
    fail(body,
         fmt::format("tetrahedra {:.3g} m wide fall into {} parts where the shape is thin; lower `spacing`",
                     spacing, parts));
  return mesh;
}

// Makes the tetrahedra of a body (m, coordinates of the shape). Those that fill a mesh come from the cache if
// they are there, and go to it otherwise.
TetMesh made(const DeformableBody& body) {
  const DeformableShape& shape = body.shape;
  if ((shape.kind == DeformableKind::mesh && !shape.surface.mesh) ||
      (shape.kind == DeformableKind::tets && !shape.tets))
    fail(body, "the scene was read without its meshes");
  if (shape.kind == DeformableKind::mesh) {
    const TetKey key = tet_key(*shape.surface.mesh, shape.surface.scale, shape.spacing, shape.graded);
    if (std::optional<TetMesh> known = cached_tets(key)) return std::move(*known);
    TetMesh mesh = filled(body);
    keep_tets(key, mesh);
    return mesh;
  }
  if (shape.is_filled()) return filled(body);
  if (shape.kind == DeformableKind::box) return box_lattice(shape.size, shape.cells, shape.pattern);
  TetMesh mesh = *shape.tets;
  for (Vec3& x : mesh.nodes) x *= shape.surface.scale;
  return mesh;
}

}  // namespace

const TetMesh& TetMeshes::of(const DeformableBody& body) {
  auto found = std::find_if(made_.begin(), made_.end(),
                            [&](const Made& m) { return same_shape(m.body.shape, body.shape); });
  if (found == made_.end()) found = made_.insert(found, {body, made(body), 0});
  ++found->bodies;
  return found->mesh;
}

std::vector<TetSize> TetMeshes::sizes() const {
  std::vector<TetSize> sizes;
  for (const Made& one : made_) {
    const TetQuality quality = tet_quality(one.mesh);
    sizes.push_back({one.body.name, one.bodies, static_cast<int>(quality.tets), quality.min_altitude,
                     quality.min_angle, quality.max_angle});
  }
  return sizes;
}

}  // namespace duet::scene
