// One projected Gauss-Seidel update of a contact point with Coulomb friction: what collisions, the contact
// solve and shock propagation share.
#pragma once

#include <algorithm>
#include <limits>

#include "sim/contact/detection/contact_point.h"

namespace duet {

// The tangential impulse (N s) that removes the tangential part of `velocity`, or as much of it as an impulse
// within the friction cone over `normal_impulse` can.
inline Vec3 updated_friction(const ContactPoint& contact, const ContactResponse& response,
                             const Vec3& tangential_impulse, const Vec3& velocity, double normal_impulse) {
  const double most = contact.friction * normal_impulse;
  const Vec3 sticking = tangential_impulse - response.sticking * velocity;
  if (sticking.squaredNorm() <= most * most) return sticking;
  if (most == 0) return Vec3::Zero();
  // Sliding: a step down the dissipation, short enough for any direction, and back onto the cone.
  const double step = 1 / (response.K.trace() - 1 / response.normal_mass);
  const Vec3 sliding = tangential_impulse - step * (velocity - velocity.dot(contact.normal) * contact.normal);
  const double length = sliding.norm();
  return length > most ? Vec3(most / length * sliding) : sliding;
}

// Whether two bodies hold the guest between them by friction, see pinching.h.
inline bool is_pinched_fast(const ContactPoint& contact) {
  return contact.yielded > 0 && contact.friction > 0;
}

// The normal impulse (N s) that a contact had, what it should be so that the normal velocity reaches
// contact.target unless that would need a pull, and the tangential impulse that it has.
struct NormalUpdate {
  double before = 0, now = 0;
  Vec3 tangential = Vec3::Zero();
};
inline NormalUpdate updated_normal(const ContactPoint& contact, const ContactResponse& response,
                                   const Vec3& velocity) {
  const Vec3& n = contact.normal;
  const double before = contact.impulse.dot(n);
  const double now = std::max(0.0, before + response.normal_mass * (contact.target - velocity.dot(n)));
  return {before, now, contact.impulse - before * n};
}

// The impulse (N s) that the contact should have, for its relative velocity (m/s) under the one it has: first
// along the normal, then friction on what the normal impulse now is.
inline Vec3 updated_impulse(const ContactPoint& contact, const ContactResponse& response,
                            const Vec3& velocity) {
  const Vec3& n = contact.normal;
  const auto [before, now, tangential] = updated_normal(contact, response, velocity);
  const double pressed = is_pinched_fast(contact) ? std::numeric_limits<double>::infinity() : now;
  return now * n + updated_friction(contact, response, tangential,
                                    velocity + (now - before) * (response.K * n), pressed);
}

// The same along the normal alone: friction stays as it is, within the cone over the new normal impulse.
inline Vec3 updated_pressure(const ContactPoint& contact, const ContactResponse& response,
                             const Vec3& velocity) {
  const auto [before, now, tangential] = updated_normal(contact, response, velocity);
  const double friction = tangential.norm(), most = contact.friction * now;
  return now * contact.normal + (friction > most ? Vec3(most / friction * tangential) : tangential);
}

}  // namespace duet
