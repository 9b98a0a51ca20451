// A tree of bounding boxes over the triangles of a mesh, which finds the point of the mesh nearest to a given
// point.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/box_tree.h"
#include "sim/geometry/queries/triangle_pack.h"

namespace duet {

/// Returns the point of the triangle abc that is nearest to `x`.
Vec3 nearest_point(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x);

/// A tree of bounding boxes over the triangles of a mesh. It keeps copies of their corners.
class TriangleTree {
 public:
  /// Constructs a tree without triangles, which must not be searched.
  TriangleTree() = default;
  /// Constructs the tree of a mesh that has at least one triangle.
  explicit TriangleTree(const TriangleMesh& mesh);

  /// The nearest point of the mesh.
  struct Nearest {
    Vec3 point;       ///< Position, m.
    double distance;  ///< Distance from the given point, m; not signed.
    int triangle;     ///< Number of its triangle in the mesh.
  };
  /// Returns the point of the mesh nearest to `x` (m).
  Nearest nearest(const Vec3& x) const;
  /// Returns the point of the mesh nearest to `x`, given an upper bound `at_most` (m) of its distance. The
  /// search is faster, the tighter the bound; too small a bound costs time only. The distance is that of the
  /// other overload to the last bit; among triangles that are equally near, the choice may differ.
  Nearest nearest(const Vec3& x, double at_most) const;
  /// Calls visit(triangle) with the number in the mesh of every triangle whose bounding box meets `box` (m),
  /// and of some others.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    pack_tree_.query(box, [&](int pack) {
      const std::size_t first = static_cast<std::size_t>(pack) * pack_width;
      for (std::size_t i = first; i < std::min(first + pack_width, triangles_.size()); ++i)
        visit(triangles_[i].number);
    });
  }

 private:
  // A triangle of the mesh.
  struct Corners {
    Vec3 a, b, c;
    int number;  // number in the mesh
  };
  // A node of the binary tree.
  struct Node {
    Eigen::AlignedBox3d box;
    // Range of triangles_ of a leaf; equal in inner nodes.
    int begin = 0, end = 0;
    // The second child of an inner node. The first child follows its parent.
    int second = 0;
  };
  // Makes a node, and recursively its children, of the triangles [begin, end).
  void build(int begin, int end);

  std::vector<Corners> triangles_;  // copies of all triangles, in the order of the leaves
  std::vector<Node> nodes_;
  std::vector<TrianglePack> packs_;  // groups of eight consecutive entries of triangles_
  BoxTree pack_tree_;                // tree over the boxes of packs_
};

}  // namespace duet
