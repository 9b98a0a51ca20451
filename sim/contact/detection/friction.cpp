#include "sim/contact/detection/friction.h"

#include <algorithm>

#include <Eigen/LU>

namespace duet {

// sticking = T (T^T K T)^-1 T^T, where the columns of T are two unit tangents of the contact. For tangential
// velocities, K times this matrix is the identity up to a normal part. The inverse of a symmetric 2 x 2
// matrix is that matrix, turned by 90 degrees about the normal n, over its determinant. Here the determinant
// is n . cof(K) n.
void ContactResponse::find_sticking() const {
  const Vec3& n = normal_;
  const Vec3 a = K.col(0), b = K.col(1), c = K.col(2);
  const double determinant = n.dot(n[0] * b.cross(c) + n[1] * c.cross(a) + n[2] * a.cross(b));
  Mat3 turned;  // n x K
  turned << n.cross(a), n.cross(b), n.cross(c);
  const Mat3 back = turned.transpose() / determinant;
  sticking_ << n.cross(back.col(0)), n.cross(back.col(1)), n.cross(back.col(2));
  knows_sticking_ = true;
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
      // With large friction on an eccentric contact the response can vanish. Below this fraction of that of a
      // normal impulse, only the normal impulse is used: a smaller one would let the impulse grow as far
      // beyond that of a contact without friction.
      constexpr double min_response = 1e-3;
      if (response > min_response * nKn) return change / response * direction;
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
