#include "sim/contact/response/collisions.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/base/parallel.h"
#include "sim/base/stop.h"
#include "sim/contact/detection/friction.h"
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/detection/sample_culling.h"
#include "sim/contact/response/impact_delay.h"
#include "sim/contact/response/impact_solve.h"

namespace duet {
namespace {

// Distance below which a point of a deformable body counts as inside, m, to be multiplied by
// ContactPoint::precision.
constexpr double inside_tolerance = 1e-6;
// Slower approaches count as rounding, m/s, to be multiplied by ContactPoint::precision.
constexpr double approach_tolerance = 1e-9;
// Points of a pair that meet within this fraction of the step meet at once, because rounding decides which
// corner of a level face is the first. They also take part if they come this near to an overlap, as a
// fraction of their path in the step.
constexpr double same_time = 1e-3;
// Points also meet at once if their gaps differ by no more than this times level_depth(), a thousandth of the
// bodies' size. Less would let what solvers leave over of a body's tilt decide which corner lands first.
constexpr double almost_level = 10;
// Slower approaches, as a fraction of the change of a body's velocity by forces in the step, are what a
// contact solve left over. A larger value would leave weak impacts to contact, which does not bounce.
constexpr double min_impact = 1e-3;
constexpr int rounds_per_iteration = 4;  // rounds of rigid impacts for each iteration of CollisionSettings

// One call of process_collisions().
class Collider {
 public:
  Collider(Bodies& bodies, const VelocityState& difference, double dt, const CollisionSettings& settings,
           ArticulatedResponse* linked, ContactSet& contacts, CollisionScratch& scratch)
      : bodies_(bodies),
        difference_(difference),
        dt_(dt),
        settings_(settings),
        linked_(linked),
        contacts_(contacts),
        scratch_(scratch),
        impact_(bodies, difference, dt, linked, contacts, scratch) {
    scratch_.predicted.resize(bodies.rigid.size());
    scratch_.stale.assign(bodies.rigid.size(), 1);
    scratch_.version.assign(bodies.rigid.size() + bodies.deformable.size(), 0);
    scratch_.seen.assign(contacts.pairs.size(), {});
    scratch_.takes_part.assign(contacts.points.size(), 0);
    scratch_.time.resize(contacts.points.size());
    scratch_.acts_later.assign(contacts.points.size(), 0);
    scratch_.delayed_moment.setZero();
    scratch_.velocity_before.resize(contacts.points.size());
    scratch_.impulse_before.resize(contacts.points.size());
    scratch_.is_hit.assign(contacts.pairs.size(), 0);
    scratch_.pairs.resize(contacts.pairs.size());
    std::iota(scratch_.pairs.begin(), scratch_.pairs.end(), 0);
    scratch_.schedule.build(bodies, contacts, scratch_.pairs);
    scratch_.sweeps.build(bodies, contacts, scratch_.schedule.order());
  }

  // Alternates rigid impacts and sweeps over deformable pairs, until neither changes anything.
  void run() {
    const bool deformable = !bodies_.deformable.empty();
    if (!settings_.rigid_pairs)
      note_overlaps();
    else
      find_falls();
    for (int round = 0; round < rounds_per_iteration * settings_.iterations; ++round) {
      stop_if_asked();
      predict();
      const bool impact = settings_.rigid_pairs && find_impact();
      if (impact) impact_.run();
      const bool changed = deformable && round < settings_.iterations && collide_deformables();
      if (!impact && !changed) break;
    }
    put_arms_back();
  }

 private:
  // Lets all arms lead to the places at the beginning of the step again, as the contact solve needs them.
  void put_arms_back() {
    const std::vector<RigidState>& state = bodies_.rigid.state;
    if (std::all_of(state.begin(), state.end(), [](const RigidState& body) { return body.delay.isZero(0); }))
      return;
    for (std::size_t i = 0; i < contacts_.points.size(); ++i) {
      ContactPoint& contact = contacts_.points[i];
      if (contact.is_rigid_pair() && scratch_.acts_later[i])
        put_at_start(bodies_, contact);
      else if (const Pose& host = state[as_index(contact.host)].pose; !contact.is_rigid_pair())
        contact.host_arm = place_of(contact) - host.position;
    }
  }

  // Returns the place of a deformable guest's point, m.
  Vec3 place_of(const ContactPoint& contact) const {
    return weighted(surface_point(bodies_, contact), bodies_.particles.x);
  }

