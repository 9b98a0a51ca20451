#include "sim/geometry/level_set.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace duet {
namespace {

int largest_component(const Vec3& v) {
  int axis = 0;
  v.maxCoeff(&axis);
  return axis;
}

// Excess of |x| over the half sizes: positive components are outside of that pair of faces.
double box_distance(const Vec3& half, const Vec3& x) {
  const Vec3 excess = x.cwiseAbs() - half;
  const double inside = excess.maxCoeff();
  return inside <= 0 ? inside : excess.cwiseMax(0).norm();
}

Vec3 box_normal(const Vec3& half, const Vec3& x) {
  const Vec3 excess = x.cwiseAbs() - half;
  const int axis = largest_component(excess);
  Vec3 normal = excess[axis] <= 0 ? Vec3::Unit(axis) : Vec3(excess.cwiseMax(0).normalized());
  for (int i = 0; i < 3; ++i) normal[i] = std::copysign(normal[i], x[i]);
  return normal;
}

}  // namespace

double LevelSet::distance(const Vec3& x) const {
  switch (kind) {
    case Kind::sphere:
      return x.norm() - radius;
    case Kind::box:
      return box_distance(half, x);
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
    case Kind::half_space:
      return Vec3::UnitY();
  }
  return Vec3::UnitY();
}

double LevelSet::bounding_radius() const {
  switch (kind) {
    case Kind::sphere:
      return radius;
    case Kind::box:
      return half.norm();
    case Kind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

Vec3 LevelSet::lower() const { return kind == Kind::sphere ? Vec3(Vec3::Constant(-radius)) : Vec3(-half); }

double LevelSet::smallest_size() const {
  switch (kind) {
    case Kind::sphere:
      return 2 * radius;
    case Kind::box:
      return 2 * half.minCoeff();
    case Kind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

double volume(const LevelSet& shape) {
  switch (shape.kind) {
    case LevelSet::Kind::sphere:
      return 4.0 / 3.0 * std::numbers::pi * shape.radius * shape.radius * shape.radius;
    case LevelSet::Kind::box:
      return 8 * shape.half.prod();
    case LevelSet::Kind::half_space:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

Vec3 unit_inertia(const LevelSet& shape) {
  if (shape.kind == LevelSet::Kind::sphere) return Vec3::Constant(0.4 * shape.radius * shape.radius);
  const Vec3 squares = shape.half.cwiseAbs2() / 3;
  return Vec3(squares.y() + squares.z(), squares.z() + squares.x(), squares.x() + squares.y());
}

}  // namespace duet
