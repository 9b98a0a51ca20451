#include "sim/contact/response/impact_solve.h"

#include <algorithm>

#include "sim/contact/response/contact_update.h"
#include "sim/contact/response/impact_delay.h"

namespace duet {
namespace {

constexpr int max_sweeps = 200;  // sweeps over the pairs of an impact
constexpr int pair_sweeps = 8;   // passes to and fro over the points of a pair at each visit
// Largest change of a relative velocity in the last sweep, as a fraction of the fastest approach of the
// island.
constexpr double precision = 1e-9;

}  // namespace

Vec3 ImpactSolve::change_by_forces(const ContactPoint& contact) const {
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

void ImpactSolve::mark_changed(int body) {
  const auto mark = [&](std::size_t b) {
    scratch_.stale[b] = 1;
    ++scratch_.version[b];
  };
  if (linked_ && linked_->contains(body))
    linked_->for_each_member(body, mark);
  else if (bodies_.rigid.properties[as_index(body)].is_dynamic())
    mark(as_index(body));
}

void ImpactSolve::apply(const ContactPoint& contact, const Vec3& impulse) {
  if (linked_ && linked_->takes_part(contact))
    linked_->apply_impulse(bodies_, contact, impulse);
  else
    apply_impulse(bodies_, contact, impulse);
}

// Returns the acceleration of the guest towards the host, m/s^2, by what nothing holds up.
double ImpactSolve::approach_by_falls(const ContactPoint& contact) const {
  const auto held = [&](int body) -> Vec3 {
    return scratch_.fall[as_index(body)] - difference_.rigid[as_index(body)];
  };
  return -2 / dt_ *
         (change_by_forces(contact) + held(contact.guest_rigid) - held(contact.host)).dot(contact.normal);
}

// Returns the normal velocity from the beginning of the step that a rebound after the time s leads to, m/s:
//   u' = e u_s + a s,  u_s = |u| + a s,
// for the normal velocity u now and the acceleration a of approach.
double ImpactSolve::delayed_rebound(const ContactPoint& contact, double normal_velocity,
                                    double meeting) const {
  const double gain = approach_by_falls(contact) * meeting;
  return contact.restitution * std::max(gain - normal_velocity, 0.0) + gain;
}

// Returns what forces add to the approach of a contact before it meets, if its impulse acts then, m/s.
double ImpactSolve::gain_of(std::size_t i) const {
  if (!scratch_.acts_later[i]) return 0;
  const ContactPoint& contact = contacts_.points[i];
  const CollisionScratch::Island& island = scratch_.islands[island_of(contact)];
  return approach_by_falls(contact) * island.meeting;
}

// Finds the islands of the impact: dynamic bodies that its pairs and jointed groups connect.
void ImpactSolve::find_islands() {
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
  for (const int p : scratch_.impact) scratch_.island[as_index(p)] = island_of(contacts_.pairs[as_index(p)]);
}

// Lets the impulses of an island that act later act together, when the first of its points meet.
void ImpactSolve::delay_islands() {
  for (const int p : scratch_.impact) {
    CollisionScratch::Island& island = scratch_.islands[scratch_.island[as_index(p)]];
    for_each_point(contacts_.pairs[as_index(p)], [&](std::size_t i) {
      if (scratch_.acts_later[i]) island.meeting = std::min(island.meeting, scratch_.time[i]);
    });
  }
  for (const int p : scratch_.impact) {
    const double meeting = scratch_.islands[scratch_.island[as_index(p)]].meeting;
    for_each_point(contacts_.pairs[as_index(p)], [&](std::size_t i) {
      if (!scratch_.acts_later[i]) return;
      ContactPoint& contact = contacts_.points[i];
      put_at_meeting(bodies_, meeting, contact);
      scratch_.velocity_before[i] = relative_velocity(bodies_, contact);
      contact.target = delayed_rebound(contact, scratch_.velocity_before[i].dot(contact.normal), meeting);
    });
  }
}

// Delays the bodies by the impulses of the impact that act later.
void ImpactSolve::delay_impulses() {
  for_each_later([&](const ContactPoint& contact, double meeting) {
    delay_impulse(bodies_, contact, meeting, contact.impulse);
  });
  for_each_later([&](const ContactPoint& contact, double meeting) {
    scratch_.delayed_moment += delayed_moment(bodies_, contact, meeting, contact.impulse);
  });
}

// Marks the islands as settled whose last sweep changed no relative velocity by more than the tolerance.
void ImpactSolve::settle_islands() {
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
double ImpactSolve::update_pair(const ContactPair& pair, double tolerance) {
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
void ImpactSolve::keep_energy() {
  for (const int p : scratch_.impact) {
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    CollisionScratch::Island& work = scratch_.islands[scratch_.island[as_index(p)]];
    for_each_point(pair, [&](std::size_t i) {
      const ContactPoint& contact = contacts_.points[i];
      const Vec3& before = scratch_.velocity_before[i];
      work.linear += contact.impulse.dot(before - gain_of(i) * contact.normal);
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

void ImpactSolve::run() {
  find_islands();
  delay_islands();
  for (const int p : scratch_.impact) {
    CollisionScratch::Island& island = scratch_.islands[island_of(contacts_.pairs[as_index(p)])];
    for_each_point(contacts_.pairs[as_index(p)], [&](std::size_t i) {
      const double speed = -scratch_.velocity_before[i].dot(contacts_.points[i].normal);
      island.tolerance = std::max(island.tolerance, precision * speed);
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
  scratch_.impact_sweeps.repeat(max_sweeps, 1, visit, [&] { settle_islands(); });
  keep_energy();
  delay_impulses();
  for (const int p : scratch_.impact) {
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    for_each_point(pair, [&](std::size_t i) { contacts_.points[i].impulse += scratch_.impulse_before[i]; });
    mark_changed(pair.host);
    mark_changed(pair.guest_rigid);
  }
}

}  // namespace duet
