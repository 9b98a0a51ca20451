#include "sim/coupling/contact_point.h"

#include <Eigen/LU>

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void apply_angular_impulse(RigidState& state, const RigidProperties& properties, const Vec3& moment) {
  if (properties.is_static()) return;
  state.angular_momentum += moment;
  state.angular_velocity += state.inverse_inertia * moment;
}

void apply_impulse(RigidState& state, const RigidProperties& properties, const Vec3& arm,
                   const Vec3& impulse) {
  if (properties.is_static()) return;
  state.velocity += properties.inverse_mass * impulse;
  apply_angular_impulse(state, properties, arm.cross(impulse));
}

Mat3 impulse_factor(const RigidState& state, double inverse_mass, const Vec3& arm) {
  const Mat3 cross = skew(arm);
  return inverse_mass * Mat3::Identity() - cross * state.inverse_inertia * cross;
}

Vec3 relative_velocity(const Bodies& bodies, const ContactPoint& contact) {
  const Vec3 guest =
      contact.is_rigid_pair()
          ? point_velocity(bodies.rigid.state[as_index(contact.guest_rigid)], contact.guest_arm)
          : weighted(surface_point(bodies, contact), bodies.particles.v);
  return guest - point_velocity(bodies.rigid.state[as_index(contact.host)], contact.host_arm);
}

void apply_impulse(Bodies& bodies, const ContactPoint& contact, const Vec3& impulse) {
  const auto host = as_index(contact.host);
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    apply_impulse(bodies.rigid.state[guest], bodies.rigid.properties[guest], contact.guest_arm, impulse);
  } else {
    apply_impulse(surface_point(bodies, contact), impulse, bodies.particles);
  }
  apply_impulse(bodies.rigid.state[host], bodies.rigid.properties[host], contact.host_arm, -impulse);
}

Vec3 guest_position(const Bodies& bodies, const ContactPoint& contact) {
  if (!contact.is_rigid_pair()) return weighted(surface_point(bodies, contact), bodies.particles.x);
  const auto guest = as_index(contact.guest_rigid);
  const Pose& pose = bodies.rigid.state[guest].pose;
  if (contact.guest_point >= 0)
    return pose.to_world(bodies.rigid.properties[guest].samples[as_index(contact.guest_point)]);
  // A ball's deepest point lies from its centre against the host's normal there, by its radius.
  const Pose& host = bodies.rigid.state[as_index(contact.host)].pose;
  const LevelSet& shape = bodies.rigid.properties[as_index(contact.host)].shape;
  const Vec3 normal = host.orientation * shape.normal(host.to_body(pose.position));
  return pose.position - bodies.rigid.properties[guest].shape.radius * normal;
}

double gap_now(const Bodies& bodies, const ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const Vec3 in_host = bodies.rigid.state[host].pose.to_body(guest_position(bodies, contact));
  const double distance = bodies.rigid.properties[host].shape.distance(in_host);
  return contact.is_rigid_pair() ? distance : distance + surface_point(bodies, contact).allowance;
}

void update_geometry(const Bodies& bodies, ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidState& host_state = bodies.rigid.state[host];
  const RigidProperties& host_properties = bodies.rigid.properties[host];
  const Vec3 x = guest_position(bodies, contact);
  const Vec3 in_host = host_state.pose.to_body(x);
  contact.normal = host_state.pose.orientation * host_properties.shape.normal(in_host);
  contact.gap = host_properties.shape.distance(in_host);
  contact.host_arm = x - host_state.pose.position;
  contact.K = impulse_factor(host_state, host_properties.inverse_mass, contact.host_arm);
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    contact.guest_arm = x - bodies.rigid.state[guest].pose.position;
    contact.K += impulse_factor(bodies.rigid.state[guest], bodies.rigid.properties[guest].inverse_mass,
                                contact.guest_arm);
  } else {
    const SurfacePoint& point = surface_point(bodies, contact);
    contact.gap += point.allowance;
    contact.K.diagonal().array() += point.inverse_mass;
  }
  contact.inverse_K = contact.K.inverse();
}

}  // namespace duet
