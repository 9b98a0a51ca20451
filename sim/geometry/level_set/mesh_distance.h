// Exact signed distance from a closed mesh.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet {

/// The exact signed distance from a closed mesh, found by a search in a tree of its triangles.
class MeshDistance {
 public:
  /// Constructs the tree and the pseudonormals of a mesh whose triangles face outward.
  explicit MeshDistance(const TriangleMesh& mesh);

  /// Returns the signed distance (m) and normal at `x` (m, coordinates of the mesh). The sign is that of the
  /// pseudonormal at the nearest point: that of the face, the sum of those of two faces at an edge, or the
  /// sum over the faces around a vertex weighted by their angles (Baerentzen and Aanaes 2005, "Signed
  /// distance computation using the angle weighted pseudonormal").
  SignedDistance at(const Vec3& x) const { return from(tree_.nearest(x), x); }
  /// Returns the signed distance and normal at `x`, given an upper bound `at_most` (m) of the distance to the
  /// surface. The search is faster, the tighter the bound; too small a bound costs time but does not change
  /// the distance.
  SignedDistance at(const Vec3& x, double at_most) const { return from(tree_.nearest(x, at_most), x); }
  /// Returns the signed distance (m) at `x`, given an upper bound `at_most` (m) of its magnitude.
  double distance(const Vec3& x, double at_most) const { return from(tree_.nearest(x, at_most), x).distance; }
  /// Returns the tree of the triangles.
  const TriangleTree& tree() const { return tree_; }

  /// A triangle with its normal and pseudonormals.
  struct Face {
    Vec3 corner[3];  ///< Positions, m.
    Vec3 normal;     ///< Unit normal, outward; zero if the face has no area.
    /// Pseudonormals at the edges, not of unit length; edge k is opposite to corner k.
    Vec3 at_edge[3];
    /// Pseudonormals at the corners, not of unit length.
    Vec3 at_corner[3];
  };
  /// Calls visit(number, face) for the faces whose bounding boxes meet `box` (m), and for some others.
  template <class Visit>
  void for_each_face(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    tree_.query(box, [&](int number) { visit(number, faces_[static_cast<std::size_t>(number)]); });
  }

 private:
  // Returns the signed distance and normal at `x`, given the nearest point of the mesh.
  SignedDistance from(const TriangleTree::Nearest& nearest, const Vec3& x) const;
  TriangleTree tree_;
  // Faces by their number in the mesh.
  std::vector<Face> faces_;
};

}  // namespace duet
