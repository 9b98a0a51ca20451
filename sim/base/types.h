// Eigen aliases and strong ids used by every module.
#pragma once

#include <compare>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sim/base/eigen_order.h"
#include "sim/base/index.h"

namespace duet {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Quat = Eigen::Quaterniond;
using Vec2f = Eigen::Vector2f;
using Vec3f = Eigen::Vector3f;
using Vec3i = Eigen::Vector3i;

// An index that cannot be mistaken for one of another kind: Id<struct RigidTag> is no Id<struct TetTag>.
template <class Tag>
struct Id {
  std::int32_t index = -1;
  bool valid() const { return index >= 0; }
  auto operator<=>(const Id&) const = default;
};
using RigidId = Id<struct RigidTag>;
using DeformableId = Id<struct DeformableTag>;
using ParticleId = Id<struct ParticleTag>;

// A rigid placement: x_world = orientation * x_body + position.
struct Pose {
  Vec3 position = Vec3::Zero();         // m
  Quat orientation = Quat::Identity();  // unit quaternion, body to world
  Vec3 to_world(const Vec3& x) const { return orientation * x + position; }
  Vec3 to_body(const Vec3& x) const { return orientation.conjugate() * (x - position); }
};

// Cross-product matrix: skew(a) * b = a x b (the paper's a^*).
inline Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

}  // namespace duet
