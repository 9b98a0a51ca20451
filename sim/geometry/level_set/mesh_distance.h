// Exact signed distance from a closed mesh.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet {

class MeshDistance {
 public:
  explicit MeshDistance(const TriangleMesh& mesh);  // triangles that face outward

  // The side of the surface is that of the pseudonormal at the nearest point: of the face, the two faces at
  // an edge, or those around a vertex weighted by their angles there (Baerentzen and Aanaes 2005).
  SignedDistance at(const Vec3& x) const { return from(tree_.nearest(x), x); }
  // The same of a point that is surely no farther from the surface than `at_most` (m): the faster, the nearer
  // that is to the truth.
  SignedDistance at(const Vec3& x, double at_most) const { return from(tree_.nearest(x, at_most), x); }
  double distance(const Vec3& x, double at_most) const { return from(tree_.nearest(x, at_most), x).distance; }
  const TriangleTree& tree() const { return tree_; }

  struct Face {
    Vec3 corner[3];   // m
    Vec3 normal;      // unit; zero where the face has no area
    Vec3 at_edge[3];  // pseudonormals, not of unit length; edge k is opposite corner k
    Vec3 at_corner[3];
  };
  // Calls visit(number, face) for the faces whose boxes meet `box` (m), and some others.
  template <class Visit>
  void for_each_face(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    tree_.query(box, [&](int number) { visit(number, faces_[static_cast<std::size_t>(number)]); });
  }

 private:
  SignedDistance from(const TriangleTree::Nearest& nearest, const Vec3& x) const;
  TriangleTree tree_;
  std::vector<Face> faces_;
};

}  // namespace duet
