#include "sim/coupling/collisions.h"

#include <cmath>
#include <numeric>

#include "sim/coupling/deepest_touches.h"
#include "sim/coupling/friction.h"

namespace duet {
namespace {

constexpr double inside_tolerance = 1e-6;    // m; particles this near count as inside
constexpr double approach_tolerance = 1e-9;  // m/s; slower approaches are rounding

class Collider {
 public:
  Collider(Bodies& bodies, const VelocityState& difference, double dt, const CollisionSettings& settings,
           ContactSet& contacts, CollisionScratch& scratch)
      : bodies_(bodies),
        difference_(difference),
        dt_(dt),
        settings_(settings),
        contacts_(contacts),
        scratch_(scratch) {
    scratch_.predicted.resize(bodies.rigid.size());
    scratch_.stale.assign(bodies.rigid.size(), 1);
    scratch_.version.assign(bodies.rigid.size() + bodies.deformable.size(), 0);
    scratch_.seen.assign(contacts.pairs.size(), {});
    scratch_.pairs.resize(contacts.pairs.size());
    std::iota(scratch_.pairs.begin(), scratch_.pairs.end(), 0);
    scratch_.schedule.build(bodies, contacts, scratch_.pairs);
    scratch_.sweeps.build(bodies, contacts, scratch_.schedule.order());
    // Pairs that are processed at the same time may share these; no impulse makes them stale again.
    for (std::size_t b = 0; b < bodies.rigid.size(); ++b)
      if (!bodies.rigid.properties[b].is_dynamic()) predicted_pose(static_cast<int>(b));
  }

  // Until a sweep changes nothing.
  void sweep() {
    scratch_.sweeps.repeat(settings_.iterations, 0.5, [&](int p) { return visit(as_index(p)) ? 1.0 : 0.0; });
  }

 private:
  // A pair whose bodies are as they were when a visit changed nothing has nothing to add.
  bool visit(std::size_t p) {
    ContactPair& pair = contacts_.pairs[p];
    const int &host = scratch_.version[as_index(pair.host)],
              &guest = scratch_.version[guest_node(bodies_, pair)];
    CollisionScratch::Seen& seen = scratch_.seen[p];
    if (seen.host == host && seen.guest == guest) return false;
    const bool changed = pair.guest_rigid >= 0 ? collide_rigid(pair) : collide_deformable(pair);
    if (!changed) seen = {host, guest};
    return changed;
  }

  const Pose& predicted_pose(int body) {
    const auto b = as_index(body);
    if (scratch_.stale[b]) {
      const RigidProperties& properties = bodies_.rigid.properties[b];
      RigidState state = bodies_.rigid.state[b];
      state.velocity += difference_.rigid[b];
      rotation_variable(state, properties) += difference_.rotation[b];
      if (properties.is_dynamic()) state.angular_velocity = state.inverse_inertia * state.angular_momentum;
      scratch_.predicted[b] =
          properties.moves() ? evolved_pose(state, dt_, settings_.orientation) : state.pose;
      scratch_.stale[b] = 0;
    }
    return scratch_.predicted[b];
  }

  // Of a rigid pair at the predicted positions.
  Touch predicted_touch(const ContactPoint& contact) {
    return touch(bodies_, contact.host, predicted_pose(contact.host), contact.guest_rigid,
                 predicted_pose(contact.guest_rigid), contact.guest_point, contact.lowest);
  }

  // Signed distance of a deformable guest's point at the predicted positions, m.
  double predicted_distance(const ContactPoint& contact) {
    const RigidProperties& host = bodies_.rigid.properties[as_index(contact.host)];
    const SurfacePoint& point = surface_point(bodies_, contact);
    const Vec3 x = weighted(point, bodies_.particles.x) +
                   dt_ * (weighted(point, bodies_.particles.v) + weighted(point, difference_.particle));
    if (contact.is_on_ridge()) {
      const Pose& pose = predicted_pose(contact.host);
      return (pose.orientation * contact.lowest.normal).dot(x - pose.to_world(contact.lowest.foot)) +
             point.allowance;
    }
    return host.shape.distance(predicted_pose(contact.host).to_body(x)) + point.allowance;
  }

