#include "sim/contact/response/turned_impulses.h"

#include <algorithm>
#include <optional>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr double min_agreement_of_frames = 0.9;  // least cosine of the turn of a normal

// Returns the vector turned by the smallest rotation from the unit vector `from` to the unit vector `to`:
//   v + w x v + w x (w x v) / (1 + c),   w = from x to,   c = from . to.
Vec3 turned_with(const Vec3& from, const Vec3& to, const Vec3& v) {
  const Vec3 w = from.cross(to), sideways = w.cross(v);
  return v + sideways + w.cross(sideways) / (1 + from.dot(to));
}

// Returns the place of a contact in the shape space of its rigid guest, m.
Vec3 place_on_guest(const RigidBodies& rigid, const ContactPoint& contact) {
  const auto guest = as_index(contact.guest_rigid);
  return shape_pose(rigid, guest).to_body(rigid.state[guest].pose.position + contact.guest_arm);
}

// Returns whether two places on a round surface (m, shape space) are those of two vertices.
bool are_two_vertices(const Vec3& a, const Vec3& b) {
  constexpr double same_vertex = 1e-9;  // distance by rounding, relative to that from the origin
  return (a - b).norm() > same_vertex * (a.norm() + b.norm());
}

// Adds an impulse (N s) and an angular impulse (N m s) to a rigid body, unless its mass is infinite.
void add_impulses(const RigidProperties& properties, const Vec3& impulse, const Vec3& angular,
                  RigidState& state) {
  if (!properties.is_dynamic()) return;
  state.velocity += properties.inverse_mass * impulse;
  apply_angular_impulse(state, properties, angular);
}

// The velocities that the normal impulses of all contacts of a pair of rigid bodies give to the two.
struct GivenVelocities {
  RigidState host, guest;

  GivenVelocities(const RigidBodies& rigid, const ContactSet& contacts, const ContactPair& pair) {
    const auto h = as_index(pair.host), g = as_index(pair.guest_rigid);
    host = rigid.state[h];
    guest = rigid.state[g];
    for (RigidState* state : {&host, &guest}) state->velocity = state->angular_velocity = Vec3::Zero();
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      const Vec3 push = std::max(0.0, contact.impulse.dot(contact.normal)) * contact.normal;
      add_impulses(rigid.properties[h], -push, -contact.host_arm.cross(push), host);
      add_impulses(rigid.properties[g], push, contact.guest_arm.cross(push), guest);
    }
  }
  // Returns the velocity along the normal with which they part at a contact, m/s.
  double at(const ContactPoint& contact) const {
    return contact.normal.dot(guest.velocity + guest.angular_velocity.cross(contact.guest_arm) -
                              host.velocity - host.angular_velocity.cross(contact.host_arm));
  }
};

// Notes at which vertex a contact on a round surface acts, and which part of its impulse is load. The rest is
// taken to act along the normal, with the friction that is in proportion to it. `given` is that of its pair.
void note_vertex(const RigidBodies& rigid, const GivenVelocities& given, const ContactPoint& contact,
                 ContactFrame& frame) {
  frame.on_guest = place_on_guest(rigid, contact);
  frame.orientation = shape_pose(rigid, as_index(contact.guest_rigid)).orientation;
  frame.apart = contact.host_arm - contact.guest_arm;
  frame.gap = contact.gap;
  if (const double parting = given.at(contact); parting > 0)
    frame.load = std::clamp(1 - contact.landing / parting, 0.0, 1.0);
}

// Divides the impulse of step III between the vertex A of a round surface, where it was found, and the vertex
// B that has landed in the step, where the contact is now. The load of the step acts at A until B lands,
// after the fraction
//   s = b / (a + b)
// of the step, with the gap b of B at the beginning and the gap a of A at the end, and then at B, both with
// the arms of the middle of their times. What lets B land acts at B with the arms of the beginning: it moves
// the bodies in the rest of the step.
void divide_between_vertices(const RigidBodies& rigid, const ContactPoint& contact, ContactFrame& first) {
  const Vec3 way = place_on_guest(rigid, contact) - first.on_guest;  // from A to B, m, shape space
  const Vec3 at_start = first.orientation * way,
             at_end = shape_pose(rigid, as_index(contact.guest_rigid)).orientation * way;
  const double b = std::max(0.0, first.gap + first.normal.dot(at_start)),
               a = std::max(0.0, contact.gap - contact.normal.dot(at_end));
  const double s = a + b > 0 ? b / (a + b) : 0;
  const Vec3 moved = contact.host_arm - contact.guest_arm - first.apart;  // of the guest along the host, m
  const double load_of_b = 2 * (1 - s) * first.load, of_b = load_of_b + 1 - first.load;
  const double late = of_b > 0 ? load_of_b / of_b : 0;
  first.relieved = 2 * s * first.load * first.impulse;
  first.relieved_host_arm = first.host_arm;
  first.relieved_guest_arm = first.guest_arm - s / 2 * moved;
  first.impulse *= of_b;
  first.host_arm = (1 - late) * (first.host_arm + at_start) + late * contact.host_arm;
  first.guest_arm =
      (1 - late) * (first.guest_arm + at_start) + late * (contact.guest_arm + (1 - s) / 2 * moved);
}

