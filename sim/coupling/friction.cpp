#include "sim/coupling/friction.h"

#include <algorithm>

#include <Eigen/LU>

namespace duet {

// S = K^-1 - (K^-1 n)(K^-1 n)^T / (n.K^-1 n) has no normal part, and for tangential velocities K S is the
// identity up to one.
ContactResponse::ContactResponse(const Mat3& factor, const Vec3& normal)
    : K(factor), normal_mass(1 / normal.dot(factor * normal)) {
  const Mat3 inverse = factor.inverse();
  const Vec3 along = inverse * normal;
  sticking = inverse - along * along.transpose() / along.dot(normal);
}

Vec3 friction_impulse(const FrictionContact& contact, const Vec3& velocity, double target) {
  const Vec3& n = contact.normal;
  const double normal_velocity = velocity.dot(n);
  if (normal_velocity >= target) return Vec3::Zero();

  const double change = target - normal_velocity;  // > 0
  const Mat3& K = contact.response.K;
  const Vec3 Kn = K * n;
  const double nKn = n.dot(Kn);
  if (contact.friction > 0) {
    const Vec3 sticking = K.inverse() * (target * n - velocity);
    const double normal_part = sticking.dot(n);
    if (normal_part > 0 && (sticking - normal_part * n).norm() <= contact.friction * normal_part)
      return sticking;

    const Vec3 tangential = velocity - normal_velocity * n;
    const double speed = tangential.norm();
    if (speed > 0) {
      const Vec3 direction = n - contact.friction / speed * tangential;
      const double response = n.dot(K * direction);
      // For large friction on an eccentric contact the response can vanish: then only the normal part is
      // used.
      if (response > 1e-3 * nKn) return change / response * direction;
    }
  }
  return change / nKn * n;
}

Vec3 limit_energy(const Mat3& K, const Vec3& velocity, const Vec3& impulse) {
  const double quadratic = impulse.dot(K * impulse);
  if (quadratic <= 0) return Vec3::Zero();
  return std::clamp(-2 * impulse.dot(velocity) / quadratic, 0.0, 1.0) * impulse;
}

}  // namespace duet
