#include "sim/coupling/contact_plane.h"

#include <cmath>

namespace duet {
namespace {

// Of the way from the point inwards: how far off the surface the foot of the perpendicular may be.
constexpr double foot_tolerance = 0.002;
// Cosine of the steepest angle between the way inwards and the normal of a surface that is faced: 73 degrees.
// From a box's corner it is 55 degrees to its faces.
constexpr double least_facing = 0.3;

}  // namespace

ContactPlane contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside) {
  const Vec3 way = inside - x;
  ContactPlane plane;
  const double distance = shape.distance(inside);
  plane.normal = shape.normal(inside);
  plane.foot = inside - distance * plane.normal;
  plane.gap = distance - plane.normal.dot(way);
  if (std::abs(shape.distance(x - plane.gap * plane.normal)) <= foot_tolerance * way.norm()) return plane;
  plane.normal = shape.normal(x);
  plane.gap = shape.distance(x);
  plane.foot = x - plane.gap * plane.normal;
  plane.faces = plane.normal.dot(way) > least_facing * way.norm();
  return plane;
}

}  // namespace duet
