#include "sim/contact/response/turned_impulses.h"

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

// Adds an impulse (N s) and an angular impulse (N m s) to a rigid body.
void add_impulses(RigidBodies& rigid, int body, const Vec3& impulse, const Vec3& angular) {
  const auto b = as_index(body);
  if (!rigid.properties[b].is_dynamic()) return;
  rigid.state[b].velocity += rigid.properties[b].inverse_mass * impulse;
  apply_angular_impulse(rigid.state[b], rigid.properties[b], angular);
}

}  // namespace

TurnedImpulse turned_impulse(const ContactFrame& first, const ContactPoint& contact) {
  const Vec3 turned = turned_with(first.normal, contact.normal, first.impulse);
  return {.impulse = turned,
          .to_guest = first.impulse - turned,
          .turns_guest = first.guest_arm.cross(first.impulse) - contact.guest_arm.cross(turned),
          .turns_host = contact.host_arm.cross(turned) - first.host_arm.cross(first.impulse)};
}

void note_frames(const ContactGraph& graph, const Bodies& bodies, const ContactSet& contacts,
                 std::vector<ContactFrame>& frames) {
  frames.assign(contacts.points.size(), {});
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const ContactPair& pair = contacts.pairs[as_index(graph.pairs[k])];
      if (!pair.active) continue;
      for (int i = pair.begin; i < pair.end; ++i) {
        const ContactPoint& contact = contacts.points[as_index(i)];
        if (contact.meets_ahead) continue;
        ContactFrame& frame = frames[as_index(i)];
        frame = {{}, contact.normal, contact.host_arm, contact.guest_arm, contact.impulse, {}};
        if (is_on_round_surface(contact)) frame.on_guest = place_on_guest(bodies.rigid, contact);
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
      if (!pair.active || contact.meets_ahead || first.normal.dot(contact.normal) < min_agreement_of_frames ||
          (is_on_round_surface(contact) &&
           are_two_vertices(place_on_guest(bodies.rigid, contact), first.on_guest))) {
        first.impulse.setZero();
        continue;
      }
      const TurnedImpulse turned = turned_impulse(first, contact);
      contact.impulse = turned.impulse;
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
    if (first.impulse.isZero(0)) continue;
    const auto h = as_index(contact.host);
    const Vec3& host = bodies.rigid.state[h].pose.position;
    Vec3 at_start, at_end;  // m, now: the places on the guest where its impulses act
    bool moves_guest = true;
    if (contact.is_rigid_pair()) {
      const auto g = as_index(contact.guest_rigid);
      at_start = bodies.rigid.state[g].pose.position + first.guest_arm;
      at_end = bodies.rigid.state[g].pose.position + contact.guest_arm;
      moves_guest = bodies.rigid.properties[g].is_dynamic();
    } else {
      at_start = weighted(first.place, bodies.particles.x);
      at_end = weighted(surface_point(bodies, contact), bodies.particles.x);
    }
    if (moves_guest && moves_host(bodies, contact) && bodies.rigid.properties[h].is_dynamic()) {
      total.angular += (at_start - host - first.host_arm).cross(first.impulse);
      continue;
    }
    const double sign = moves_guest ? 1 : -1;
    const Vec3 turned = turned_impulse(first, contact).impulse;
    add(moves_guest ? at_start : host + first.host_arm, sign * first.impulse);
    add(moves_guest ? at_end : host + contact.host_arm, -sign * turned);
  }
  return total;
}

}  // namespace duet
