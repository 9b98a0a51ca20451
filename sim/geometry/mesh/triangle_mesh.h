// Closed triangle meshes and the mass properties of what they enclose.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct TriangleMesh {
  std::vector<Vec3> positions;  // m
  std::vector<Triangle> triangles;
  // For drawing, a value for each corner of each triangle; empty where the mesh has none.
  std::vector<std::array<Vec3f, 3>> normals;  // unit, outward
  std::vector<std::array<Vec2f, 3>> uvs;

  const Vec3& corner(std::size_t triangle, std::size_t k) const {
    return positions[static_cast<std::size_t>(triangles[triangle][k])];
  }
};

Vec3 area_vector(const TriangleMesh& mesh, std::size_t triangle);  // m^2, outward, as long as the area

// The same mesh with coordinates in `frame` (x = frame * x_new), after scaling about the origin.
TriangleMesh in_frame(const TriangleMesh& mesh, double scale, const Pose& frame);

// Of a homogeneous body of unit density, exact for polyhedra.
struct MassProperties {
  double volume = 0;                 // m^3, negative when the triangles face inward
  Pose frame;                        // centre of mass and principal axes in the mesh's coordinates
  Vec3 unit_inertia = Vec3::Zero();  // m^2, principal moments per unit mass in that frame
};
MassProperties mass_properties(const TriangleMesh& mesh);  // of a closed mesh with volume other than zero

}  // namespace duet
