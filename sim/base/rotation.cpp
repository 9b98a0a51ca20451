#include "sim/base/rotation.h"

#include "sim/base/assert.h"

namespace duet {

// q = (a . h, a x h), where h is the unit vector halfway between the unit vectors a and b.
Quat shortest_rotation(const Vec3& from, const Vec3& to) {
  DUET_ASSERT(from != Vec3::Zero() && to != Vec3::Zero());
  // Length of a + b below which the directions count as opposite: h has then lost half of its digits.
  constexpr double opposite = 1e-8;
  const Vec3 a = from.normalized(), b = to.normalized(), sum = a + b;
  if (sum.norm() > opposite) {
    const Vec3 middle = sum.normalized(), axis = a.cross(middle);
    return Quat(a.dot(middle), axis.x(), axis.y(), axis.z()).normalized();
  }
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(a[i]) < std::abs(a[least])) least = i;
  const Vec3 axis = a.cross(Vec3::Unit(least)).normalized();
  return Quat(0, axis.x(), axis.y(), axis.z());
}

}  // namespace duet