  // Finds for each rigid body the part of D that nothing holds up: D without its component towards what the
  // body touches, if that is fixed or held up itself. Bodies that rest on others do not fall in the step,
  // though D says so.
  void find_falls() {
    constexpr int most_layers = 16;  // of bodies that lie on each other
    const RigidBodies& rigid = bodies_.rigid;
    scratch_.fall = difference_.rigid;
    scratch_.is_held.resize(rigid.size());
    for (std::size_t b = 0; b < rigid.size(); ++b) scratch_.is_held[b] = !rigid.properties[b].is_dynamic();
    scratch_.holding.clear();
    for (std::size_t i = 0; i < contacts_.points.size(); ++i)
      if (contacts_.points[i].is_rigid_pair() && contacts_.points[i].stays)
        scratch_.holding.push_back(static_cast<int>(i));
    bool changed = true;
    for (int layer = 0; layer < most_layers && changed; ++layer) {
      changed = false;
      for (const int i : scratch_.holding) {
        const ContactPoint& contact = contacts_.points[as_index(i)];
        changed |= hold(as_index(contact.guest_rigid), as_index(contact.host), contact.normal);
        changed |= hold(as_index(contact.host), as_index(contact.guest_rigid), -contact.normal);
      }
    }
  }

  // Takes from the fall of a dynamic body its component towards the body `below`, if that is held up.
  // `normal` leads away from that one. Returns whether this changed the fall by more than rounding.
  bool hold(std::size_t body, std::size_t below, const Vec3& normal) {
    constexpr double rounding = 1e-9;  // relative to D
    if (!bodies_.rigid.properties[body].is_dynamic() || !scratch_.is_held[below]) return false;
    const double towards = normal.dot(scratch_.fall[below] - scratch_.fall[body]);
    if (!(towards > rounding * difference_.rigid[body].norm())) return false;
    scratch_.fall[body] += towards * normal;
    scratch_.is_held[body] = 1;
    return true;
  }

  // Returns the pose of a rigid body's shape after dt with the velocity v_*^n + D, with `linear` (m/s) for
  // that part of D that changes the velocity of the center of mass.
  Pose pose_after(int body, const Vec3& linear) const {
    const auto b = as_index(body);
    const RigidProperties& properties = bodies_.rigid.properties[b];
    RigidState state = bodies_.rigid.state[b];
    if (!properties.moves()) return shape_pose(properties, state.pose);
    state.velocity += linear;
    rotation_variable(state, properties) += difference_.rotation[b];
    if (properties.is_dynamic()) state.angular_velocity = state.inverse_inertia * state.angular_momentum;
    return shape_pose(properties, evolved_pose(state, dt_, settings_.orientation));
  }

  // Returns the pose of a rigid body's shape after dt with the velocity v_*^n + D.
  const Pose& predicted_pose(int body) {
    const auto b = as_index(body);
    if (scratch_.stale[b]) {
      scratch_.predicted[b] = pose_after(body, difference_.rigid[b]);
      scratch_.stale[b] = 0;
    }
    return scratch_.predicted[b];
  }

  // Returns the gap of a rigid pair's contact at the end of the step if bodies that are held up do not fall,
  // m. `gap` (m) is the gap if they do.
  double gap_of_held(const ContactPoint& contact, double gap) const {
    const auto h = as_index(contact.host), g = as_index(contact.guest_rigid);
    const Vec3 host_held = scratch_.fall[h] - difference_.rigid[h],
               guest_held = scratch_.fall[g] - difference_.rigid[g];
    if (host_held.isZero(0) && guest_held.isZero(0)) return gap;
    if (contact.meets_ahead)
      return touch_ahead(bodies_, contact, dt_, impact_.change_by_forces(contact) + guest_held - host_held)
          .gap;
    return touch(bodies_, contact.host, pose_after(contact.host, scratch_.fall[h]), contact.guest_rigid,
                 pose_after(contact.guest_rigid, scratch_.fall[g]), contact.feature, contact.edge)
        .gap;
  }

  // Returns how the guest's point of a rigid pair meets the host at the predicted positions.
  Touch predicted_touch(const ContactPoint& contact) {
    if (contact.meets_ahead) return touch_ahead(bodies_, contact, dt_, impact_.change_by_forces(contact));
    return touch(bodies_, contact.host, predicted_pose(contact.host), contact.guest_rigid,
                 predicted_pose(contact.guest_rigid), contact.feature, contact.edge);
  }

  // Returns the gap of a deformable guest's point at the predicted positions, m.
  double predicted_distance(const ContactPoint& contact) {
    const SurfacePoint& point = surface_point(bodies_, contact);
    const Vec3 x = weighted(point, bodies_.particles.x) +
                   dt_ * (weighted(point, bodies_.particles.v) + weighted(point, difference_.particle));
    if (!contact.is_on_edge()) {  // a point outside of the level set needs no closer look
      const LevelSet& shape = bodies_.rigid.properties[as_index(contact.host)].shape;
      const double distance = shape.distance(predicted_pose(contact.host).to_body(x)) + point.contact_offset;
      if (distance + contact.yielded >= inside_tolerance * contact.precision)
        return distance + contact.yielded;
    }
    return touch(bodies_, contact, predicted_pose(contact.host), x).gap;
  }

