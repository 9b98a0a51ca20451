#include "sim/contact/detection/contact_plane.h"

#include <cmath>

namespace duet {
namespace {

// Greatest distance from the surface of the foot of the perpendicular from `x` on a plane, for `x` to be
// opposite that surface, relative to the distance from `x` to `inside`. More lets points beside an edge count
// as opposite a face that ends before them.
constexpr double foot_tolerance = 0.002;
// Cosine of 73 degrees. A larger value would exclude corners that touch at a slant: at the corner of a box
// that stands upright the cosine is 0.58.
constexpr double min_corner_facing = 0.3;
constexpr double
    // Relative to the distance from `x` to `inside`: a point no farther than this below the end of a wall is
    // level with that end. Twice as much would let a body slide over edges that it has run into twice as
    // deep.
    wall_step = 2e-4,
    // Relative to the step `wall_step` along a wall: the surface goes on if it is no farther off the wall's
    // plane than `on`, and has ended if it is farther off than `off`.
    on = 0.1, off = 0.5;
constexpr double along_normal = 1 - 1e-12;  // least cosine of the angle between two directions: rounding
constexpr double same_wall = 0.99;  // least cosine of the angle between normals that are those of one plane

// Reads a shape from its level set, which is fast.
struct OfLevelSet {
  const LevelSet& shape;
  double distance(const Vec3& x) const { return shape.distance(x); }
  Vec3 normal(const Vec3& x) const { return shape.normal(x); }
};

// Reads a shape exactly: a mesh from its triangles instead of its grid.
struct OfTriangles {
  const LevelSet& shape;
  double distance(const Vec3& x) const { return shape.exact(x).distance; }
  Vec3 normal(const Vec3& x) const { return shape.exact(x).normal; }
};

// Returns what ends_at() documents, for a shape that is read by one of the classes above.
template <class Shape>
bool is_at_end_of_wall(const Shape& shape, const Vec3& foot, const Vec3& normal, const Vec3& way) {
  const Vec3 along = way - way.dot(normal) * normal;
  const double length = along.norm();
  if (!(length > 0)) return false;
  const double step = wall_step * way.norm();
  const Vec3 shift = step / length * along;
  return std::abs(shape.distance(foot - shift)) < on * step && shape.distance(foot + shift) > off * step;
}

// Finds the plane that contact_plane() documents, for a shape that is read by one of the classes above.
template <class Shape>
ContactPlane plane_of(const Shape& shape, const Vec3& x, const Vec3& inside) {
  const Vec3 way = inside - x;
  ContactPlane plane;
  const double distance = shape.distance(inside);
  plane.normal = shape.normal(inside);
  plane.foot = inside - distance * plane.normal;
  plane.gap = distance - plane.normal.dot(way);
  const bool is_opposite =
      std::abs(shape.distance(x - plane.gap * plane.normal)) <= foot_tolerance * way.norm();
  // A ball that comes from outside, with its center at `inside`: its distance is that of the center.
  if (is_opposite && distance > 0 && plane.normal.dot(way) >= along_normal * way.norm()) return plane;
  ContactPlane nearest;
  nearest.gap = shape.distance(x);
  const double level = wall_step * way.norm();
  if (is_opposite && !(nearest.gap >= -level)) return plane;
  nearest.normal = shape.normal(x);
  nearest.foot = x - nearest.gap * nearest.normal;
  nearest.faces = faces(nearest.normal, way);
  if (is_opposite && nearest.normal.dot(plane.normal) > same_wall) return plane;
  if (nearest.faces && nearest.gap >= 0 && is_at_end_of_wall(shape, nearest.foot, nearest.normal, way)) {
    nearest.faces = false;
    return nearest;
  }
  // The point is level with the nearest surface, though it is below the plane found from inside: it has
  // turned under an edge, and has not run into the face beyond it.
  if (is_opposite && nearest.faces && nearest.gap <= level && plane.gap < -level) return nearest;
  return is_opposite ? plane : nearest;
}

}  // namespace

bool faces(const Vec3& normal, const Vec3& way) { return normal.dot(way) > min_corner_facing * way.norm(); }

bool ends_at(const LevelSet& shape, const Vec3& foot, const Vec3& normal, const Vec3& way) {
  return is_at_end_of_wall(OfTriangles{shape}, foot, normal, way);
}

ContactPlane contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside) {
  if (shape.kind == LevelSet::Kind::sphere && x.dot(inside) > 0) {
    // A sphere has no edges, so that the surface nearest to `x` counts, unless `x` is beyond the center. The
    // one nearest to `inside` would lean.
    const double distance = shape.distance(x);
    const Vec3 normal = shape.normal(x);
    return {normal, distance, x - distance * normal, faces(normal, inside - x)};
  }
  return plane_of(OfLevelSet{shape}, x, inside);
}

ContactPlane exact_contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside) {
  return plane_of(OfTriangles{shape}, x, inside);
}

}  // namespace duet
