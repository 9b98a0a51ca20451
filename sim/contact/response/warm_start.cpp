#include "sim/contact/response/warm_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/detection/sample_culling.h"

namespace duet {
namespace {

// Least cosine of the turn of a normal within a step of which the mean counts, see turn_to_middle().
constexpr double min_agreement_at_middle = 0.9;

// Returns the key by which the cache is sorted.
template <class Contact>
auto name_of(const Contact& contact) {
  return std::tie(contact.host, contact.guest_rigid, contact.feature);
}

// Returns the cached contact of the same name, or null.
const CachedContact* find(const ContactCache& cache, const ContactPoint& contact) {
  const auto found =
      std::lower_bound(cache.begin(), cache.end(), contact,
                       [](const CachedContact& a, const ContactPoint& b) { return name_of(a) < name_of(b); });
  return found == cache.end() || name_of(*found) != name_of(contact) ? nullptr : &*found;
}

// Returns the impulse of the cached force over `duration` (s), at most the cached impulse, N s; zero: not in
// the cache.
Vec3 cached_impulse(const ContactCache& cache, const ContactPoint& contact, double duration) {
  const CachedContact* found = find(cache, contact);
  return found ? Vec3(std::min(1.0, duration / found->duration) * found->impulse) : Vec3::Zero();
}

// Returns the relative velocity (m/s) with which the gap at the end of the step is predicted. It is
// `velocity`, except that the point of a deformable guest does not close by more than its gap.
Vec3 expected_velocity(const ContactPoint& contact, const Vec3& velocity, double dt) {
  if (contact.is_rigid_pair()) return velocity;
  const double closing = velocity.dot(contact.normal), allowed = -std::max(contact.gap, 0.0) / dt;
  return closing < allowed ? Vec3(velocity + (allowed - closing) * contact.normal) : velocity;
}

// Returns the speed at which the place of contact of a rigid pair moves along its host over the step, m/s. It
// is the speed of the guest's point if that slides, that of its center if a ball rolls, and that of the
// lowest place if a coin rolls on its rim.
double place_speed(const Bodies& bodies, const ContactPoint& contact, const Touch& predicted, double dt) {
  const Vec3 way = predicted.position -
                   (bodies.rigid.state[as_index(contact.guest_rigid)].pose.position + contact.guest_arm);
  const RigidState& host = bodies.rigid.state[as_index(contact.host)];
  return (way / dt - point_velocity(host, contact.host_arm)).norm();
}

// Returns the target of find_speculative_targets(), m/s. If the point overlaps then and the normal has turned
// far, another side of the host is nearest, and the gap there says nothing about this normal: the contact may
// close its gap then.
double target_velocity(const Bodies& bodies, const ContactPoint& contact, const Vec3& velocity,
                       const Touch& predicted, double dt) {
  constexpr double min_agreement = 0.9;  // least cosine of the turn of the normal, at 26 degrees
  // Largest target over the speed: the part of a motion that a curved host may turn towards its normal.
  constexpr double max_turn = 0.1;
  if (predicted.gap < 0 && predicted.normal.dot(contact.normal) < min_agreement)
    return -std::max(contact.gap, 0.0) / dt;
  double most = max_turn * velocity.norm();
  const double target = velocity.dot(contact.normal) - (predicted.gap - std::min(contact.gap, 0.0)) / dt;
  if (target <= most || !contact.is_rigid_pair()) return std::min(target, most);
  most = std::max(most, max_turn * place_speed(bodies, contact, predicted, dt));
  return std::min(target, most);
}

// Target of a contact that does not act: every velocity reaches it.
constexpr double out_of_reach = -std::numeric_limits<double>::infinity();

// Returns the target at the end of a step, m/s, of a contact that touches now:
//   (1 - w) target + w max(target, -max(gap, 0) / dt),   w = min(1, (1 - n . n') / min_turn),
// with the normal n' where the next step would lead. If it has turned, the point leaves its face there (a
// point that slides beyond an edge, a wheel over a gap), and the gap there says nothing about this moment.
double target_at_end(const ContactPoint& contact, const Touch& next, double target, double dt) {
  constexpr double min_turn = 1e-4;  // 1 - cosine of 0.8 degrees
  const double w = std::clamp((1 - contact.normal.dot(next.normal)) / min_turn, 0.0, 1.0);
  const double closed = std::max(target, -std::max(contact.gap, 0.0) / dt);
  return w == 1 || std::isinf(target) ? closed : target + w * (closed - target);
}

// Returns whether the bodies of a contact are apart and approach faster than the forces of one step make
// them. `forces` is the change of the velocities by the forces of half a step.
bool will_collide(const Bodies& bodies, const ContactPoint& contact, const Vec3& velocity,
                  const VelocityState& forces) {
  if (!contact.is_rigid_pair() || !(contact.gap > level_depth(bodies, contact))) return false;
  const auto h = as_index(contact.host), g = as_index(contact.guest_rigid);
  const double approach = -velocity.dot(contact.normal);
  return approach > 2 * (forces.rigid[h] - forces.rigid[g]).norm();
}

// Returns the target for a contact whose normal n is that at the middle of the step, see turn_to_middle(),
// and whose target so far is `target`, m/s. In a hollow, where the normal n' at the end of the step, which
// mirrors that of the start at n, is turned against the velocity v, it is at most -v.(n' - n): to first order
// the bodies then end the step along each other.
double target_at_middle(const ContactPoint& contact, const Vec3& velocity, double target) {
  if (contact.first_normal.dot(contact.normal) < min_agreement_at_middle) return target;
  const Vec3& n = contact.normal;
  const Vec3 last = 2 * n.dot(contact.first_normal) * n - contact.first_normal;
  const double ahead = velocity.dot(last - n);
  return ahead < 0 ? std::min(target, -ahead) : target;
}

// Returns what turning and the motion of the place of contact add to the tangential velocity of a rigid pair,
// m/s: the mean over the step of the velocity at the place, less that at its beginning. For a body with the
// angular velocity w, and with its arms a at the beginning and a' at the end, it is
//   (R a - a) / dt - w x a + (w.n) n x s / 2,   s = a' - R a,
// with the rotation R of the body in the step and the normal n: the first part is that of the point at the
// first place, the second one that of the way s of the place over the body. What that leaves for a' = a, as
// for what rolls on a plane, is taken off as far as a' - a is small beside a - R a. Friction that holds the
// velocity at the first place alone would give energy to a coin that rolls on its rim, in proportion to the
// step. Kinematic bodies have their part in ContactPoint::path_velocity already.
Vec3 turning_velocity(const Bodies& bodies, const std::vector<Pose>& predicted_poses,
                      const ContactPoint& contact, const Touch& predicted, double dt) {
  constexpr double keeps_arm = 0.1;  // greatest |a' - a| over |a - R a| at which something is taken off
  const Vec3& n = contact.normal;
  const auto change = [&](int body, const Vec3& arm) -> Vec3 {
    const auto b = as_index(body);
    const RigidState& state = bodies.rigid.state[b];
    if (!bodies.rigid.properties[b].is_dynamic()) return Vec3::Zero();
    const Vec3& w = state.angular_velocity;
    const Vec3 last = predicted.position - state.pose.position - dt * state.velocity;
    const Quat turn = predicted_poses[b].orientation * shape_pose(bodies.rigid, b).orientation.conjugate();
    const Vec3 turned = turn * arm, way = last - turned, back = arm - turned;
    const auto by_way = [&](const Vec3& s) -> Vec3 { return w.dot(n) / 2 * n.cross(s); };
    const Vec3 by_turn = -back / dt - w.cross(arm);
    const double moved = (last - arm).norm(), enough = keeps_arm * back.norm();
    const double f = moved < enough ? 1 - moved / enough : 0, stays = f * f * (3 - 2 * f);
    return by_turn + by_way(way) - stays * (by_turn + by_way(back));
  };
  const Vec3 mean = change(contact.guest_rigid, contact.guest_arm) - change(contact.host, contact.host_arm);
  return mean - mean.dot(n) * n;
}

// Returns how the vertex at which a round surface touches now touches in the plane of `predicted`, in which
// another vertex may have landed by then.
Touch touch_of_vertex(const Bodies& bodies, const std::vector<Pose>& predicted_poses,
                      const ContactPoint& contact, const Touch& predicted) {
  const auto g = as_index(contact.guest_rigid);
  const Vec3 now = bodies.rigid.state[g].pose.position + contact.guest_arm;
  Touch vertex = predicted;
  vertex.position = predicted_poses[g].to_world(shape_pose(bodies.rigid, g).to_body(now));
  vertex.gap += predicted.normal.dot(vertex.position - predicted.position);
  return vertex;
}

// Returns the target of a contact, m/s, by the rules of find_speculative_targets(). `culling` collects the
// contacts of the pair.
double target_of(const Bodies& bodies, const std::vector<Pose>& predicted_poses, double dt,
                 PredictionFor stage, const VelocityState* forces, ContactPoint& contact,
                 SampleCulling& culling) {
  if (contact.meets_ahead)
    return culling.carry_for(contact, touch_ahead(bodies, contact, dt, Vec3::Zero())) ||
                   (forces && will_collide(bodies, contact, relative_velocity(bodies, contact), *forces))
               ? out_of_reach
               : -contact.gap / dt;
  const Vec3 velocity = relative_velocity(bodies, contact),
             expected = expected_velocity(contact, velocity, dt);
  const Touch predicted = predicted_touch(bodies, predicted_poses, dt, contact, dt * (expected - velocity));
  const bool stays = stage == PredictionFor::velocity_at_end && contact.stays;
  // Where the next step leads beyond the host, onto a body that adjoins it, the touch there says nothing
  // about which points carry the load now.
  const bool is_left = stays && std::isinf(predicted.gap);
  const bool is_carried =
      culling.carry_for(contact, is_left ? touch_ahead(bodies, contact, dt, Vec3::Zero()) : predicted);
  if (stage == PredictionFor::motion_in_step) contact.is_carried = is_carried;
  if (is_carried) return out_of_reach;
  if (forces && will_collide(bodies, contact, velocity, *forces)) return out_of_reach;
  const double target = target_velocity(bodies, contact, expected, predicted, dt);
  if (stage == PredictionFor::motion_in_step && is_on_round_surface(contact)) {
    const double alone = target_velocity(bodies, contact, expected,
                                         touch_of_vertex(bodies, predicted_poses, contact, predicted), dt);
    contact.landing = std::max(0.0, target - alone);
  }
  if (stage == PredictionFor::motion_in_step && contact.is_rigid_pair() && std::isfinite(predicted.gap))
    contact.path_velocity += turning_velocity(bodies, predicted_poses, contact, predicted, dt);
  if (stage == PredictionFor::velocity_in_solve && !contact.is_rigid_pair())
    return target_at_middle(contact, expected, target);
  if (stage != PredictionFor::velocity_at_end) return target;
  const double at_end = stays ? target_at_end(contact, predicted, target, dt) : target;
  return contact.is_rigid_pair() ? std::min(0.0, at_end) : at_end;
}

// Applies factor(island of the pair) times the impulses that the contacts of active pairs hold.
template <class Factor>
void apply_impulses(const ContactGraph& graph, Bodies& bodies, ContactSet& contacts, Factor&& factor) {
  graph.sweeps.once([&](int p) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const double share = pair.active ? factor(graph.island_of(bodies, pair)) : 0;
    if (share == 0) return;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (!contact.impulse.isZero(0)) apply_impulse(bodies, contact, share * contact.impulse);
    }
    if (pair.angular_impulse.isZero(0)) return;
    RigidBodies& rigid = bodies.rigid;
    const auto host = as_index(pair.host), guest = as_index(pair.guest_rigid);
    apply_angular_impulse(rigid.state[guest], rigid.properties[guest], share * pair.angular_impulse);
    apply_angular_impulse(rigid.state[host], rigid.properties[host], -share * pair.angular_impulse);
  });
}