  // Returns the acceleration of the guest towards the host by the forces and motions of the step, m/s^2.
  double approach_acceleration(const ContactPoint& contact) const {
    return -2 / dt_ * impact_.change_by_forces(contact).dot(contact.normal);
  }

  // Returns whether the impulses of a rigid pair's contact act when the bodies meet, see impact_delay.h.
  // `meeting` (s) is when they do, and the normal velocity is that of the beginning of the step.
  bool acts_later(const ContactPoint& contact, double normal_velocity, double meeting) const {
    const auto is_linked = [&](int body) { return linked_ && linked_->contains(body); };
    if (is_linked(contact.host) || is_linked(contact.guest_rigid)) return false;
    return is_delayed(bodies_, contact) || rebounds_only_later(contact, normal_velocity, meeting);
  }

  // Returns whether a rebound at the beginning of the step would be lost, because it does not come back over
  // the gap, while one at the time `meeting` (s) has left the surface at the end of the step.
  bool rebounds_only_later(const ContactPoint& contact, double normal_velocity, double meeting) const {
    if (squared_rebound(contact, normal_velocity) > 0) return false;
    const double fall = approach_acceleration(contact);
    const double leaving = contact.restitution * (fall * meeting - normal_velocity);
    return leaving > fall * (dt_ - meeting) / 2;
  }

  // Returns when the bodies of a rigid pair meet, s from the beginning of the step: after the time s with
  //   |u| s + a s^2 / 2 = g
  // for the normal velocity u, the acceleration a of approach and the gap g. With this time an impact that
  // acts later keeps its energy.
  double meeting_time(const ContactPoint& contact, double normal_velocity) const {
    const double gap = delayed_gap(bodies_, contact);
    const double squared = normal_velocity * normal_velocity + 2 * approach_acceleration(contact) * gap;
    return std::clamp(2 * gap / (std::sqrt(std::max(squared, 0.0)) - normal_velocity), 0.0, dt_);
  }

  // Returns the normal velocity after a rebound, m/s:
  //   u' = sqrt(e^2 (u^2 + 2 a g) - 2 a g),
  // for the normal velocity u, the acceleration a of approach, the gap g and the restitution e. The bodies
  // are a gap away from the impact. On the way to it and back they gain and then lose the energy of the
  // forces, so that a rebound keeps its height however early in the step it is found. If the root does not
  // exist, the rebound is too weak to come back over the gap, and the bodies may close the gap and no more:
  // -g / dt.
  double rebound_velocity(const ContactPoint& contact, double normal_velocity) const {
    const double squared = squared_rebound(contact, normal_velocity);
    return squared > 0 ? std::sqrt(squared) : -std::max(contact.gap, 0.0) / dt_;
  }

  // Returns the square of rebound_velocity(), (m/s)^2; at most zero if the root does not exist.
  double squared_rebound(const ContactPoint& contact, double normal_velocity) const {
    const double gain = 2 * approach_acceleration(contact) * std::max(contact.gap, 0.0);
    const double e = contact.restitution;
    return e * e * (normal_velocity * normal_velocity + gain) - gain;
  }

  // Returns whether the bodies approach, and faster than they may.
  bool collides(const ContactPoint& contact, const Vec3& velocity) const {
    const double normal_velocity = velocity.dot(contact.normal);
    const double rounding = approach_tolerance * contact.precision;
    return normal_velocity < -rounding &&
           normal_velocity < rebound_velocity(contact, normal_velocity) - rounding;
  }

  // Brings all predicted poses up to date.
  void predict() {
    parallel_for(bodies_.rigid.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) predicted_pose(static_cast<int>(b));
    });
  }

  // Returns whether the bodies of a pair are unchanged since it was looked at last. If not, notes their
  // versions.
  bool is_as_seen(std::size_t p) {
    const ContactPair& pair = contacts_.pairs[p];
    const int host = scratch_.version[as_index(pair.host)],
              guest = scratch_.version[guest_node(bodies_, pair)];
    CollisionScratch::Seen& seen = scratch_.seen[p];
    if (seen.host == host && seen.guest == guest) return true;
    seen = {host, guest};
    return false;
  }

  // Returns whether the approach is no faster than forces make it in this step, or a tiny fraction of the
  // change by forces. Such bodies rest, slide or roll, and are left to the contact solve: their rebound would
  // be lower than the fall of one step.
  bool persists(const ContactPoint& contact, double normal_velocity) const {
    const auto change = [&](int body) { return difference_.rigid[as_index(body)].squaredNorm(); };
    const double forces = std::sqrt(std::max(change(contact.host), change(contact.guest_rigid)));
    return -normal_velocity < std::max(dt_ * approach_acceleration(contact), min_impact * forces);
  }

