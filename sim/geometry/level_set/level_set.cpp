#include "sim/geometry/level_set/level_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/elementary.h"
#include "sim/geometry/level_set/grid_level_set.h"

namespace duet {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns whether a point outside of a box is above a face of it, given its excess (see box_distance()) and
// the largest component of that. Its distance is then the excess, and its normal that of the face, to the
// last bit: the square root of a square is exact as long as the square is in the range of doubles.
bool is_above_face(const Vec3& excess, double largest) {
  constexpr double least = 1e-150, most = 1e150;  // m, whose squares are in that range
  return largest > least && largest < most && (excess.array() > 0).count() == 1;
}

// The excess of |x| over the half sizes is positive along the axes on which `x` lies outside of that pair of
// faces.
double box_distance(const Vec3& half, const Vec3& x) {
  const Vec3 excess = x.cwiseAbs() - half;
  const double largest = excess.maxCoeff();
  return largest <= 0 || is_above_face(excess, largest) ? largest : excess.cwiseMax(0).norm();
}

Vec3 box_normal(const Vec3& half, const Vec3& x) {
  const Vec3 excess = x.cwiseAbs() - half;
  int axis = 0;
  double largest = excess[0];
  for (const int other : {1, 2})
    if (excess[other] > largest) largest = excess[axis = other];
  const Vec3 size = largest <= 0 || is_above_face(excess, largest) ? Vec3(axis == 0, axis == 1, axis == 2)
                                                                   : Vec3(excess.cwiseMax(0).normalized());
  return {std::copysign(size.x(), x.x()), std::copysign(size.y(), x.y()), std::copysign(size.z(), x.z())};
}

// Returns the distance from the axis y.
double to_axis(const Vec3& x) { return std::sqrt(x.x() * x.x() + x.z() * x.z()); }

// Returns the unit direction away from the axis y; (1, 0, 0) on the axis, where all directions are alike.
Vec3 radial(const Vec3& x, double distance_to_axis) {
  return distance_to_axis > 0 ? Vec3(x.x() / distance_to_axis, 0, x.z() / distance_to_axis)
                              : Vec3(Vec3::UnitX());
}

// Returns the part of y beyond the straight part of a capsule, with its sign; 0 beside that part.
double beyond_ends(double half_length, double y) {
  return std::copysign(std::max(std::abs(y) - half_length, 0.0), y);
}

double capsule_distance(double radius, double half_length, const Vec3& x) {
  const double y = beyond_ends(half_length, x.y());
  return std::sqrt(x.x() * x.x() + y * y + x.z() * x.z()) - radius;
}

Vec3 capsule_normal(double half_length, const Vec3& x) {
  const Vec3 away(x.x(), beyond_ends(half_length, x.y()), x.z());
  const double length = away.norm();
  return length > 0 ? Vec3(away / length) : Vec3(Vec3::UnitX());
}

// A cylinder is a rectangle, and a torus a circle, in the half plane through the axis and `x`.
double cylinder_distance(double radius, double half_length, const Vec3& x) {
  const Vec2 excess(to_axis(x) - radius, std::abs(x.y()) - half_length);
  const double inside = excess.maxCoeff();
  return inside <= 0 ? inside : excess.cwiseMax(0).norm();
}

Vec3 cylinder_normal(double radius, double half_length, const Vec3& x) {
  const double rho = to_axis(x);
  const Vec2 excess(rho - radius, std::abs(x.y()) - half_length);
  Vec2 normal = excess.x() > excess.y() ? Vec2::UnitX() : Vec2::UnitY();
  if (excess.maxCoeff() > 0) normal = excess.cwiseMax(0).normalized();
  return normal.x() * radial(x, rho) + Vec3(0, std::copysign(normal.y(), x.y()), 0);
}

Vec3 torus_normal(double radius, const Vec3& x) {
  const double rho = to_axis(x);
  const Vec2 from_line(rho - radius, x.y());
  const double length = from_line.norm();
  if (length == 0) return Vec3::UnitY();
  return (from_line.x() / length) * radial(x, rho) + Vec3(0, from_line.y() / length, 0);
}

}  // namespace

double LevelSet::distance(const Vec3& x) const {
  switch (kind) {
    case Kind::sphere:
      return x.norm() - radius;
    case Kind::box:
      return box_distance(half, x);
    case Kind::capsule:
      return capsule_distance(radius, half_length, x);
    case Kind::cylinder:
      return cylinder_distance(radius, half_length, x);
    case Kind::torus:
      return Vec2(to_axis(x) - radius, x.y()).norm() - tube;
    case Kind::grid:
      return grid->distance(x);
    case Kind::half_space:
      return x.y();
  }
  return 0;
}

