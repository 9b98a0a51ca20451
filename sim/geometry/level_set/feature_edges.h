// Feature edges of a rigid body: lines along which it can touch another body between any two of its samples.
// They are its sharp edges and the center lines of parts that a sweeping ball generates. Convex vertices are
// points at which it can touch a soft body between the points of that body.
#pragma once

#include <memory>
#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/box_tree.h"

namespace duet {

/// The feature edges, corners and convex vertices of a body, in its body space. Code names such a set
/// `feature_edges`.
struct FeatureEdges {
  /// A feature edge: consecutive nodes with straight segments or arcs between them.
  struct Line {
    int begin = 0,           ///< First node, an index into FeatureEdges::nodes.
        end = 0;             ///< One past the last node.
    bool is_closed = false;  ///< True if a segment leads from the last node back to the first one.
    /// Radius of the ball that sweeps along the line, m; zero for sharp edges.
    double radius = 0;
    /// Radius of the circle about the axis y on which the line lies, m; zero if it is straight between nodes.
    double around = 0;
    /// Greatest length of a segment, m, measured along the arc on circles.
    double longest = 0;
  };
  /// The feature edges.
  std::vector<Line> lines;
  std::vector<Vec3> nodes;  ///< Positions, m: the nodes of all lines, then the convex vertices.
  /// For each node of a sharp edge and each convex vertex, a unit vector into the body, near the bisector of
  /// the faces; zero for nodes of center lines.
  std::vector<Vec3> inward;
  /// One node for every place where three or more edges end.
  std::vector<int> corners;
  /// The convex vertices: nodes on no line, which are samples of a mesh at which it bends outward.
  std::vector<int> convex_vertices;
  /// Boxes of the corners and the convex vertices in body space. Item numbers count the corners first and
  /// then go on through `convex_vertices`.
  std::shared_ptr<const BoxTree> corner_tree;
  /// Returns the position (m) of the corner or convex vertex with this number in `corner_tree`.
  const Vec3& corner(int number) const { return nodes[node_of(number)]; }
  /// Returns the inward direction of the corner or convex vertex with this number in `corner_tree`.
  const Vec3& inward_of(int number) const { return inward[node_of(number)]; }
  /// Returns the number of corners and convex vertices.
  std::size_t corner_count() const { return corners.size() + convex_vertices.size(); }

 private:
  // Returns the node of the corner or convex vertex with this number in `corner_tree`.
  std::size_t node_of(int number) const {
    const auto n = static_cast<std::size_t>(number);
    return static_cast<std::size_t>(n < corners.size() ? corners[n] : convex_vertices[n - corners.size()]);
  }
};

/// Returns the feature edges of a shape with a formula, with nodes no farther apart than `spacing` (m). They
/// are the edges of a box, the rims and the axis of a cylinder, the axis of a capsule and the center line of
/// a torus. Other shapes have none.
FeatureEdges find_feature_edges(const LevelSet& shape, double spacing);
/// Returns the feature edges and convex vertices of a closed mesh, with nodes no farther apart than `spacing`
/// (m). The feature edges are the edges at which its faces turn outward by 30 degrees or more. The convex
/// vertices are samples where the radius of the outward bend is less than ten spacings in some direction.
/// `shape` is the level set of the mesh; `samples` and `inside` are its surface_samples() and their
/// points_inside().
FeatureEdges find_feature_edges(const TriangleMesh& mesh, const LevelSet& shape,
                                const std::vector<Vec3>& samples, const std::vector<Vec3>& inside,
                                double spacing);

/// Removes the nodes for which `stays` is zero, with the segments that end there; `stays` has one entry per
/// node. Lines are cut into the pieces that remain, and a piece of one node is no line.
void keep_nodes(const std::vector<char>& stays, FeatureEdges& feature_edges);

/// Returns the point between two neighboring nodes `first` and `second` of `line` (m): t = 0 is the first one
/// and t = 1 the second. On circles it lies on the arc.
Vec3 place_between(const FeatureEdges::Line& line, const Vec3& first, const Vec3& second, double t);

}  // namespace duet
