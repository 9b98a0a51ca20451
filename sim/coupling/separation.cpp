#include "sim/coupling/separation.h"

#include <algorithm>

#include "sim/coupling/push_out.h"

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

constexpr int sweeps = 50;          // Gauss-Seidel sweeps at one geometry
constexpr double tolerance = 1e-8;  // m, where sweeps stop

using Displacement = SeparationScratch::Displacement;

class Separator {
 public:
  Separator(Bodies& bodies, const ContactGraph& graph, ContactSet& contacts, SeparationScratch& scratch)
      : bodies_(bodies), graph_(graph), contacts_(contacts), scratch_(scratch) {}

  // Takes the geometry of all contacts now; returns how many pairs overlap.
  int measure() {
    scratch_.overlaps.assign(contacts_.pairs.size(), 0);
    scratch_.push.assign(contacts_.points.size(), 0);
    scratch_.body.assign(bodies_.rigid.size(), Displacement{});
    parallel_for(graph_.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) measure(as_index(graph_.pairs[k]));
    });
    return static_cast<int>(std::count(scratch_.overlaps.begin(), scratch_.overlaps.end(), 1));
  }

  void solve() {
    for (int i = 0; i < sweeps; ++i)
      if (graph_.schedule.largest(0, graph_.schedule.waves(), [&](int p) { return update(p); }) < tolerance)
        break;
  }

  void apply() {
    RigidBodies& rigid = bodies_.rigid;
    parallel_for(rigid.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b)
        if (!is_zero(scratch_.body[b]))
          displace(rigid.state[b], rigid.properties[b], scratch_.body[b].shift, scratch_.body[b].turn);
    });
  }

 private:
  static bool is_zero(const Displacement& d) { return d.shift.isZero(0) && d.turn.isZero(0); }

  void measure(std::size_t p) {
    const ContactPair& pair = contacts_.pairs[p];
    if (pair.guest_rigid < 0) return;
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& contact = contacts_.points[as_index(i)];
      update_geometry(bodies_, contact);
      if (contact.gap < -overlap_tolerance) scratch_.overlaps[p] = 1;
    }
  }

  void move(int body, const Vec3& arm, const Vec3& push) {
    const auto b = as_index(body);
    scratch_.body[b].shift += bodies_.rigid.properties[b].inverse_mass * push;
    scratch_.body[b].turn += bodies_.rigid.state[b].inverse_inertia * arm.cross(push);
  }

  Vec3 displacement(int body, const Vec3& arm) const {
    const Displacement& d = scratch_.body[as_index(body)];
    return d.shift + d.turn.cross(arm);
  }

  // One Gauss-Seidel update of a pair; returns by how much it moved its points.
  double update(int p) {
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    if (pair.guest_rigid < 0) return 0;
    if (!scratch_.overlaps[as_index(p)] && is_zero(scratch_.body[as_index(pair.host)]) &&
        is_zero(scratch_.body[as_index(pair.guest_rigid)]))
      return 0;
    double largest = 0;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts_.points[as_index(i)];
      const double closing =
          -contact.gap - contact.normal.dot(displacement(contact.guest_rigid, contact.guest_arm) -
                                            displacement(contact.host, contact.host_arm));
      double& push = scratch_.push[as_index(i)];
      const double change = std::max(-push, contact.response.normal_mass * closing);
      if (change == 0) continue;
      push += change;
      move(contact.guest_rigid, contact.guest_arm, change * contact.normal);
      move(contact.host, contact.host_arm, -change * contact.normal);
      largest = std::max(largest, std::abs(change) / contact.response.normal_mass);
    }
    return largest;
  }

  Bodies& bodies_;
  const ContactGraph& graph_;
  ContactSet& contacts_;
  SeparationScratch& scratch_;
};

}  // namespace

int separate_rigid_bodies(Bodies& bodies, const ContactGraph& graph, int iterations, ContactSet& contacts,
                          SeparationScratch& scratch) {
  Separator separator(bodies, graph, contacts, scratch);
  int first = 0;
  for (int i = 0; i < iterations; ++i) {
    const int overlapping = separator.measure();
    if (i == 0) first = overlapping;
    if (overlapping == 0) break;
    separator.solve();
    separator.apply();
  }
  return first;
}

}  // namespace duet
