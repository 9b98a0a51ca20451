#include "sim/coupling/contact_point.h"

#include <limits>

#include "sim/coupling/contact_plane.h"
#include "sim/coupling/deepest_point.h"

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

Mat3 impulse_factor(const RigidState& state, double inverse_mass, const Vec3& arm) {
  const Mat3 cross = skew(arm);
  return inverse_mass * Mat3::Identity() - cross * state.inverse_inertia * cross;
}

Touch touch(const RigidProperties& host, const Pose& host_pose, const RigidProperties& guest,
            const Pose& guest_pose, int sample) {
  const Pose in_host{host_pose.to_body(guest_pose.position),
                     host_pose.orientation.conjugate() * guest_pose.orientation};
  const DeepestPoint point = sample < 0 ? deepest_point(guest.shape, -1 - sample, in_host, host.shape)
                                        : DeepestPoint{in_host.to_world(guest.samples[as_index(sample)]),
                                                       in_host.to_world(guest.inside[as_index(sample)])};
  const ContactPlane plane = contact_plane(host.shape, point.position, point.inside);
  Touch result;
  result.position = host_pose.to_world(point.position);
  result.normal = host_pose.orientation * plane.normal;
  result.gap = plane.faces || plane.gap < 0 ? plane.gap : std::numeric_limits<double>::infinity();
  return result;
}

namespace {

// Of a deformable guest's point at `x` (m).
Touch touch(const RigidProperties& host, const Pose& host_pose, const SurfacePoint& point, const Vec3& x) {
  const Vec3 in_host = host_pose.to_body(x);
  return {x, host_pose.orientation * host.shape.normal(in_host),
          host.shape.distance(in_host) + point.allowance};
}

}  // namespace

Touch touch(const Bodies& bodies, const ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidProperties& properties = bodies.rigid.properties[host];
  const Pose& pose = bodies.rigid.state[host].pose;
  if (!contact.is_rigid_pair()) {
    const SurfacePoint& point = surface_point(bodies, contact);
    return touch(properties, pose, point, weighted(point, bodies.particles.x));
  }
  const auto guest = as_index(contact.guest_rigid);
  return touch(properties, pose, bodies.rigid.properties[guest], bodies.rigid.state[guest].pose,
               contact.guest_point);
}

Touch predicted_touch(const Bodies& bodies, const std::vector<Pose>& predicted, double dt,
                      const ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidProperties& properties = bodies.rigid.properties[host];
  if (!contact.is_rigid_pair()) {
    const SurfacePoint& point = surface_point(bodies, contact);
    const Vec3 x = weighted(point, bodies.particles.x) + dt * weighted(point, bodies.particles.v);
    return touch(properties, predicted[host], point, x);
  }
  const auto guest = as_index(contact.guest_rigid);
  return touch(properties, predicted[host], bodies.rigid.properties[guest], predicted[guest],
               contact.guest_point);
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
  Mat3 K = Mat3::Zero();
  if (moves_host(bodies, contact))
    K = impulse_factor(host_state, host_properties.inverse_mass, contact.host_arm);
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    contact.guest_arm = x - bodies.rigid.state[guest].pose.position;
    K += impulse_factor(bodies.rigid.state[guest], bodies.rigid.properties[guest].inverse_mass,
                        contact.guest_arm);
  } else {
    K.diagonal().array() += surface_point(bodies, contact).inverse_mass;
  }
  contact.response = ContactResponse(K, contact.normal);
  contact.path_velocity.setZero();
}

}  // namespace duet
