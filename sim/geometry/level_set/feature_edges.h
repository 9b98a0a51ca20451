// Lines of a body along which it can touch another one between any two of its samples: sharp edges, and the
// middle lines of what a ball sweeps out. And where it can touch a soft one between the points of that.
#pragma once

#include <memory>
#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/box_tree.h"

namespace duet {

// All in body space.
struct FeatureEdges {
  struct Line {  // consecutive nodes
    int begin = 0, end = 0;
    bool is_closed = false;  // from the last node back to the first one
    double radius = 0;       // m, of the ball that sweeps along; zero on edges
    double around = 0;       // m, radius of a circle about the axis y; zero where the line is straight
                             // from node to node
    double longest = 0;      // m, way from a node to the next
  };
  std::vector<Line> lines;
  std::vector<Vec3> nodes;   // m
  std::vector<Vec3> inward;  // unit, into the body from an edge, near its bisector; zero on middle lines
  std::vector<int> corners;  // a node at every place where three edges or more end
  std::vector<int> bulges;   // nodes on no line: samples of a mesh where it bends outwards, the last nodes
  // Over the corners and then the bulges, numbered on.
  std::shared_ptr<const BoxTree> corner_tree;
  const Vec3& corner(int number) const { return nodes[node_of(number)]; }
  const Vec3& inward_of(int number) const { return inward[node_of(number)]; }
  std::size_t corner_count() const { return corners.size() + bulges.size(); }

 private:
  std::size_t node_of(int number) const {
    const auto n = static_cast<std::size_t>(number);
    return static_cast<std::size_t>(n < corners.size() ? corners[n] : bulges[n - corners.size()]);
  }
};

// Of nodes no farther apart than `spacing` (m): the edges of boxes, the rims and the axis of a cylinder, the
// axis of a capsule, the middle line of a torus.
FeatureEdges find_feature_edges(const LevelSet& shape, double spacing);
// The edges of a closed mesh at which its faces turn by 30 degrees or more outwards, and its bulges: where
// the radius of its outward bend is less than ten spacings in some direction. `shape` is its level set,
// `samples` and `inside` are its surface_samples and points_inside.
FeatureEdges find_feature_edges(const TriangleMesh& mesh, const LevelSet& shape,
                                const std::vector<Vec3>& samples, const std::vector<Vec3>& inside,
                                double spacing);

// Leaves of every line what lies between nodes for which `stays` holds.
void keep_nodes(const std::vector<char>& stays, FeatureEdges& ridges);

// The place between two nodes of `line`, t = 0 at the first one and 1 at the second.
Vec3 place_between(const FeatureEdges::Line& line, const Vec3& first, const Vec3& second, double t);

}  // namespace duet