  // Acceleration of guest towards host by the forces and motions of the step, m/s^2.
  double approach_acceleration(const ContactPoint& contact) const {
    const auto change = [&](int body, const Vec3& arm) -> Vec3 {
      const auto b = as_index(body);
      const Vec3& rotation = difference_.rotation[b];
      const Vec3 angular = bodies_.rigid.properties[b].is_dynamic()
                               ? Vec3(bodies_.rigid.state[b].inverse_inertia * rotation)
                               : rotation;
      return difference_.rigid[b] + angular.cross(arm);
    };
    Vec3 relative = -change(contact.host, contact.host_arm);
    if (contact.is_rigid_pair())
      relative += change(contact.guest_rigid, contact.guest_arm);
    else
      relative += weighted(surface_point(bodies_, contact), difference_.particle);
    return -2 / dt_ * relative.dot(contact.normal);
  }

  // The normal velocity here with which the bodies, thrown back at the surface, would come back here. They
  // are not there yet: on the way they gain and then lose what forces do over the gap, so that a rebound
  // keeps its height however early in the step it is found. Where the rebound is too weak to come back, they
  // may close the gap and no more.
  double rebound_velocity(const ContactPoint& contact, double normal_velocity) const {
    const double gap = std::max(contact.gap, 0.0);
    const double gain = 2 * approach_acceleration(contact) * gap, e = contact.restitution;
    const double squared = e * e * (normal_velocity * normal_velocity + gain) - gain;
    return squared > 0 ? std::sqrt(squared) : -gap / dt_;
  }

  // Whether the bodies approach, faster than they may.
  bool collides(const ContactPoint& contact, const Vec3& velocity) const {
    const double normal_velocity = velocity.dot(contact.normal);
    return normal_velocity < -approach_tolerance &&
           normal_velocity < rebound_velocity(contact, normal_velocity) - approach_tolerance;
  }

  void mark_changed(int body) {
    if (!bodies_.rigid.properties[as_index(body)].is_dynamic()) return;
    scratch_.stale[as_index(body)] = 1;
    ++scratch_.version[as_index(body)];
  }

  void collide(const ContactPair& pair, ContactPoint& contact, const Vec3& velocity) {
    const double target = rebound_velocity(contact, velocity.dot(contact.normal));
    const Vec3 wanted =
        friction_impulse({contact.normal, contact.response, contact.friction}, velocity, target);
    const Vec3 impulse = limit_energy(contact.response.K, velocity, wanted);
    apply_impulse(bodies_, contact, impulse);
    contact.impulse += impulse;
    mark_changed(contact.host);
    if (contact.is_rigid_pair())
      mark_changed(contact.guest_rigid);
    else
      ++scratch_.version[guest_node(bodies_, pair)];
  }

  // The deepest approaching point first, again and again until none approaches.
  bool collide_rigid(ContactPair& pair) {
    bool changed = false;
    if (!settings_.rigid_pairs) {
      pair.collided = true;
      return changed;
    }
    for (int repeat = 0; repeat < settings_.repeats; ++repeat) {
      ContactPoint* deepest = nullptr;
      double least = 0;
      DeepestTouches touches;
      for (int i = pair.begin; i < pair.end; ++i) {
        ContactPoint& contact = contacts_.points[as_index(i)];
        const Touch predicted = predicted_touch(contact);
        if (touches.carry_for(contact, predicted) || predicted.gap >= 0) continue;
        pair.collided = true;
        if (predicted.gap < least && collides(contact, relative_velocity(bodies_, contact))) {
          deepest = &contact;
          least = predicted.gap;
        }
      }
      if (!deepest) break;
      collide(pair, *deepest, relative_velocity(bodies_, *deepest));
      changed = true;
    }
    return changed;
  }

  bool collide_deformable(ContactPair& pair) {
    bool changed = false;
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& contact = contacts_.points[as_index(i)];
      if (predicted_distance(contact) >= inside_tolerance) continue;
      pair.collided = true;
      const Vec3 velocity = relative_velocity(bodies_, contact);
      if (!collides(contact, velocity)) continue;
      collide(pair, contact, velocity);
      changed = true;
    }
    return changed;
  }

  Bodies& bodies_;
  const VelocityState& difference_;
  double dt_;
  const CollisionSettings& settings_;
  ContactSet& contacts_;
  CollisionScratch& scratch_;
};

}  // namespace

void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ContactSet& contacts, CollisionScratch& scratch) {
  Collider(bodies, difference, dt, settings, contacts, scratch).sweep();
}

}  // namespace duet
