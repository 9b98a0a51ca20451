#include "sim/contact/detection/shape_support_point.h"

#include <array>
#include <cmath>
#include <limits>

#include "sim/base/elementary.h"
#include "sim/base/index.h"

namespace duet {
namespace {

// Steps of the fixed-point iteration for points whose place depends on the host's normal there. On flat hosts
// and balls the first step is exact; on others each step costs a query of the level set.
constexpr int steps = 4;

// Returns the support point of a ball towards a surface with the normal `n`.
ShapeSupportPoint of_ball(const Vec3& center, double radius, const Vec3& n) {
  return {center - radius * n, center};
}

// Returns the normal of the host's surface nearest to `x` (m, host's shape space). The grid of a mesh turns
// its normals gradually where those of the surface jump: in the middle of a groove it gives one that points
// away from the bottom, where there is no nearest surface. If the foot along the grid's normal is not on the
// surface, the exact normal counts.
Vec3 normal_to_surface(const LevelSet& host, const Vec3& x) {
  constexpr double tolerance = 0.002;  // greatest distance of the foot from the surface, relative
  const Vec3 normal = host.normal(x);
  if (host.kind != LevelSet::Kind::grid) return normal;
  const double distance = host.distance(x);
  const bool leads_there = std::abs(host.distance(x - distance * normal)) <= tolerance * std::abs(distance);
  return leads_there ? normal : host.exact(x).normal;
}

// Returns the support point of a ball towards a host.
ShapeSupportPoint of_ball(const Vec3& center, double radius, const LevelSet& host) {
  return of_ball(center, radius, normal_to_surface(host, center));
}

// Returns by how much ShapeSupportPoint::inside of a rim lies in from it along the radius and along the axis,
// m.
double way_in_from_rim(const LevelSet& shape) { return shape.min_size() / 4 * std::sqrt(0.5); }

// Returns the direction (unit, host's shape space) from the center of a ring to its support point, for the
// host's normal `n` at the ring. The ring lies in the plane of the shape's axes x and z. If the normal is at
// right angles to that plane, all directions are equal and the result is the x axis.
Vec3 support_direction(const Vec3& n, const Quat& orientation) {
  const Vec3 local = orientation.conjugate() * n;
  const double length = math::hypot(local.x(), local.z());
  constexpr double at_right_angles = 1e-9;  // sine of the angle that counts as zero: rounding of orientations
  const Vec3 direction =
      length > at_right_angles ? Vec3(-local.x() / length, 0, -local.z() / length) : Vec3::UnitX();
  return orientation * direction;
}

// Keeps the point of an iteration that is nearest to the host. The steps need not come nearer: around a small
// body inside a ring they jump between its two sides. On flat hosts the second step repeats the first.
class NearestIterate {
 public:
  explicit NearestIterate(const LevelSet& host) : host_(host) {}

  // Takes the point of a step at `x` (m, host's shape space). Returns false if the step has not moved it, so
  // that further steps are of no use.
  bool take(const Vec3& x, const ShapeSupportPoint& point) {
    if (x == last_) return false;
    last_ = x;
    const double distance = host_.distance(x);
    if (!(distance >= least_)) {  // also taken if it is not finite, so that the error shows
      least_ = distance;
      point_ = point;
    }
    return true;
  }
  const ShapeSupportPoint& point() const { return point_; }

