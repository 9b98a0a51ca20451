// Sheets and curves about the origin: the rest shapes of thin shells and rods.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct Sheet {
  std::vector<Vec3> nodes;          // m
  std::vector<Triangle> triangles;  // counter-clockwise seen from the front
};

// A rectangle in the plane y = 0 with its front upward: `cells` along x and z, each cut into two triangles by
// diagonals that alternate.
Sheet panel(const Vec2& size, int cells_x, int cells_z);
// A disc in the same plane of `rings` rings of nodes about the middle one, 6 k on the k-th.
Sheet disc(double radius, int rings);

// An edge of a sheet: the nodes from `a` to `b` as its first triangle goes, and those opposite to it; the
// second is -1 on the border.
struct SheetEdge {
  int a, b;
  int opposite, other_opposite;
};
std::vector<SheetEdge> edges(const Sheet& sheet);

struct Curve {
  std::vector<Vec3> nodes;  // m
  bool is_closed = false;   // the last node is joined to the first one
};

// Through the points in order (a Catmull-Rom spline; two points: straight), with nodes at equal arc lengths.
Curve curve_through(const std::vector<Vec3>& points, int segments, bool is_closed);
// About the axis y, from the bottom to the top; `pitch` is the rise of one turn.
Curve helix(double radius, double pitch, double turns, int segments);
// The closed curve that winds `p` times about the axis y and `q` times about the ring of the torus.
Curve torus_knot(double radius, double tube, int p, int q, int segments);

}  // namespace duet
