// A tree of bounding boxes over the triangles of a mesh, for the point of it that is nearest to a given one.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/box_tree.h"
#include "sim/geometry/queries/triangle_pack.h"

namespace duet {

// The point of the triangle abc that is nearest to x.
Vec3 nearest_point(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x);

class TriangleTree {
 public:
  TriangleTree() = default;
  explicit TriangleTree(const TriangleMesh& mesh);  // at least one triangle

  struct Nearest {
    Vec3 point;
    double distance;  // m
    int triangle;     // of the mesh
  };
  Nearest nearest(const Vec3& x) const;
  // The same distance, to the last bit, of a point that is surely no farther from the mesh than `at_most`
  // (m): the faster, the nearer that is to the truth. Of triangles that are equally near it is any one that
  // is told.
  Nearest nearest(const Vec3& x, double at_most) const;
  // Calls visit(triangle of the mesh) for those whose boxes meet `box` (m), and some others.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    pack_tree_.query(box, [&](int pack) {
      const std::size_t first = static_cast<std::size_t>(pack) * pack_width;
      for (std::size_t i = first; i < std::min(first + pack_width, triangles_.size()); ++i)
        visit(triangles_[i].number);
    });
  }

 private:
  struct Corners {
    Vec3 a, b, c;
    int number;  // in the mesh
  };
  struct Node {
    Eigen::AlignedBox3d box;
    int begin = 0, end = 0;  // leaves: range of triangles_
    int second = 0;          // inner nodes (begin == end): the second child; the first one follows its parent
  };
  void build(int begin, int end);

  std::vector<Corners> triangles_;  // in the order of the leaves
  std::vector<Node> nodes_;
  std::vector<TrianglePack> packs_;  // of `triangles_`
  BoxTree pack_tree_;
};

}  // namespace duet
