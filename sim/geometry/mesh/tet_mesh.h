// Tetrahedral meshes: lattices, boundary surfaces, and contact samples and the render surface on the
// boundary.
#pragma once

#include <array>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

/// Four node indices of a tetrahedron of positive volume (see tet_volume()).
using Tet = std::array<int, 4>;
/// Three node indices, counter-clockwise seen from outside.
using Triangle = std::array<int, 3>;

/// A tetrahedral mesh.
struct TetMesh {
  std::vector<Vec3> nodes;  ///< Positions, m.
  std::vector<Tet> tets;    ///< The tetrahedra, as indices into `nodes`.
};

/// Returns the signed volume (m^3) of a tetrahedron: (b - a) x (c - a) . (d - a) / 6. It is positive for a
/// Tet.
double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Returns the signed volume of `tet`, m^3.
double volume(const TetMesh& mesh, const Tet& tet);
/// Returns the sum of the signed volumes of all tets, m^3.
double volume(const TetMesh& mesh);

/// How the cells of a box are cut into tets. Angles are dihedral angles in cubic cells.
enum class LatticePattern {
  /// Five tets per cell, mirrored in alternate cells so that faces match; angles of 54.7 to 90 degrees.
  five,
  /// Six tets per cell around its diagonal (Freudenthal), alike in all cells; angles of 45 to 90 degrees.
  six,
  /// Body-centered cubic: a node in the middle of each cell and four tets around the line between the middles
  /// of adjacent cells; angles of 45 to 120 degrees.
  bcc
};

/// Returns a box about the origin, cut into cells and these into tets. `size` holds its edge lengths (m) and
/// `cells` the number of cells along each axis.
TetMesh box_lattice(const Vec3& size, const Vec3i& cells, LatticePattern pattern = LatticePattern::five);

/// Drops the nodes that no tet uses and renumbers the others in their order.
void keep_used_nodes(TetMesh& mesh);

/// A face of a tet, for finding neighbors.
struct TetFace {
  Triangle nodes;    ///< Node indices in ascending order.
  int tet = 0;       ///< The tet.
  int opposite = 0;  ///< The corner of the tet, 0 to 3, that is not on the face.
};
/// Returns all faces of all tets, sorted by their nodes, then by tet. Faces that two tets share are next to
/// each other.
std::vector<TetFace> sorted_faces(const TetMesh& mesh);

/// Returns the triangles that belong to exactly one tet, outward, in the order of the tets.
std::vector<Triangle> boundary(const TetMesh& mesh);

/// A point on the boundary as a barycentric combination of up to three nodes.
struct BoundarySample {
  std::array<int, 3> node{0, 0, 0};       ///< Node indices; those of unused weights are valid nodes, too.
  std::array<double, 3> weight{1, 0, 0};  ///< Barycentric weights, whose sum is 1; unused ones are 0.
  double spacing = 0;  ///< Length at rest, m: of its edge, or of the longest edge of its triangle.
};

/// Returns the points of the barycentric lattice of `order` on all edges and faces of the boundary
/// `triangles`. The vertices are left out, and no point occurs twice. Order 4 gives about 7.5 points per
/// triangle, close to the 8 randomly placed ones of the paper's simulations.
std::vector<BoundarySample> boundary_samples(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                             int order);

/// The boundary of a tetrahedral mesh as it is drawn.
struct BoundarySurface {
  Surface surface;                ///< The surface.
  std::vector<int> vertex_nodes;  ///< The node of the mesh at each position of `surface`.
};
/// Returns the surface of the boundary `triangles`. Normals are split where triangles meet at more than
/// `crease` degrees at rest.
BoundarySurface boundary_surface(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                 double crease = 40);

/// Recomputes the normals of a surface as area-weighted means of the triangles that use them. Normals without
/// area become (0, 1, 0).
void update_normals(Surface& surface);

}  // namespace duet