// Sets `island` to the sum over the contacts of every island of p . (v_rel - target n), J, with their
// impulses p and the present velocities.
void add_power(const ContactGraph& graph, const Bodies& bodies, ContactSet& contacts,
               std::vector<double>& island) {
  island.assign(graph.level.size(), 0);
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      pair.power = 0;
      for (int i = pair.begin; pair.active && i < pair.end; ++i) {
        const ContactPoint& contact = contacts.points[as_index(i)];
        if (!contact.impulse.isZero(0))
          pair.power +=
              contact.impulse.dot(relative_velocity(bodies, contact) - contact.target * contact.normal);
      }
    }
  });
  for (int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    island[as_index(graph.island_of(bodies, pair))] += pair.power;
  }
}

// Applies the impulses that the contacts hold, except those of contacts out of reach, which become zero. If
// they would bring an island farther from its targets than no impulses, they are scaled by the best fraction:
// the impulses of an impact would otherwise stir the bodies up more than the sweeps that follow could mend.
void apply_best_share(ContactGraph& graph, Bodies& bodies, ContactSet& contacts) {
  for (ContactPoint& contact : contacts.points)
    if (std::isinf(contact.target)) contact.impulse.setZero();
  std::vector<double>&before = graph.power_before, &after = graph.power_after;
  add_power(graph, bodies, contacts, before);
  apply_impulses(graph, bodies, contacts, [](int) { return 1.0; });
  add_power(graph, bodies, contacts, after);
  // The distance from the targets, in kinetic energy, is a parabola in the fraction s of the impulses. Its
  // slope is `before` at s = 0 and `after` at s = 1, so that its value at 1 is half of their sum, and its
  // minimum lies at before / (before - after). `after` becomes the change of the fraction from 1.
  for (std::size_t i = 0; i < before.size(); ++i)
    after[i] = before[i] + after[i] > 0 ? std::clamp(before[i] / (before[i] - after[i]), 0.0, 1.0) - 1 : 0;
  apply_impulses(graph, bodies, contacts, [&](int island) { return after[as_index(island)]; });
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      const double share = 1 + after[as_index(graph.island_of(bodies, pair))];
      if (share == 1 || !pair.active) continue;
      pair.angular_impulse *= share;
      for (int i = pair.begin; i < pair.end; ++i) contacts.points[as_index(i)].impulse *= share;
    }
  });
}

