#include "sim/contact/response/impact_delay.h"

namespace duet {

namespace {

// Returns the center of mass at the time `meeting` (s from the beginning of the step), m.
Vec3 center_at(const RigidState& state, double meeting) {
  return state.pose.position + state.delay + meeting * state.velocity;
}

// Lets the host's arm lead where that of the guest does, if both bodies are dynamic. `distance` (m) is that
// of the guest's center from the host's.
void lead_to_guest(const Bodies& bodies, const Vec3& distance, ContactPoint& contact) {
  const auto h = as_index(contact.host), g = as_index(contact.guest_rigid);
  const double of_host = bodies.rigid.properties[h].inverse_mass,
               of_guest = bodies.rigid.properties[g].inverse_mass;
  if (of_host == 0 || of_guest == 0) return;
  contact.host_arm = contact.guest_arm + distance;
  contact.response = ContactResponse(impulse_factor(bodies.rigid.state[h], of_host, contact.host_arm) +
                                         impulse_factor(bodies.rigid.state[g], of_guest, contact.guest_arm),
                                     contact.normal);
}

}  // namespace

bool is_delayed(const Bodies& bodies, const ContactPoint& contact) {
  const auto h = as_index(contact.host), g = as_index(contact.guest_rigid);
  const auto has_delay = [&](std::size_t body) { return !bodies.rigid.state[body].delay.isZero(0); };
  const RigidProperties &host = bodies.rigid.properties[h], &guest = bodies.rigid.properties[g];
  const bool is_with_ball = host.is_ball() || guest.is_ball();
  return (is_with_ball && host.is_dynamic() && guest.is_dynamic()) || has_delay(h) || has_delay(g);
}

void put_at_meeting(const Bodies& bodies, double meeting, ContactPoint& contact) {
  const RigidState &host = bodies.rigid.state[as_index(contact.host)],
                   &guest = bodies.rigid.state[as_index(contact.guest_rigid)];
  lead_to_guest(bodies, center_at(guest, meeting) - center_at(host, meeting), contact);
}

void put_at_start(const Bodies& bodies, ContactPoint& contact) {
  const RigidState &host = bodies.rigid.state[as_index(contact.host)],
                   &guest = bodies.rigid.state[as_index(contact.guest_rigid)];
  lead_to_guest(bodies, guest.pose.position - host.pose.position, contact);
}

void delay_impulse(Bodies& bodies, const ContactPoint& contact, double meeting, const Vec3& impulse) {
  const auto delay = [&](int body, const Vec3& j) {
    const auto b = as_index(body);
    bodies.rigid.state[b].delay -= meeting * bodies.rigid.properties[b].inverse_mass * j;
  };
  delay(contact.guest_rigid, impulse);
  delay(contact.host, -impulse);
}

Vec3 delayed_moment(const Bodies& bodies, const ContactPoint& contact, double meeting, const Vec3& impulse) {
  const auto h = as_index(contact.host), g = as_index(contact.guest_rigid);
  const RigidState &host = bodies.rigid.state[h], &guest = bodies.rigid.state[g];
  if (!bodies.rigid.properties[h].is_dynamic())
    return (center_at(guest, meeting) + contact.guest_arm - host.pose.position - contact.host_arm)
        .cross(impulse);
  if (!bodies.rigid.properties[g].is_dynamic())
    return (host.pose.position - center_at(host, meeting)).cross(impulse);
  return Vec3::Zero();
}

}  // namespace duet
