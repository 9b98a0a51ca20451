// Closed triangle meshes and the mass properties of the solids that they enclose.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// A triangle mesh, with optional normals and texture coordinates for drawing.
struct TriangleMesh {
  std::vector<Vec3> positions;      ///< Positions, m.
  std::vector<Triangle> triangles;  ///< Indices into `positions`, counter-clockwise seen from outside.
  /// Outward unit normals at the corners of each triangle; empty if the mesh has none.
  std::vector<std::array<Vec3f, 3>> normals;
  /// Texture coordinates at the corners of each triangle; empty if the mesh has none.
  std::vector<std::array<Vec2f, 3>> uvs;

  /// Returns the position (m) of corner `k`, 0 to 2, of a triangle.
  const Vec3& corner(std::size_t triangle, std::size_t k) const {
    return positions[static_cast<std::size_t>(triangles[triangle][k])];
  }
};

/// Returns the outward normal of a triangle, as long as its area (m^2).
Vec3 area_vector(const TriangleMesh& mesh, std::size_t triangle);

/// Returns the mesh scaled about the origin and expressed in `frame`: scale x = frame * x_new. Normals are
/// turned along.
TriangleMesh in_frame(const TriangleMesh& mesh, double scale, const Pose& frame);

/// Mass properties of a homogeneous solid of unit density.
struct MassProperties {
  double volume = 0;                 ///< Volume, m^3; negative if the triangles face inward.
  Pose frame;                        ///< Center of mass and principal axes in the coordinates of the mesh.
  Vec3 unit_inertia = Vec3::Zero();  ///< Principal moments of inertia per unit mass in `frame`, m^2.
};
/// Returns the mass properties of the solid that a closed mesh encloses. They are exact for polyhedra but for
/// rounding. The volume must not be zero.
MassProperties mass_properties(const TriangleMesh& mesh);

}  // namespace duet
