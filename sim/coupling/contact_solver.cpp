#include "sim/coupling/contact_solver.h"

#include <algorithm>
#include <limits>

#include "sim/coupling/friction.h"

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

constexpr int unreached = std::numeric_limits<int>::max();

std::size_t guest_node(const Bodies& bodies, const ContactPair& pair) {
  return pair.guest_rigid >= 0 ? as_index(pair.guest_rigid)
                               : bodies.rigid.size() + as_index(pair.guest_deformable);
}

bool takes_part(const ContactPair& pair, bool rigid_pairs) {
  return pair.guest_rigid < 0 || (rigid_pairs && pair.collided);
}

// One Gauss-Seidel update of a contact; returns how much it changed the relative velocity.
double update_contact(Bodies& bodies, double inverse_dt, ContactPoint& contact) {
  const Vec3 velocity = relative_velocity(bodies, contact);
  const double target = -std::max(contact.gap, 0.0) * inverse_dt;
  if (contact.impulse.isZero(0) && velocity.dot(contact.normal) >= target) return 0;
  const Vec3 before = velocity - contact.K * contact.impulse;  // as if this contact had not acted yet
  const Vec3 total =
      friction_impulse({contact.normal, contact.K, contact.inverse_K, contact.friction}, before, target);
  const Vec3 change = total - contact.impulse;
  apply_impulse(bodies, contact, change);
  contact.impulse = total;
  return (contact.K * change).norm();
}

}  // namespace

void build_contact_graph(const Bodies& bodies, bool rigid_pairs, ContactSet& contacts, ContactGraph& graph) {
  graph.level.assign(bodies.rigid.size() + bodies.deformable.size(), unreached);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_static()) graph.level[i] = 0;

  // Breadth first: each round reaches one level further; at most as many rounds as bodies.
  bool reached = true;
  for (int level = 0; reached; ++level) {
    reached = false;
    for (const ContactPair& pair : contacts.pairs) {
      if (!takes_part(pair, rigid_pairs)) continue;
      int& host = graph.level[as_index(pair.host)];
      int& guest = graph.level[guest_node(bodies, pair)];
      if (host == level && guest == unreached) guest = level + 1, reached = true;
      if (guest == level && host == unreached) host = level + 1, reached = true;
    }
  }
  graph.order.clear();
  for (std::size_t i = 0; i < contacts.pairs.size(); ++i) {
    ContactPair& pair = contacts.pairs[i];
    if (!takes_part(pair, rigid_pairs)) continue;
    pair.level = std::max(graph.level[as_index(pair.host)], graph.level[guest_node(bodies, pair)]);
    graph.order.push_back(static_cast<int>(i));
  }
  std::sort(graph.order.begin(), graph.order.end(), [&](int a, int b) {
    const int level_a = contacts.pairs[as_index(a)].level, level_b = contacts.pairs[as_index(b)].level;
    return level_a != level_b ? level_a < level_b : a < b;
  });
}

int solve_contact(Bodies& bodies, const ContactGraph& graph, double dt, const ContactSolveSettings& settings,
                  ContactSet& contacts) {
  const double inverse_dt = 1 / dt;
  for (int iteration = 0; iteration < settings.iterations; ++iteration) {
    double largest = 0;
    for (int p : graph.order) {
      const ContactPair& pair = contacts.pairs[as_index(p)];
      for (int i = pair.begin; i < pair.end; ++i)
        largest = std::max(largest, update_contact(bodies, inverse_dt, contacts.points[as_index(i)]));
    }
    if (largest < settings.tolerance) return iteration + 1;
  }
  return settings.iterations;
}

int count_active(const ContactSet& contacts, const ContactGraph& graph) {
  int active = 0;
  for (int p : graph.order)
    for (int i = contacts.pairs[as_index(p)].begin; i < contacts.pairs[as_index(p)].end; ++i)
      if (!contacts.points[as_index(i)].impulse.isZero(0)) ++active;
  return active;
}

}  // namespace duet
