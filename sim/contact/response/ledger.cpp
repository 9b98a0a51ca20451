#include "sim/contact/response/ledger.h"

#include <algorithm>

#include <Eigen/Geometry>

#include "sim/base/rotation.h"

namespace duet {
namespace {

// Adds a linear momentum (kg m/s) at `x` (m), and its moment about the origin.
void add_at(Momentum& total, const Vec3& x, const Vec3& linear) {
  total.linear += linear;
  total.angular += x.cross(linear);
}

// Returns the position of a contact in the world, m.
Vec3 contact_place(const Bodies& bodies, const ContactPoint& contact) {
  return bodies.rigid.state[as_index(contact.host)].pose.position + contact.host_arm;
}

// Adds what the held particles of a contact's guest give to others: they take their fraction of the impulse
// up, so that the body does not get it.
void add_pinned(const Bodies& bodies, const ContactPoint& contact, Momentum& total) {
  if (contact.is_rigid_pair()) return;
  const SurfacePoint& point = surface_point(bodies, contact);
  for (std::size_t k = 0; k < as_index(point.count); ++k) {
    const auto p = as_index(point.particle[k]);
    if (bodies.particles.inverse_mass[p] == 0)
      add_at(total, bodies.particles.x[p], -point.weight[k] * contact.impulse);
  }
}

}  // namespace

Momentum& operator+=(Momentum& a, const Momentum& b) {
  a.linear += b.linear;
  a.angular += b.angular;
  return a;
}

Momentum operator-(const Momentum& a, const Momentum& b) {
  return {a.linear - b.linear, a.angular - b.angular};
}

void LedgerEntry::add(const Momentum& gain, const Momentum& from_outside) {
  gained += gain;
  external += from_outside;
  const Momentum defect = gain - from_outside;
  linear_defect = std::max(linear_defect, defect.linear.norm());
  angular_defect = std::max(angular_defect, defect.angular.norm());
}

void DisplacementEntry::add(const Momentum& step) {
  moved += step;
  linear_largest = std::max(linear_largest, step.linear.norm());
  angular_largest = std::max(angular_largest, step.angular.norm());
}

Momentum momentum(const Bodies& bodies, const std::vector<Vec3>& x) {
  Momentum total;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.inverse_mass[p] > 0) add_at(total, x[p], particles.mass[p] * particles.v[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidState& state = bodies.rigid.state[i];
    add_at(total, state.pose.position, bodies.rigid.properties[i].mass * state.velocity);
    total.angular += state.angular_momentum;
  }
  return total;
}

Momentum gravity_impulse(const Bodies& bodies, const std::vector<Vec3>& x, const Vec3& gravity, double dt) {
  Momentum total;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.inverse_mass[p] > 0) add_at(total, x[p], dt * particles.mass[p] * gravity);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    add_at(total, bodies.rigid.state[i].pose.position, dt * bodies.rigid.properties[i].mass * gravity);
  return total;
}

Momentum contact_impulse(const Bodies& bodies, const ContactSet& contacts, const std::vector<int>& pairs) {
  Momentum total;
  const auto& properties = bodies.rigid.properties;
  for (int p : pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i) add_pinned(bodies, contacts.points[as_index(i)], total);
    const bool by_host = !properties[as_index(pair.host)].is_dynamic();
    const bool by_guest = pair.guest_rigid >= 0 && !properties[as_index(pair.guest_rigid)].is_dynamic();
    if (by_host == by_guest) continue;  // both bodies have finite mass, or neither can get an impulse
    const double sign = by_host ? 1 : -1;
    total.angular += sign * pair.angular_impulse;
    for (int i = pair.begin; i < pair.end; ++i) {
      // Contacts of one pair may be seen from either body, and the impulse is on the guest of the contact.
      const ContactPoint& contact = contacts.points[as_index(i)];
      const double towards_guest = properties[as_index(contact.host)].is_dynamic() ? -1 : 1;
      add_at(total, contact_place(bodies, contact), towards_guest * contact.impulse);
    }
  }
  return total;
}

Momentum displacement(const Bodies& bodies, const std::vector<Vec3>& x,
                      const std::vector<RigidState>& rigid) {
  Momentum total;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.inverse_mass[p] > 0) add_at(total, x[p], particles.mass[p] * (particles.x[p] - x[p]));
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if (!properties.is_dynamic()) continue;
    const Pose &before = rigid[i].pose, &now = bodies.rigid.state[i].pose;
    add_at(total, before.position, properties.mass * (now.position - before.position));
    const Vec3 turn = logarithm(now.orientation * before.orientation.conjugate());
    const Mat3 rotation = before.orientation.toRotationMatrix();
    total.angular += rotation * properties.inertia.asDiagonal() * rotation.transpose() * turn;
  }
  return total;
}

}  // namespace duet