 private:
  const LevelSet& host_;
  double least_ = std::numeric_limits<double>::infinity();
  Vec3 last_ = Vec3::Constant(least_);
  ShapeSupportPoint point_{Vec3::Zero(), Vec3::Zero()};
};

// Returns the support point of a torus at `pose` towards a host.
ShapeSupportPoint of_torus(const LevelSet& shape, const Pose& pose, const LevelSet& host) {
  Vec3 center = pose.position;
  NearestIterate nearest(host);
  for (int i = 0; i < steps; ++i) {
    center = pose.position + shape.radius * support_direction(host.normal(center), pose.orientation);
    if (!nearest.take(center, {center, center})) break;
  }
  return of_ball(nearest.point().inside, shape.tube, host);
}

// Returns the place of support point k of a capsule or cylinder along its axis, as a fraction of the half
// length.
double place_along(int k) {
  constexpr std::array<double, 4> place{1, -1, 1.0 / 3, -1.0 / 3};
  return place[as_index(k)];
}
// Returns the end of the axis at which support point k is, 1 or -1, and 0 for the two points between the
// ends.
double side_of(int k) { return k < 2 ? place_along(k) : 0; }

// Returns support point k of a cylinder at `pose` towards a host: the nearest point of the circle about the
// axis on which it lies, a rim for the first two.
ShapeSupportPoint of_circle(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host) {
  const Vec3 axis = pose.orientation * Vec3::UnitY();
  const Vec3 center = pose.position + place_along(k) * shape.half_length * axis;
  const double way = way_in_from_rim(shape);
  ShapeSupportPoint point{center, center};
  NearestIterate nearest(host);
  for (int i = 0; i < steps; ++i) {
    const Vec3 direction = support_direction(host.normal(point.inside), pose.orientation);
    point.position = center + shape.radius * direction;
    point.inside = point.position - way * (direction + side_of(k) * axis);
    if (!nearest.take(point.position, point)) break;
  }
  return nearest.point();
}

}  // namespace

bool rolls_over_samples(const LevelSet& host) { return support_point_count(host) > 0; }

bool ignores_samples(const LevelSet& host, const LevelSet& guest) {
  return host.kind == LevelSet::Kind::capsule || host.kind == LevelSet::Kind::torus ||
         (host.kind == LevelSet::Kind::sphere && guest.kind != LevelSet::Kind::grid);
}

bool is_left_to_ball(const LevelSet& host, const LevelSet& guest) {
  return host.kind == LevelSet::Kind::sphere && guest.kind != LevelSet::Kind::sphere &&
         support_point_count(guest) > 0;
}

bool is_beside_side(const LevelSet& host, const Vec3& x) {
  if (host.kind != LevelSet::Kind::cylinder) return false;
  // At the rim the end counts, so that rounding does not decide for points that lie on it.
  constexpr double at_rim = 1e-4;  // distance from the rim, relative to the radius
  const double beyond_end = std::abs(x.y()) - host.half_length, out = math::hypot(x.x(), x.z()) - host.radius;
  const double rim = at_rim * host.radius;
  return beyond_end <= 0 && out >= beyond_end && (beyond_end < -rim || out > rim);
}

int support_point_count(const LevelSet& shape) {
  switch (shape.kind) {
    case LevelSet::Kind::sphere:
    case LevelSet::Kind::torus:
      return 1;
    case LevelSet::Kind::capsule:
    case LevelSet::Kind::cylinder:
      return 2;
    case LevelSet::Kind::box:
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  return 0;
}

int support_numbers(const LevelSet& shape) {
  return support_point_count(shape) == 2 ? 4 : support_point_count(shape);
}

ShapeSupportPoint support_point(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host) {
  switch (shape.kind) {
    case LevelSet::Kind::torus:
      return of_torus(shape, pose, host);
    case LevelSet::Kind::capsule:
      return of_ball(pose.to_world(Vec3(0, place_along(k) * shape.half_length, 0)), shape.radius, host);
    case LevelSet::Kind::cylinder:
      return of_circle(shape, k, pose, host);
    default:
      return of_ball(pose.position, shape.radius, host);
  }
}

ShapeSupportPoint support_point(const LevelSet& shape, int k, const Vec3& n) {
  switch (shape.kind) {
    case LevelSet::Kind::torus:
      return of_ball(shape.radius * support_direction(n, Quat::Identity()), shape.tube, n);
    case LevelSet::Kind::capsule:
      return of_ball(Vec3(0, place_along(k) * shape.half_length, 0), shape.radius, n);
    case LevelSet::Kind::cylinder: {
      const Vec3 axis = Vec3::UnitY(), direction = support_direction(n, Quat::Identity());
      const Vec3 position = place_along(k) * shape.half_length * axis + shape.radius * direction;
      return {position, position - way_in_from_rim(shape) * (direction + side_of(k) * axis)};
    }
    default:
      return of_ball(Vec3::Zero(), shape.radius, n);
  }
}

}  // namespace duet
