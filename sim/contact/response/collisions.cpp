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
#include "sim/contact/response/contact_update.h"

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
constexpr int max_impact_sweeps = 200;   // sweeps over the pairs of an impact
constexpr int pair_sweeps = 8;           // passes to and fro over the points of a pair at each visit
// Largest change of a relative velocity in the last sweep, as a fraction of the fastest approach of the
// island.
constexpr double impact_precision = 1e-9;

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
        scratch_(scratch) {
    scratch_.predicted.resize(bodies.rigid.size());
    scratch_.stale.assign(bodies.rigid.size(), 1);
    scratch_.version.assign(bodies.rigid.size() + bodies.deformable.size(), 0);
    scratch_.seen.assign(contacts.pairs.size(), {});
    scratch_.takes_part.assign(contacts.points.size(), 0);
    scratch_.time.resize(contacts.points.size());
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
      if (impact) apply_impact();
      const bool changed = deformable && round < settings_.iterations && collide_deformables();
      if (!impact && !changed) break;
    }
  }

 private:
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

  // Returns the pose of a rigid body after dt with the velocity v_*^n + D, with `linear` (m/s) for that part
  // of D that changes the velocity of the center of mass.
  Pose pose_after(int body, const Vec3& linear) const {
    const auto b = as_index(body);
    const RigidProperties& properties = bodies_.rigid.properties[b];
    RigidState state = bodies_.rigid.state[b];
    if (!properties.moves()) return state.pose;
    state.velocity += linear;
    rotation_variable(state, properties) += difference_.rotation[b];
    if (properties.is_dynamic()) state.angular_velocity = state.inverse_inertia * state.angular_momentum;
    return evolved_pose(state, dt_, settings_.orientation);
  }

  // Returns the pose of a rigid body after dt with the velocity v_*^n + D.
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
      return touch_ahead(bodies_, contact, dt_, change_by_forces(contact) + guest_held - host_held).gap;
    return touch(bodies_, contact.host, pose_after(contact.host, scratch_.fall[h]), contact.guest_rigid,
                 pose_after(contact.guest_rigid, scratch_.fall[g]), contact.guest_point, contact.edge)
        .gap;
  }

  // Returns how the guest's point of a rigid pair meets the host at the predicted positions.
  Touch predicted_touch(const ContactPoint& contact) {
    if (contact.meets_ahead) return touch_ahead(bodies_, contact, dt_, change_by_forces(contact));
    return touch(bodies_, contact.host, predicted_pose(contact.host), contact.guest_rigid,
                 predicted_pose(contact.guest_rigid), contact.guest_point, contact.edge);
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

  // Returns the part of D in the velocity of the guest relative to the host, m/s: what forces and prescribed
  // motions of the step add.
  Vec3 change_by_forces(const ContactPoint& contact) const {
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
    return relative;
  }

  // Returns the acceleration of the guest towards the host by the forces and motions of the step, m/s^2.
  double approach_acceleration(const ContactPoint& contact) const {
    return -2 / dt_ * change_by_forces(contact).dot(contact.normal);
  }

  // Returns the normal velocity after a rebound, m/s:
  //   u' = sqrt(e^2 (u^2 + 2 a g) - 2 a g),
  // for the normal velocity u, the acceleration a of approach, the gap g and the restitution e. The bodies
  // are a gap away from the impact. On the way to it and back they gain and then lose the energy of the
  // forces, so that a rebound keeps its height however early in the step it is found. If the root does not
  // exist, the rebound is too weak to come back over the gap, and the bodies may close the gap and no more:
  // -g / dt.
  double rebound_velocity(const ContactPoint& contact, double normal_velocity) const {
    const double gap = std::max(contact.gap, 0.0);
    const double gain = 2 * approach_acceleration(contact) * gap, e = contact.restitution;
    const double squared = e * e * (normal_velocity * normal_velocity + gain) - gain;
    return squared > 0 ? std::sqrt(squared) : -gap / dt_;
  }

  // Returns whether the bodies approach, and faster than they may.
  bool collides(const ContactPoint& contact, const Vec3& velocity) const {
    const double normal_velocity = velocity.dot(contact.normal);
    const double rounding = approach_tolerance * contact.precision;
    return normal_velocity < -rounding &&
           normal_velocity < rebound_velocity(contact, normal_velocity) - rounding;
  }

  // Notes that an impulse has changed the velocity of a rigid body, or of its jointed group.
  void mark_changed(int body) {
    const auto mark = [&](std::size_t b) {
      scratch_.stale[b] = 1;
      ++scratch_.version[b];
    };
    if (linked_ && linked_->contains(body))
      linked_->for_each_member(body, mark);
    else if (bodies_.rigid.properties[as_index(body)].is_dynamic())
      mark(as_index(body));
  }

  void apply(const ContactPoint& contact, const Vec3& impulse) {
    if (linked_ && linked_->takes_part(contact))
      linked_->apply_impulse(bodies_, contact, impulse);
    else
      apply_impulse(bodies_, contact, impulse);
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
      const double time = std::max(contact.gap, 0.0) / -normal_velocity;
      scratch_.time[as_index(i)] = time;
      if (gap < 0) first = std::min(first, time);
      contact.target = rebound_velocity(contact, normal_velocity);
      scratch_.velocity_before[as_index(i)] = velocity;
    }
    for_each_point(pair, [&](std::size_t i) {
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

  template <class Visit>
  void for_each_point(const ContactPair& pair, Visit&& visit) {
    for (int i = pair.begin; i < pair.end; ++i)
      if (scratch_.takes_part[as_index(i)] != 0) visit(as_index(i));
  }

  // Finds and applies the impulses of all points of the impact together, by Gauss-Seidel sweeps. The
  // tolerance of each island is a fraction of its fastest approach.
  void apply_impact() {
    find_islands();
    for (const int p : scratch_.impact) {
      CollisionScratch::Island& island = scratch_.islands[island_of(contacts_.pairs[as_index(p)])];
      for_each_point(contacts_.pairs[as_index(p)], [&](std::size_t i) {
        const double speed = -scratch_.velocity_before[i].dot(contacts_.points[i].normal);
        island.tolerance = std::max(island.tolerance, impact_precision * speed);
        scratch_.impulse_before[i] = contacts_.points[i].impulse;
        contacts_.points[i].impulse.setZero();
      });
    }
    scratch_.impact_sweeps.build(bodies_, contacts_, scratch_.impact);
    const auto visit = [&](int p) {
      const CollisionScratch::Island& island = scratch_.islands[scratch_.island[as_index(p)]];
      if (island.multipliers_final) return 0.0;
      const double change = update_pair(contacts_.pairs[as_index(p)], island.tolerance);
      return scratch_.change[as_index(p)] = change / island.tolerance;
    };
    scratch_.impact_sweeps.repeat(max_impact_sweeps, 1, visit, [&] { settle_islands(); });
    keep_energy();
    for (const int p : scratch_.impact) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      for_each_point(pair, [&](std::size_t i) { contacts_.points[i].impulse += scratch_.impulse_before[i]; });
      mark_changed(pair.host);
      mark_changed(pair.guest_rigid);
    }
  }

  std::size_t island_of(const ContactPair& pair) {
    const bool host_moves = bodies_.rigid.properties[as_index(pair.host)].is_dynamic();
    return as_index(scratch_.joined.first(host_moves ? pair.host : pair.guest_rigid));
  }

  // Finds the islands of the impact: dynamic bodies that its pairs and jointed groups connect.
  void find_islands() {
    scratch_.joined.reset(bodies_.rigid.size());
    for (std::size_t b = 0; linked_ && b < bodies_.linked.size(); ++b)
      if (bodies_.linked[b] >= 0) scratch_.joined.join(static_cast<int>(b), bodies_.linked[b]);
    for (const int p : scratch_.impact) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      if (bodies_.rigid.properties[as_index(pair.host)].is_dynamic() &&
          bodies_.rigid.properties[as_index(pair.guest_rigid)].is_dynamic())
        scratch_.joined.join(pair.host, pair.guest_rigid);
    }
    scratch_.islands.assign(bodies_.rigid.size(), {});
    scratch_.island.resize(contacts_.pairs.size());
    scratch_.change.resize(contacts_.pairs.size());
    for (const int p : scratch_.impact)
      scratch_.island[as_index(p)] = island_of(contacts_.pairs[as_index(p)]);
  }

  // Marks the islands as settled whose last sweep changed no relative velocity by more than the tolerance.
  void settle_islands() {
    for (const int p : scratch_.impact) scratch_.islands[scratch_.island[as_index(p)]].largest = 0;
    for (const int p : scratch_.impact) {
      double& largest = scratch_.islands[scratch_.island[as_index(p)]].largest;
      largest = std::max(largest, scratch_.change[as_index(p)]);
    }
    for (const int p : scratch_.impact) {
      CollisionScratch::Island& island = scratch_.islands[scratch_.island[as_index(p)]];
      island.multipliers_final = island.largest < 1;
    }
  }

  // Updates the points of a pair in passes to and fro. Returns the largest change of a relative velocity in
  // the first pass, m/s.
  double update_pair(const ContactPair& pair, double tolerance) {
    double first = 0;
    for (int sweep = 0; sweep < pair_sweeps; ++sweep) {
      double largest = 0;
      for (int k = pair.begin; k < pair.end; ++k) {
        const auto i = as_index(sweep % 2 == 0 ? k : pair.end - 1 - (k - pair.begin));
        if (scratch_.takes_part[i] == 0) continue;
        ContactPoint& contact = contacts_.points[i];
        const Vec3 total = updated_impulse(contact, contact.response, relative_velocity(bodies_, contact));
        const Vec3 change = total - contact.impulse;
        apply(contact, change);
        contact.impulse = total;
        largest = std::max(largest, (contact.response.K * change).norm());
      }
      if (sweep == 0) first = largest;
      if (largest < tolerance) break;
    }
    return first;
  }

  // Scales the impulses j of each island so that the impact adds no energy. The impulses s j change the
  // energy by
  //   s a + s^2 b,  a = sum j . u-,  b = sum j . (u+ - u-) / 2,
  // and s is the largest value in [0, 1] at which this is not positive. With friction, or with different
  // coefficients of restitution in one impact, Moreau's law can add energy.
  void keep_energy() {
    for (const int p : scratch_.impact) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      CollisionScratch::Island& work = scratch_.islands[scratch_.island[as_index(p)]];
      for_each_point(pair, [&](std::size_t i) {
        const ContactPoint& contact = contacts_.points[i];
        const Vec3& before = scratch_.velocity_before[i];
        work.linear += contact.impulse.dot(before);
        work.quadratic += contact.impulse.dot(relative_velocity(bodies_, contact) - before) / 2;
      });
    }
    for (const int p : scratch_.impact) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      const CollisionScratch::Island& work = scratch_.islands[scratch_.island[as_index(p)]];
      if (work.linear + work.quadratic <= 0) continue;
      const double most = std::clamp(-work.linear / work.quadratic, 0.0, 1.0);
      for_each_point(pair, [&](std::size_t i) {
        ContactPoint& contact = contacts_.points[i];
        apply(contact, (most - 1) * contact.impulse);
        contact.impulse *= most;
      });
    }
  }

  // Collides one point of a deformable body, whose relative velocity is `velocity` (m/s).
  void collide(const ContactPair& pair, ContactPoint& contact, const Vec3& velocity) {
    if (contact.response.normal_mass == 0) return;  // joints leave no motion along the normal
    const double target = rebound_velocity(contact, velocity.dot(contact.normal));
    const Vec3 wanted =
        friction_impulse({contact.normal, contact.response, contact.friction}, velocity, target);
    const Vec3 impulse = limit_energy(contact.response.K, velocity, wanted);
    apply(contact, impulse);
    contact.impulse += impulse;
    mark_changed(contact.host);
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
};

}  // namespace

void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ArticulatedResponse* linked, ContactSet& contacts,
                        CollisionScratch& scratch) {
  Collider(bodies, difference, dt, settings, linked, contacts, scratch).run();
}

}  // namespace duet