// Adds an impulse (N s) and an angular impulse (N m s) to the rigid body `body`.
void add_impulses(RigidBodies& rigid, int body, const Vec3& impulse, const Vec3& angular) {
  add_impulses(rigid.properties[as_index(body)], impulse, angular, rigid.state[as_index(body)]);
}

}  // namespace

TurnedImpulse turned_impulse(const ContactFrame& first, const ContactPoint& contact) {
  const Vec3 turned = turned_with(first.normal, contact.normal, first.impulse);
  const Vec3& relieved = first.relieved;
  return {.impulse = turned,
          .to_guest = first.impulse - turned + relieved,
          .turns_guest = first.guest_arm.cross(first.impulse) - contact.guest_arm.cross(turned) +
                         first.relieved_guest_arm.cross(relieved),
          .turns_host = contact.host_arm.cross(turned) - first.host_arm.cross(first.impulse) -
                        first.relieved_host_arm.cross(relieved)};
}

void note_frames(const ContactGraph& graph, const Bodies& bodies, const ContactSet& contacts,
                 std::vector<ContactFrame>& frames) {
  frames.assign(contacts.points.size(), {});
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      if (!pair.active) continue;
      std::optional<GivenVelocities> given;
      for (int i = pair.begin; i < pair.end; ++i) {
        const ContactPoint& contact = contacts.points[as_index(i)];
        if (contact.meets_ahead) continue;
        ContactFrame& frame = frames[as_index(i)];
        frame.normal = contact.normal;
        frame.host_arm = contact.host_arm;
        frame.guest_arm = contact.guest_arm;
        frame.impulse = contact.impulse;
        if (is_on_round_surface(contact)) {
          if (!given) given.emplace(bodies.rigid, contacts, pair);
          note_vertex(bodies.rigid, *given, contact, frame);
        }
        if (!contact.is_rigid_pair()) frame.place = surface_point(bodies, contact);
      }
    }
  });
}

void act_at_start(std::vector<ContactFrame>& frames, ContactGraph& graph, Bodies& bodies,
                  ContactSet& contacts) {
  graph.sweeps.once([&](int p) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactFrame& first = frames[as_index(i)];
      ContactPoint& contact = contacts.points[as_index(i)];
      if (first.impulse.isZero(0)) continue;
      if (!pair.active || contact.meets_ahead || first.normal.dot(contact.normal) < min_agreement_of_frames) {
        first.impulse.setZero();
        continue;
      }
      const Vec3 whole = first.impulse;
      if (is_on_round_surface(contact) &&
          are_two_vertices(place_on_guest(bodies.rigid, contact), first.on_guest))
        divide_between_vertices(bodies.rigid, contact, first);
      const TurnedImpulse turned = turned_impulse(first, contact);
      contact.impulse = turned_with(first.normal, contact.normal, whole - first.relieved / 2);
      if (moves_host(bodies, contact))
        add_impulses(bodies.rigid, contact.host, -turned.to_guest, turned.turns_host);
      if (contact.is_rigid_pair()) {
        add_impulses(bodies.rigid, contact.guest_rigid, turned.to_guest, turned.turns_guest);
        continue;
      }
      const SurfacePoint& now = surface_point(bodies, contact);
      if (!contact
               .is_on_edge()) {  // it stays at its place, and to_guest is zero if the normal has not turned
        apply_impulse(now, turned.to_guest, bodies.particles);
        continue;
      }
      apply_impulse(first.place, first.impulse, bodies.particles);
      apply_impulse(now, -turned.impulse, bodies.particles);
    }
  });
}

Momentum moved_by_turning(const std::vector<ContactFrame>& frames, const Bodies& bodies,
                          const ContactSet& contacts) {
  Momentum total;
  const auto add = [&](const Vec3& place, const Vec3& impulse) { total += {impulse, place.cross(impulse)}; };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const ContactFrame& first = frames[i];
    const ContactPoint& contact = contacts.points[i];
    if (first.is_idle()) continue;
    const auto h = as_index(contact.host);
    const Vec3& host = bodies.rigid.state[h].pose.position;
    Vec3 at_start, at_end, relieved = Vec3::Zero();  // m, now: places on the guest where its impulses act
    bool moves_guest = true;
    if (contact.is_rigid_pair()) {
      const auto g = as_index(contact.guest_rigid);
      at_start = bodies.rigid.state[g].pose.position + first.guest_arm;
      at_end = bodies.rigid.state[g].pose.position + contact.guest_arm;
      relieved = bodies.rigid.state[g].pose.position + first.relieved_guest_arm;
      moves_guest = bodies.rigid.properties[g].is_dynamic();
    } else {
      at_start = weighted(first.place, bodies.particles.x);
      at_end = weighted(surface_point(bodies, contact), bodies.particles.x);
    }
    if (moves_guest && moves_host(bodies, contact) && bodies.rigid.properties[h].is_dynamic()) {
      total.angular += (at_start - host - first.host_arm).cross(first.impulse) +
                       (relieved - host - first.relieved_host_arm).cross(first.relieved);
      continue;
    }
    const double sign = moves_guest ? 1 : -1;
    const Vec3 turned = turned_impulse(first, contact).impulse;
    add(moves_guest ? at_start : host + first.host_arm, sign * first.impulse);
    add(moves_guest ? relieved : host + first.relieved_host_arm, sign * first.relieved);
    add(moves_guest ? at_end : host + contact.host_arm, -sign * turned);
  }
  return total;
}

}  // namespace duet
