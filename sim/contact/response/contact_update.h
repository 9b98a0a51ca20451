// One projected Gauss-Seidel update of a contact point with Coulomb friction, which collisions, the contact
// solve and shock propagation share.
#pragma once

#include <algorithm>
#include <limits>

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Returns the tangential impulse (N s) that removes the tangential part of `velocity`, or as much of it as
/// the friction cone allows: |p_t| <= mu p_n. `velocity` (m/s) is the relative velocity under the impulses
/// `tangential_impulse` and `normal_impulse` (N s). A contact that slides moves by one step down the
/// dissipation and back onto the cone.
inline Vec3 updated_friction(const ContactPoint& contact, const ContactResponse& response,
                             const Vec3& tangential_impulse, const Vec3& velocity, double normal_impulse) {
  const double most = contact.friction * normal_impulse;
  const Vec3 sticking = tangential_impulse - response.sticking() * velocity;
  if (sticking.squaredNorm() <= most * most) return sticking;
  if (most == 0) return Vec3::Zero();
  // The trace of K less its normal part bounds the largest tangential eigenvalue, so that the step is stable
  // in any direction.
  const double step = 1 / (response.K.trace() - 1 / response.normal_mass);
  const Vec3 sliding = tangential_impulse - step * (velocity - velocity.dot(contact.normal) * contact.normal);
  const double length = sliding.norm();
  return length > most ? Vec3(most / length * sliding) : sliding;
}

/// Returns whether two bodies without finite mass pinch the guest and hold it by friction, see
/// yield_where_pinched().
inline bool is_pinched_fast(const ContactPoint& contact) {
  return contact.is_pinched && contact.friction > 0;
}

/// An update of the normal impulse of a contact.
struct NormalUpdate {
  double before = 0,               ///< Normal impulse before the update, N s.
      now = 0;                     ///< Normal impulse after the update, N s, at least 0.
  Vec3 tangential = Vec3::Zero();  ///< Tangential impulse, which the update keeps, N s.
};
/// Computes p_n <- max(0, p_n + m_n (target - u.n)): the normal impulse after which the normal velocity is
/// contact.target, or 0 if that would need a pull. `velocity` is the relative velocity u (m/s) under
/// contact.impulse.
inline NormalUpdate updated_normal(const ContactPoint& contact, const ContactResponse& response,
                                   const Vec3& velocity) {
  const Vec3& n = contact.normal;
  const double before = contact.impulse.dot(n);
  const double now = std::max(0.0, before + response.normal_mass * (contact.target - velocity.dot(n)));
  return {before, now, contact.impulse - before * n};
}

/// Returns the impulse (N s) that a contact should have, given its relative `velocity` (m/s) under the
/// impulse that it has. The normal impulse is updated first, then friction under the new normal impulse. A
/// contact that is pinched fast has no bound of friction.
inline Vec3 updated_impulse(const ContactPoint& contact, const ContactResponse& response,
                            const Vec3& velocity) {
  const Vec3& n = contact.normal;
  const auto [before, now, tangential] = updated_normal(contact, response, velocity);
  const double pressed = is_pinched_fast(contact) ? std::numeric_limits<double>::infinity() : now;
  return now * n + updated_friction(contact, response, tangential,
                                    velocity + (now - before) * (response.K * n), pressed);
}

/// Returns the impulse (N s) that a contact should have if only its normal impulse is updated. Friction stays
/// as it is, except that it is cut to the cone of the new normal impulse.
inline Vec3 updated_pressure(const ContactPoint& contact, const ContactResponse& response,
                             const Vec3& velocity) {
  const auto [before, now, tangential] = updated_normal(contact, response, velocity);
  const double friction = tangential.norm(), most = contact.friction * now;
  return now * contact.normal + (friction > most ? Vec3(most / friction * tangential) : tangential);
}

}  // namespace duet
