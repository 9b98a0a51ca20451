#include "sim/contact/detection/deepest_point.h"

#include <array>
#include <cmath>
#include <limits>

#include "sim/base/elementary.h"
#include "sim/base/index.h"

namespace duet {
namespace {

constexpr int steps = 4;  // of the fixed-point iteration

DeepestPoint of_ball(const Vec3& center, double radius, const Vec3& n) {
  return {center - radius * n, center};
}

// The grid of a mesh turns its normals gradually where those of the surface jump: in the middle of a groove
// it has one towards the bottom, where there is no surface. So the foot along the normal has to be there.
Vec3 normal_to_surface(const LevelSet& host, const Vec3& x) {
  constexpr double tolerance = 0.002;  // of the distance
  const Vec3 normal = host.normal(x);
  if (host.kind != LevelSet::Kind::grid) return normal;
  const double distance = host.distance(x);
  const bool leads_there = std::abs(host.distance(x - distance * normal)) <= tolerance * std::abs(distance);
  return leads_there ? normal : host.exact(x).normal;
}

DeepestPoint of_ball(const Vec3& center, double radius, const LevelSet& host) {
  return of_ball(center, radius, normal_to_surface(host, center));
}

// How far in from a rim its inner point is along the two ways, m.
double way_in_from_rim(const LevelSet& shape) { return shape.smallest_size() / 4 * std::sqrt(0.5); }

// The direction in the plane of a ring (the shape's x and z) in which a point of it lies deepest, for the
// host's normal `n` at the ring.
Vec3 deepest_direction(const Vec3& n, const Quat& orientation) {
  const Vec3 local = orientation.conjugate() * n;
  const double length = math::hypot(local.x(), local.z());
  const Vec3 direction = length > 1e-9 ? Vec3(-local.x() / length, 0, -local.z() / length) : Vec3::UnitX();
  return orientation * direction;
}

// The steps of the iteration need not come nearer: around a small body inside a ring they jump between its
// two sides. So the best of them counts. On flat hosts the second one repeats the first.
class Nearest {
 public:
  explicit Nearest(const LevelSet& host) : host_(host) {}

  // Returns whether another step is of use.
  bool take(const Vec3& x, const DeepestPoint& point) {
    if (x == last_) return false;
    last_ = x;
    const double distance = host_.distance(x);
    if (!(distance >= least_)) {  // what is not finite shall show
      least_ = distance;
      point_ = point;
    }
    return true;
  }
  const DeepestPoint& point() const { return point_; }

 private:
  const LevelSet& host_;
  double least_ = std::numeric_limits<double>::infinity();
  Vec3 last_ = Vec3::Constant(least_);
  DeepestPoint point_{Vec3::Zero(), Vec3::Zero()};
};

DeepestPoint of_torus(const LevelSet& shape, const Pose& pose, const LevelSet& host) {
  Vec3 center = pose.position;
  Nearest nearest(host);
  for (int i = 0; i < steps; ++i) {
    center = pose.position + shape.radius * deepest_direction(host.normal(center), pose.orientation);
    if (!nearest.take(center, {center, center})) break;
  }
  return of_ball(nearest.point().inside, shape.tube, host);
}

// Of deepest point k of a capsule or cylinder: its place along the axis, as a part of the half length.
double place_along(int k) {
  constexpr std::array<double, 4> place{1, -1, 1.0 / 3, -1.0 / 3};
  return place[as_index(k)];
}
// Where its end is, 0 for the two between the ends.
double side_of(int k) { return k < 2 ? place_along(k) : 0; }

// Of the circle about the axis of a cylinder on which deepest point k lies.
DeepestPoint of_circle(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host) {
  const Vec3 axis = pose.orientation * Vec3::UnitY();
  const Vec3 center = pose.position + place_along(k) * shape.half_length * axis;
  const double way = way_in_from_rim(shape);
  DeepestPoint point{center, center};
  Nearest nearest(host);
  for (int i = 0; i < steps; ++i) {
    const Vec3 direction = deepest_direction(host.normal(point.inside), pose.orientation);
    point.position = center + shape.radius * direction;
    point.inside = point.position - way * (direction + side_of(k) * axis);
    if (!nearest.take(point.position, point)) break;
  }
  return nearest.point();
}

}  // namespace

bool rolls_over_samples(const LevelSet& host) { return deepest_point_count(host) > 0; }

bool touches_with_deepest_point(const LevelSet& host, const LevelSet& guest) {
  return host.kind == LevelSet::Kind::capsule || host.kind == LevelSet::Kind::torus ||
         (host.kind == LevelSet::Kind::sphere && guest.kind != LevelSet::Kind::grid);
}

bool is_beside_side(const LevelSet& host, const Vec3& x) {
  if (host.kind != LevelSet::Kind::cylinder) return false;
  const double beyond_end = std::abs(x.y()) - host.half_length;
  return beyond_end <= 0 && math::hypot(x.x(), x.z()) - host.radius >= beyond_end;
}

int deepest_point_count(const LevelSet& shape) {
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

int deepest_numbers(const LevelSet& shape) {
  return deepest_point_count(shape) == 2 ? 4 : deepest_point_count(shape);
}

DeepestPoint deepest_point(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host) {
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

int deepest_number(const LevelSet& shape, int guest_point) {
  return (-1 - guest_point) % deepest_numbers(shape);
}

int against_face(const LevelSet& shape, int k, int face) {
  return -1 - (k + deepest_numbers(shape) * (1 + face));
}

int with_number(const LevelSet& shape, int guest_point, int k) {
  return guest_point + deepest_number(shape, guest_point) - k;
}

DeepestPoint deepest_point(const LevelSet& shape, int k, const Vec3& n) {
  switch (shape.kind) {
    case LevelSet::Kind::torus:
      return of_ball(shape.radius * deepest_direction(n, Quat::Identity()), shape.tube, n);
    case LevelSet::Kind::capsule:
      return of_ball(Vec3(0, place_along(k) * shape.half_length, 0), shape.radius, n);
    case LevelSet::Kind::cylinder: {
      const Vec3 axis = Vec3::UnitY(), direction = deepest_direction(n, Quat::Identity());
      const Vec3 position = place_along(k) * shape.half_length * axis + shape.radius * direction;
      return {position, position - way_in_from_rim(shape) * (direction + side_of(k) * axis)};
    }
    default:
      return of_ball(Vec3::Zero(), shape.radius, n);
  }
}

}  // namespace duet
