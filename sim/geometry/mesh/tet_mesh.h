// Tetrahedral meshes: lattices, boundary surfaces, contact samples on the boundary and its render surface.
#pragma once

#include <array>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

using Tet = std::array<int, 4>;       // node indices, positive volume
using Triangle = std::array<int, 3>;  // node indices, counter-clockwise seen from outside

struct TetMesh {
  std::vector<Vec3> nodes;  // m
  std::vector<Tet> tets;
};

double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);  // m^3, positive for a Tet

double volume(const TetMesh& mesh, const Tet& tet);  // m^3
double volume(const TetMesh& mesh);                  // m^3, of all tets

// How the cells of a box are cut into tets.
enum class LatticePattern {
  five,  // five tets a cell, mirrored in alternate cells so that faces match; dihedral angles 54.7 to 90
         // degrees
  six,   // six tets a cell along its diagonal (Freudenthal), alike in all cells; 45 to 90 degrees
  bcc    // body-centred cubic: a node in the middle of each cell, four tets a common face; 45 to 120 degrees
};

// A box of `size` about the origin, cut into cells and these into tets. The angles above are those of cubic
// cells.
TetMesh box_lattice(const Vec3& size, const Vec3i& cells, LatticePattern pattern = LatticePattern::five);

// Drops the nodes that no tet uses and numbers the others anew, in their order.
void keep_used_nodes(TetMesh& mesh);

// A face of a tet, for finding neighbours.
struct TetFace {
  Triangle nodes;  // in ascending order
  int tet = 0;
  int opposite = 0;  // the corner of the tet, 0 to 3, that the face lacks
};
// All faces of all tets, sorted by their nodes, then by tet: tets that share a face are next to each other.
std::vector<TetFace> sorted_faces(const TetMesh& mesh);

// Triangles that belong to one tet only, outward, in the order of the tets.
std::vector<Triangle> boundary(const TetMesh& mesh);

// A point on the boundary: up to three nodes with barycentric weights (unused weights are zero).
struct BoundarySample {
  std::array<int, 3> node{0, 0, 0};
  std::array<double, 3> weight{1, 0, 0};
  double spacing = 0;  // m, the longest edge of its triangle or the length of its edge, at rest
};

// Points of the barycentric lattice of `order` on all edges and faces, vertices left out, none twice.
// About 7.5 a triangle for order 4, which is the paper's density (8) without its random jitter.
std::vector<BoundarySample> boundary_samples(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                             int order);

// The boundary as it is drawn: normals split where triangles meet at more than `crease` degrees at rest. The
// surface's position i is node vertex_nodes[i].
struct BoundarySurface {
  Surface surface;
  std::vector<int> vertex_nodes;
};
BoundarySurface boundary_surface(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                 double crease = 40);

// Recomputes the area-weighted normals from the positions; topology stays.
void update_normals(Surface& surface);

}  // namespace duet