// Sets the normal to the mean of that at the start of the step and the present one, which is the normal at
// the middle of the step. A round host turns the normal of a point that passes over it; at the end of the
// step it would lean in the direction of the motion and speed it up. If it has turned by more than 26
// degrees, it belongs to another side, and stays.
void turn_to_middle(ContactPoint& contact) {
  if (contact.first_normal == contact.normal ||
      contact.first_normal.dot(contact.normal) < min_agreement_at_middle)
    return;
  contact.normal = (contact.first_normal + contact.normal).normalized();
  contact.response = ContactResponse(contact.response.K, contact.normal);
}

}  // namespace

void update_contacts(const ContactGraph& graph, const Bodies& bodies, ContactSet& contacts,
                     const std::function<bool(const ContactPair&)>& acts_at_end) {
  const bool measured = contacts.measured.hold(bodies, contacts.points.size());
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      const bool turns = pair.guest_rigid < 0 && acts_at_end && acts_at_end(pair);
      for (int i = pair.begin; i < pair.end; ++i) {
        ContactPoint& contact = contacts.points[as_index(i)];
        if (measured && pair.guest_rigid < 0 && contact.plane_frame.kind == PlaneFrame::Kind::host)
          update_geometry(bodies, contacts.measured.touch[as_index(i)], contact);
        else
          update_geometry(bodies, contact);
        if (turns) turn_to_middle(contact);
      }
    }
  });
}

