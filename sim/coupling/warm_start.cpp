#include "sim/coupling/warm_start.h"

#include <algorithm>
#include <tuple>

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

template <class Contact>
auto name_of(const Contact& contact) {
  return std::tie(contact.host, contact.guest_rigid, contact.guest_point);
}

Vec3 remembered_force(const ContactMemory& memory, const ContactPoint& contact) {
  const auto found = std::lower_bound(
      memory.begin(), memory.end(), contact,
      [](const RememberedContact& a, const ContactPoint& b) { return name_of(a) < name_of(b); });
  return found != memory.end() && name_of(*found) == name_of(contact) ? found->force : Vec3::Zero();
}

// Applies what `begin_contact` returns as a contact's impulse.
template <class Begin>
void apply_to_all(const ContactGraph& graph, Bodies& bodies, ContactSet& contacts, Begin&& begin_contact) {
  graph.schedule.for_each([&](int p) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& contact = contacts.points[as_index(i)];
      contact.impulse = begin_contact(contact);
      if (!contact.impulse.isZero(0)) apply_impulse(bodies, contact, contact.impulse);
    }
  });
}

}  // namespace

void warm_start(const ContactMemory& memory, double duration, const ContactGraph& graph, Bodies& bodies,
                ContactSet& contacts) {
  for (ContactPoint& contact : contacts.points) contact.impulse.setZero();
  for (ContactPair& pair : contacts.pairs) pair.angular_impulse.setZero();
  apply_to_all(graph, bodies, contacts, [&](const ContactPoint& contact) -> Vec3 {
    return duration * remembered_force(memory, contact);
  });
}

void warm_start_again(double factor, const ContactGraph& graph, Bodies& bodies, ContactSet& contacts) {
  for (int p : graph.pairs) {
    ContactPair& pair = contacts.pairs[as_index(p)];
    pair.active = pair.guest_rigid < 0 || pair.collided;
    for (int i = pair.begin; i < pair.end && !pair.active; ++i)
      pair.active = !contacts.points[as_index(i)].impulse.isZero(0);
  }
  apply_to_all(graph, bodies, contacts, [&](ContactPoint& contact) -> Vec3 {
    update_geometry(bodies, contact);
    return factor * contact.impulse;
  });
  graph.schedule.for_each([&](int p) {
    ContactPair& pair = contacts.pairs[as_index(p)];
    if (pair.angular_impulse.isZero(0)) return;
    pair.angular_impulse *= factor;
    const auto host = as_index(pair.host), guest = as_index(pair.guest_rigid);
    RigidBodies& rigid = bodies.rigid;
    apply_angular_impulse(rigid.state[guest], rigid.properties[guest], pair.angular_impulse);
    apply_angular_impulse(rigid.state[host], rigid.properties[host], -pair.angular_impulse);
  });
}

void remember(const ContactSet& contacts, const ContactGraph& graph, double duration, ContactMemory& memory) {
  memory.clear();
  for (int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (!contact.impulse.isZero(0))
        memory.push_back(
            {contact.host, contact.guest_rigid, contact.guest_point, 0, contact.impulse / duration});
    }
  }
  std::sort(memory.begin(), memory.end(),
            [](const RememberedContact& a, const RememberedContact& b) { return name_of(a) < name_of(b); });
}

}  // namespace duet