  // Finds the impact of this round: the points of rigid pairs that meet now. Returns whether there are any.
  bool find_impact() {
    parallel_for(contacts_.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
        scratch_.is_hit[p] =
            contacts_.pairs[p].guest_rigid >= 0 && !is_as_seen(p) && find_points(contacts_.pairs[p]);
    });
    scratch_.impact.clear();
    for (const int p : scratch_.schedule.order())
      if (scratch_.is_hit[as_index(p)] != 0) scratch_.impact.push_back(p);
    return !scratch_.impact.empty();
  }

  // Marks the points of one pair that take part in the impact, and sets their targets to the least normal
  // velocity that the impact has to leave. They are those that meet first in the step: the impact changes
  // what the others do, and if they still meet then, they belong to the next round. Returns whether there are
  // any.
  bool find_points(ContactPair& pair) {
    double first = std::numeric_limits<double>::infinity();  // s: when the first of them meet
    SampleCulling touches;
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& contact = contacts_.points[as_index(i)];
      char& part = scratch_.takes_part[as_index(i)];
      part = 0;
      const Touch predicted = predicted_touch(contact);
      if (touches.carry_for(contact, predicted)) continue;
      const Vec3 velocity = relative_velocity(bodies_, contact);
      const double normal_velocity = velocity.dot(contact.normal);
      const double near = same_time * dt_ * -normal_velocity;  // m
      if (predicted.gap >= near) continue;
      if (predicted.gap < 0) pair.collided = true;
      if (!collides(contact, velocity) || persists(contact, normal_velocity)) continue;
      const double gap = gap_of_held(contact, predicted.gap);
      if (gap >= near) continue;
      part = 1;
      const double time = meeting_time(contact, normal_velocity);
      scratch_.time[as_index(i)] = time;
      if (gap < 0) first = std::min(first, time);
      contact.target = rebound_velocity(contact, normal_velocity);
      scratch_.acts_later[as_index(i)] = acts_later(contact, normal_velocity, time);
      scratch_.velocity_before[as_index(i)] = velocity;
    }
    impact_.for_each_point(pair, [&](std::size_t i) {
      const ContactPoint& contact = contacts_.points[i];
      const double approach = -scratch_.velocity_before[i].dot(contact.normal);
      const double at_once =
          std::max(same_time * dt_, almost_level * level_depth(bodies_, contact) / approach);
      if (scratch_.time[i] > first + at_once) scratch_.takes_part[i] = 0;
    });
    return std::isfinite(first);
  }

  // Without rigid collisions all rigid pairs go straight to contact.
  void note_overlaps() {
    for (ContactPair& pair : contacts_.pairs) pair.collided |= pair.guest_rigid >= 0;
  }

  // Collides one point of a deformable body, whose relative velocity is `velocity` (m/s).
  void collide(const ContactPair& pair, ContactPoint& contact, const Vec3& velocity) {
    if (contact.response.normal_mass == 0) return;  // joints leave no motion along the normal
    const double target = rebound_velocity(contact, velocity.dot(contact.normal));
    const Vec3 wanted =
        friction_impulse({contact.normal, contact.response, contact.friction}, velocity, target);
    const Vec3 impulse = limit_energy(contact.response.K, velocity, wanted);
    impact_.apply(contact, impulse);
    contact.impulse += impulse;
    impact_.mark_changed(contact.host);
    ++scratch_.version[guest_node(bodies_, pair)];
  }

  // Sweeps once over the pairs with deformable bodies. Returns whether an impulse was applied.
  bool collide_deformables() {
    std::atomic<bool> changed = false;
    scratch_.sweeps.once([&](int p) {
      ContactPair& pair = contacts_.pairs[as_index(p)];
      if (pair.guest_rigid >= 0 || is_as_seen(as_index(p))) return;
      if (!collide_deformable(pair)) return;
      scratch_.seen[as_index(p)] = {};
      changed = true;
    });
    return changed;
  }

  // Collides the points of one pair that are inside the host and approach. Returns whether an impulse was
  // applied.
  bool collide_deformable(ContactPair& pair) {
    bool changed = false;
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& contact = contacts_.points[as_index(i)];
      if (predicted_distance(contact) >= inside_tolerance * contact.precision) continue;
      pair.collided = true;
      const RigidState& host = bodies_.rigid.state[as_index(contact.host)];
      if (!host.delay.isZero(0))  // the arm leads from where the host's path to the end of the step begins
        contact.host_arm = place_of(contact) - host.pose.position - host.delay;
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
  ArticulatedResponse* linked_;
  ContactSet& contacts_;
  CollisionScratch& scratch_;
  ImpactSolve impact_;
};

}  // namespace

void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ArticulatedResponse* linked, ContactSet& contacts,
                        CollisionScratch& scratch) {
  Collider(bodies, difference, dt, settings, linked, contacts, scratch).run();
}

}  // namespace duet