void find_speculative_targets(double dt, OrientationUpdate orientation, const ContactGraph& graph,
                              const Bodies& bodies, ContactSet& contacts, PredictionFor stage,
                              const VelocityState* forces) {
  const RigidBodies& rigid = bodies.rigid;
  contacts.predicted.resize(rigid.size());
  parallel_for(rigid.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      contacts.predicted[b] = shape_pose(
          rigid.properties[b],
          rigid.properties[b].moves() ? evolved_pose(rigid.state[b], dt, orientation) : rigid.state[b].pose);
  });
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      SampleCulling culling;
      for (int i = pair.begin; i < pair.end; ++i)
        contacts.points[as_index(i)].target =
            target_of(bodies, contacts.predicted, dt, stage, forces, contacts.points[as_index(i)], culling);
    }
  });
}

void warm_start(const ContactCache& cache, double duration, ContactGraph& graph, Bodies& bodies,
                ContactSet& contacts) {
  for (ContactPair& pair : contacts.pairs) pair.angular_impulse.setZero();
  parallel_for(contacts.points.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      contacts.points[i].impulse = cached_impulse(cache, contacts.points[i], duration);
  });
  contacts.is_cold.assign(graph.island.size(), 1);
  for (const int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i)
      if (!contacts.points[as_index(i)].impulse.isZero(0))
        contacts.is_cold[as_index(graph.island_of(bodies, pair))] = 0;
  }
  apply_best_share(graph, bodies, contacts);
}

void warm_start_again(double factor, ContactGraph& graph, Bodies& bodies, ContactSet& contacts) {
  for (int p : graph.pairs) {
    ContactPair& pair = contacts.pairs[as_index(p)];
    pair.active = pair.guest_rigid < 0 || pair.collided;
    pair.angular_impulse *= factor;
    for (int i = pair.begin; i < pair.end; ++i) {
      Vec3& impulse = contacts.points[as_index(i)].impulse;
      pair.active |= !impulse.isZero(0) || contacts.points[as_index(i)].is_level_ahead;
      impulse *= factor;
    }
  }
  apply_best_share(graph, bodies, contacts);
}

void store_contacts(const ContactSet& contacts, const ContactGraph& graph, double duration,
                    ContactCache& cache) {
  cache.clear();
  for (int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (!contact.impulse.isZero(0))
        cache.push_back(
            {contact.host, contact.guest_rigid, contact.feature, 0, contact.impulse, duration, contact.edge});
    }
  }
  std::sort(cache.begin(), cache.end(),
            [](const CachedContact& a, const CachedContact& b) { return name_of(a) < name_of(b); });
}

}  // namespace duet
