// Symmetric 3x3 matrices, one a particle.
#pragma once

#include "sim/base/types.h"

namespace duet {

struct SymmetricBlock {
  Vec3 diagonal = Vec3::Zero();
  Vec3 other = Vec3::Zero();  // yz, xz, xy

  Vec3 operator*(const Vec3& v) const {
    return diagonal.cwiseProduct(v) + Vec3(other.z() * v.y() + other.y() * v.z(),
                                           other.z() * v.x() + other.x() * v.z(),
                                           other.y() * v.x() + other.x() * v.y());
  }
  // Of a positive definite one.
  SymmetricBlock inverse() const {
    const Vec3& d = diagonal;
    const Vec3& o = other;
    SymmetricBlock adjugate;
    adjugate.diagonal =
        Vec3(d.y() * d.z() - o.x() * o.x(), d.x() * d.z() - o.y() * o.y(), d.x() * d.y() - o.z() * o.z());
    adjugate.other =
        Vec3(o.y() * o.z() - o.x() * d.x(), o.x() * o.z() - o.y() * d.y(), o.x() * o.y() - o.z() * d.z());
    const double determinant =
        d.x() * adjugate.diagonal.x() + o.z() * adjugate.other.z() + o.y() * adjugate.other.y();
    adjugate.diagonal /= determinant;
    adjugate.other /= determinant;
    return adjugate;
  }
};

}  // namespace duet
