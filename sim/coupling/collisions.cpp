#include "sim/coupling/collisions.h"

#include "sim/coupling/friction.h"

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

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
  }

  bool sweep() {
    bool changed = false;
    for (ContactPair& pair : contacts_.pairs)
      changed |= pair.guest_rigid >= 0 ? collide_rigid(pair) : collide_deformable(pair);
    return changed;
  }

 private:
  const Pose& predicted_pose(int body) {
    const auto b = as_index(body);
    if (scratch_.stale[b]) {
      RigidState state = bodies_.rigid.state[b];
      state.velocity += difference_.rigid[b];
      state.angular_momentum += difference_.angular_momentum[b];
      state.angular_velocity = state.inverse_inertia * state.angular_momentum;
      scratch_.predicted[b] = bodies_.rigid.properties[b].is_static()
                                  ? state.pose
                                  : evolved_pose(state, dt_, settings_.second_order);
      scratch_.stale[b] = 0;
    }
    return scratch_.predicted[b];
  }

  Vec3 predicted_guest(const ContactPoint& contact) {
    if (!contact.is_rigid_pair()) {
      const SurfacePoint& point = surface_point(bodies_, contact);
      return weighted(point, bodies_.particles.x) +
             dt_ * (weighted(point, bodies_.particles.v) + weighted(point, difference_.particle));
    }
    const RigidProperties& guest = bodies_.rigid.properties[as_index(contact.guest_rigid)];
    const Pose& pose = predicted_pose(contact.guest_rigid);
    return contact.guest_point >= 0 ? pose.to_world(guest.samples[as_index(contact.guest_point)])
                                    : pose.position;
  }

  // Signed distance of the contact at the predicted positions, m.
  double predicted_distance(const ContactPoint& contact) {
    const LevelSet& shape = bodies_.rigid.properties[as_index(contact.host)].shape;
    const double distance = shape.distance(predicted_pose(contact.host).to_body(predicted_guest(contact)));
    if (!contact.is_rigid_pair()) return distance + surface_point(bodies_, contact).allowance;
    if (contact.guest_point >= 0) return distance;
    return distance - bodies_.rigid.properties[as_index(contact.guest_rigid)].shape.radius;
  }

  void collide(const ContactPoint& contact, const Vec3& velocity) {
    const double target = -contact.restitution * velocity.dot(contact.normal);
    const Vec3 wanted =
        friction_impulse({contact.normal, contact.K, contact.inverse_K, contact.friction}, velocity, target);
    const Vec3 impulse = limit_energy(contact.K, velocity, wanted);
    apply_impulse(bodies_, contact, impulse);
    scratch_.stale[as_index(contact.host)] = 1;
    if (contact.is_rigid_pair()) scratch_.stale[as_index(contact.guest_rigid)] = 1;
  }

  // The deepest approaching point first, again and again until none approaches.
  bool collide_rigid(ContactPair& pair) {
    bool changed = false;
    if (!settings_.rigid_pairs) {
      pair.collided = true;
      return changed;
    }
    for (int repeat = 0; repeat < settings_.repeats; ++repeat) {
      const ContactPoint* deepest = nullptr;
      double least = 0;
      for (int i = pair.begin; i < pair.end; ++i) {
        const ContactPoint& contact = contacts_.points[as_index(i)];
        const double distance = predicted_distance(contact);
        if (distance >= 0) continue;
        pair.collided = true;
        if (distance < least &&
            relative_velocity(bodies_, contact).dot(contact.normal) < -approach_tolerance) {
          deepest = &contact;
          least = distance;
        }
      }
      if (!deepest) break;
      collide(*deepest, relative_velocity(bodies_, *deepest));
      changed = true;
    }
    return changed;
  }

  bool collide_deformable(ContactPair& pair) {
    bool changed = false;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts_.points[as_index(i)];
      if (predicted_distance(contact) >= inside_tolerance) continue;
      pair.collided = true;
      const Vec3 velocity = relative_velocity(bodies_, contact);
      if (velocity.dot(contact.normal) >= -approach_tolerance) continue;
      collide(contact, velocity);
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
  Collider collider(bodies, difference, dt, settings, contacts, scratch);
  for (int iteration = 0; iteration < settings.iterations; ++iteration)
    if (!collider.sweep()) break;
}

}  // namespace duet
