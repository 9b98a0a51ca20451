#include "sim/base/rotation.h"

namespace duet {

// By half the angle, with the unit vector h in the middle of unit vectors a and b: q = (a . h, a x h).
Quat shortest_turn(const Vec3& from, const Vec3& to) {
  // Directions whose sum is shorter are opposite: h has lost half of its digits.
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
