#include "sim/coupling/contact_point.h"

#include <limits>

#include "sim/coupling/contact_plane.h"

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

Touch touch(const RigidProperties& host, const Pose& host_pose, const RigidProperties& guest,
            const Pose& guest_pose, int sample) {
  Touch result;
  if (sample < 0) {
    // A ball's deepest point lies from its centre against the host's normal there, by its radius.
    const Vec3 center = host_pose.to_body(guest_pose.position);
    result.normal = host_pose.orientation * host.shape.normal(center);
    result.position = guest_pose.position - guest.shape.radius * result.normal;
    result.gap = host.shape.distance(center) - guest.shape.radius;
    return result;
  }
  result.position = guest_pose.to_world(guest.samples[as_index(sample)]);
  const Vec3 inside = guest_pose.to_world(guest.inside[as_index(sample)]);
  const ContactPlane plane =
      contact_plane(host.shape, host_pose.to_body(result.position), host_pose.to_body(inside));
  result.normal = host_pose.orientation * plane.normal;
  result.gap = plane.faces || plane.gap < 0 ? plane.gap : std::numeric_limits<double>::infinity();
  return result;
}

Touch touch(const Bodies& bodies, const ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidProperties& host_properties = bodies.rigid.properties[host];
  const Pose& pose = bodies.rigid.state[host].pose;
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    return touch(host_properties, pose, bodies.rigid.properties[guest], bodies.rigid.state[guest].pose,
                 contact.guest_point);
  }
  const SurfacePoint& point = surface_point(bodies, contact);
  Touch result;
  result.position = weighted(point, bodies.particles.x);
  const Vec3 in_host = pose.to_body(result.position);
  result.normal = pose.orientation * host_properties.shape.normal(in_host);
  result.gap = host_properties.shape.distance(in_host) + point.allowance;
  return result;
}

double gap_now(const Bodies& bodies, const ContactPoint& contact) { return touch(bodies, contact).gap; }

void update_geometry(const Bodies& bodies, ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidState& host_state = bodies.rigid.state[host];
  const RigidProperties& host_properties = bodies.rigid.properties[host];
  const Touch now = touch(bodies, contact);
  const Vec3& x = now.position;
  contact.normal = now.normal;
  contact.gap = now.gap;
  contact.host_arm = x - host_state.pose.position;
  Mat3 K = impulse_factor(host_state, host_properties.inverse_mass, contact.host_arm);
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    contact.guest_arm = x - bodies.rigid.state[guest].pose.position;
    K += impulse_factor(bodies.rigid.state[guest], bodies.rigid.properties[guest].inverse_mass,
                        contact.guest_arm);
  } else {
    K.diagonal().array() += surface_point(bodies, contact).inverse_mass;
  }
  contact.response = ContactResponse(K, contact.normal);
}

}  // namespace duet
