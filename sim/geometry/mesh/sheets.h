// Generators of sheets and curves about the origin: the rest shapes of thin shells and rods.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// A triangulated surface with a boundary.
struct Sheet {
  std::vector<Vec3> nodes;          ///< Positions, m.
  std::vector<Triangle> triangles;  ///< Counter-clockwise seen from the front.
};

/// Returns a rectangle in the plane y = 0 with its front upward. `size` holds its extents along x and z (m);
/// `cells_x` by `cells_z` cells are cut into two triangles each, by diagonals that alternate.
Sheet panel(const Vec2& size, int cells_x, int cells_z);
/// Returns a disc of the given `radius` (m) in the plane y = 0 with its front upward. `rings` rings of nodes
/// lie about the middle node; ring k has 6 k nodes.
Sheet disc(double radius, int rings);

/// An edge of a sheet.
struct SheetEdge {
  int a,               ///< First node: the first of its triangles runs from `a` to `b`.
      b;               ///< Second node.
  int opposite,        ///< Node of the first triangle that is not on the edge.
      other_opposite;  ///< Node of the second triangle that is not on the edge; -1: the edge is on the
                       ///< border.
};
/// Returns all edges of the sheet, each once, in the order in which the triangles meet them.
std::vector<SheetEdge> edges(const Sheet& sheet);

/// Whether the ends of a curve are joined.
enum class CurveEnds { are_apart, are_joined };

/// A polygonal line.
struct Curve {
  std::vector<Vec3> nodes;  ///< Positions, m.
  bool is_closed = false;   ///< True if the last node is joined to the first one.
};

/// Returns a curve of `segments` segments of equal arc length through the points, in their order. It is a
/// Catmull-Rom spline; two points give a straight line. At least two points are needed.
Curve curve_through(const std::vector<Vec3>& points, int segments, CurveEnds ends);
/// Returns a helix about the axis y, from its lower end to its upper one. `radius` and `pitch`, the rise of
/// one turn, are in m.
Curve helix(double radius, double pitch, double turns, int segments);
/// Returns the closed curve that winds `p` times about the axis y and `q` times about the center line of a
/// torus. `radius` is that of the center line and `tube` that of the tube, both in m.
Curve torus_knot(double radius, double tube, int p, int q, int segments);

}  // namespace duet
