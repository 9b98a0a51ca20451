#include "sim/contact/detection/contact_plane.h"

#include <cmath>

namespace duet {
namespace {

// Of the way from the point inwards: how far off the surface the foot of the perpendicular may be.
constexpr double foot_tolerance = 0.002;
constexpr double least_facing = 0.3;  // cosine of 73 degrees
// Of the way inwards: what is no farther below the end of a wall is at its height, and by how much the
// surface goes on or does not.
constexpr double height = 2e-4, on = 0.1, off = 0.5;
constexpr double same_normal = 0.99;  // cosine

// A shape as its level set tells it: fast.
struct OfLevelSet {
  const LevelSet& shape;
  double distance(const Vec3& x) const { return shape.distance(x); }
  Vec3 normal(const Vec3& x) const { return shape.normal(x); }
};

// Of meshes as their triangles tell it.
struct OfTriangles {
  const LevelSet& shape;
  double distance(const Vec3& x) const { return shape.exact(x).distance; }
  Vec3 normal(const Vec3& x) const { return shape.exact(x).normal; }
};

// Whether a foot on a wall of the shape, the other body being to the side `way` of it, is at the wall's end:
// that body slides over it, as over the side of a rail that it lies on.
template <class Shape>
bool is_at_end_of_wall(const Shape& shape, const ContactPlane& plane, const Vec3& way) {
  const Vec3 along = way - way.dot(plane.normal) * plane.normal;
  const double length = along.norm();
  if (!(length > 0)) return false;
  const double step = height * way.norm();
  const Vec3 shift = step / length * along;
  return std::abs(shape.distance(plane.foot - shift)) < on * step &&
         shape.distance(plane.foot + shift) > off * step;
}

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
  ContactPlane nearest;
  nearest.gap = shape.distance(x);
  const double level = height * way.norm();
  if (is_opposite && !(nearest.gap >= -level)) return plane;
  nearest.normal = shape.normal(x);
  nearest.foot = x - nearest.gap * nearest.normal;
  nearest.faces = faces(nearest.normal, way);
  if (is_opposite && nearest.normal.dot(plane.normal) > same_normal) return plane;
  if (nearest.faces && nearest.gap >= 0 && is_at_end_of_wall(shape, nearest, way)) {
    nearest.faces = false;
    return nearest;
  }
  // Level with the surface, though below the plane: what the point turns under has not been run into.
  if (is_opposite && nearest.faces && nearest.gap <= level && plane.gap < -level) return nearest;
  return is_opposite ? plane : nearest;
}

}  // namespace

bool faces(const Vec3& normal, const Vec3& way) { return normal.dot(way) > least_facing * way.norm(); }

ContactPlane contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside) {
  return plane_of(OfLevelSet{shape}, x, inside);
}

ContactPlane exact_contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside) {
  return plane_of(OfTriangles{shape}, x, inside);
}

}  // namespace duet