Vec3 LevelSet::normal(const Vec3& x) const {
  switch (kind) {
    case Kind::sphere: {
      const double length = x.norm();
      return length > 0 ? Vec3(x / length) : Vec3(Vec3::UnitY());
    }
    case Kind::box:
      return box_normal(half, x);
    case Kind::capsule:
      return capsule_normal(half_length, x);
    case Kind::cylinder:
      return cylinder_normal(radius, half_length, x);
    case Kind::torus:
      return torus_normal(radius, x);
    case Kind::grid:
      return grid->normal(x);
    case Kind::half_space:
      return Vec3::UnitY();
  }
  return Vec3::UnitY();
}

SignedDistance LevelSet::exact(const Vec3& x) const {
  return kind == Kind::grid ? grid->exact().at(x) : SignedDistance{distance(x), normal(x)};
}

double LevelSet::exact_distance(const Vec3& x, double at_most) const {
  return kind == Kind::grid ? grid->exact().distance(x, at_most) : distance(x);
}

double LevelSet::tolerance() const { return kind == Kind::grid ? grid->grid().spacing : 0; }

double LevelSet::bounding_radius() const {
  switch (kind) {
    case Kind::sphere:
      return radius;
    case Kind::box:
      return half.norm();
    case Kind::capsule:
      return half_length + radius;
    case Kind::cylinder:
      return math::hypot(radius, half_length);
    case Kind::torus:
      return radius + tube;
    case Kind::grid:
      return grid->bounding_radius();
    case Kind::half_space:
      break;
  }
  return infinity;
}

Vec3 LevelSet::upper() const {
  switch (kind) {
    case Kind::sphere:
      return Vec3::Constant(radius);
    case Kind::box:
      return half;
    case Kind::capsule:
      return {radius, half_length + radius, radius};
    case Kind::cylinder:
      return {radius, half_length, radius};
    case Kind::torus:
      return {radius + tube, tube, radius + tube};
    case Kind::grid:
      return grid->upper();
    case Kind::half_space:
      break;
  }
  return Vec3::Constant(infinity);
}

Vec3 LevelSet::lower() const { return kind == Kind::grid ? grid->lower() : Vec3(-upper()); }

double LevelSet::min_size() const {
  switch (kind) {
    case Kind::sphere:
    case Kind::capsule:
      return 2 * radius;
    case Kind::box:
      return 2 * half.minCoeff();
    case Kind::cylinder:
      return 2 * std::min(radius, half_length);
    case Kind::torus:
      return 2 * tube;
    case Kind::grid:
      return grid->thickness();
    case Kind::half_space:
      break;
  }
  return infinity;
}

double volume(const LevelSet& shape) {
  using std::numbers::pi;
  const double r = shape.radius, length = 2 * shape.half_length;
  switch (shape.kind) {
    case LevelSet::Kind::sphere:
      return 4.0 / 3.0 * pi * r * r * r;
    case LevelSet::Kind::box:
      return 8 * shape.half.prod();
    case LevelSet::Kind::capsule:
      return pi * r * r * (length + 4.0 / 3.0 * r);
    case LevelSet::Kind::cylinder:
      return pi * r * r * length;
    case LevelSet::Kind::torus:
      return 2 * pi * pi * r * shape.tube * shape.tube;
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  return infinity;
}

Vec3 unit_inertia(const LevelSet& shape) {
  const double r2 = shape.radius * shape.radius, length = 2 * shape.half_length;
  const auto about_y = [](double along, double across) { return Vec3(across, along, across); };
  switch (shape.kind) {
    case LevelSet::Kind::sphere:
      return Vec3::Constant(0.4 * r2);
    case LevelSet::Kind::box: {
      const Vec3 squares = shape.half.cwiseAbs2() / 3;
      return {squares.y() + squares.z(), squares.z() + squares.x(), squares.x() + squares.y()};
    }
    case LevelSet::Kind::capsule: {
      // The ends are two half balls, whose centers of mass lie 3/8 of the radius off their flat faces.
      const double r = shape.radius, ends = 4.0 / 3.0 * r / (length + 4.0 / 3.0 * r), middle = 1 - ends;
      const double end_across = 0.4 * r2 + length * length / 4 + 3.0 / 8.0 * length * r;
      return about_y(middle * r2 / 2 + ends * 0.4 * r2,
                     middle * (r2 / 4 + length * length / 12) + ends * end_across);
    }
    case LevelSet::Kind::cylinder:
      return about_y(r2 / 2, r2 / 4 + length * length / 12);
    case LevelSet::Kind::torus: {
      const double tube2 = shape.tube * shape.tube;
      return about_y(r2 + 0.75 * tube2, r2 / 2 + 0.625 * tube2);
    }
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  return Vec3::Constant(infinity);
}

}  // namespace duet
