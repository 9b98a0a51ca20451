#include "sim/step/composite_body.h"

namespace duet {
namespace {

// Returns the inertia tensor (kg m^2) about the origin of a mass `m` (kg) at `r` (m).
Mat3 inertia_of_point(double m, const Vec3& r) {
  return m * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
}

}  // namespace

Vec3 CompositeBody::arm(const Vec3& x) {
  if (!has_place_) place_ = x;
  has_place_ = true;
  return x - place_;
}

void CompositeBody::add(double m, const Vec3& x, const Vec3& lacking) {
  const Vec3 r = arm(x);
  moments_.mass += m;
  moments_.center += m * r;
  moments_.inertia += inertia_of_point(m, r);
  linear_ += m * lacking;
  angular_ += m * r.cross(lacking);
}

void CompositeBody::add_turning(const Mat3& inertia, const Vec3& lacking) {
  moments_.inertia += inertia;
  angular_ += inertia * lacking;
}

void CompositeBody::add_moment(const Vec3& x, const Vec3& impulse) { angular_ += arm(x).cross(impulse); }

void CompositeBody::finish() {
  if (!(moments_.mass > 0)) return;
  moments_.center /= moments_.mass;
  moments_.inertia -= inertia_of_point(moments_.mass, moments_.center);
  angular_ -= moments_.center.cross(linear_);
  velocity_ = linear_ / moments_.mass;
  turn_ = angular_velocity_of(moments_, angular_);
}

}  // namespace duet
