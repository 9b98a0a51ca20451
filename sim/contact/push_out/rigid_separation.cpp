#include "sim/contact/push_out/rigid_separation.h"

#include <algorithm>
#include <limits>

#include "sim/base/stop.h"
#include "sim/contact/push_out/push_out.h"

namespace duet {
namespace {

constexpr int sweeps = 50;        // Gauss-Seidel sweeps at one geometry, at most
constexpr int level_sweeps = 10;  // sweeps over a group of a shock layer, at most
// Displacement in a sweep at which sweeps stop, m over its precision: a hundredth of overlap_tolerance.
constexpr double tolerance = 1e-8;

using Displacement = SeparationScratch::Displacement;

// One call of separate_rigid_bodies().
class Separator {
 public:
  Separator(Bodies& bodies, const ArticulatedResponse* linked, ContactGraph& graph, ContactSet& contacts,
            SeparationScratch& scratch)
      : bodies_(bodies), linked_(linked), graph_(graph), contacts_(contacts), scratch_(scratch) {}

  // Resets the displacements and measures all pairs at the present positions. Returns the number of pairs
  // that overlap.
  int measure() {
    scratch_.overlaps.assign(contacts_.pairs.size(), 0);
    scratch_.measured.assign(contacts_.pairs.size(), 0);
    scratch_.push.assign(contacts_.points.size(), 0);
    scratch_.body.assign(bodies_.rigid.size(), Displacement{});
    parallel_for(graph_.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        scratch_.overlaps[as_index(graph_.pairs[k])] = overlap(contacts_.pairs[as_index(graph_.pairs[k])]);
    });
    return static_cast<int>(std::count(scratch_.overlaps.begin(), scratch_.overlaps.end(), 1));
  }

  // Sweeps over all pairs. Returns the deepest overlap that is left, m over its precision.
  double solve() {
    graph_.sweeps.repeat(sweeps, tolerance, [&](int p) { return update(p); });
    const auto deeper = [](double a, double b) { return std::max(a, b); };
    return parallel_reduce(
        graph_.pairs.size(), 64, 0.0,
        [&](std::size_t begin, std::size_t end) {
          double deepest = 0;
          for (std::size_t k = begin; k < end; ++k) deepest = deeper(deepest, left_in(graph_.pairs[k]));
          return deepest;
        },
        deeper);
  }

  // Lifts the upper body of every pair off the lower one, level by level.
  void lift() {
    build_shock_layers(contacts_, graph_);
    graph_.shock_layers.for_each([&](std::span<const int> pairs) {
      for (int i = 0; i < level_sweeps; ++i) {
        double largest = 0;
        for (const int p : pairs) largest = std::max(largest, update_upper(p));
        if (largest < tolerance) break;
      }
    });
  }

  // Moves the bodies by their displacements.
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

  // Returns whether a contact is passed over: a support point acts for it against the faces of a mesh, and
  // its own distance is that of the grid. Where the grid is above the faces, it would lift what lies on them.
  bool is_left_to_support(const ContactPoint& contact) const {
    return contact.is_carried &&
           bodies_.rigid.properties[as_index(contact.host)].shape.kind == LevelSet::Kind::grid;
  }

  // Returns whether a contact of a rigid pair overlaps by more than the tolerance.
  bool overlap(const ContactPair& pair) const {
    if (pair.guest_rigid < 0) return false;
    const auto first = contacts_.points.begin() + pair.begin, last = contacts_.points.begin() + pair.end;
    return std::any_of(first, last, [&](const ContactPoint& contact) {
      return !is_left_to_support(contact) &&
             gap_now(bodies_, contact) < -overlap_tolerance * contact.precision;
    });
  }

  // Returns whether the pair has to be visited: it overlaps, or a body of it is displaced. Updates its
  // contacts to the present geometry the first time, because in a heap at rest few pairs are ever visited.
  bool takes_part(int p) {
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    if (pair.guest_rigid < 0) return false;
    if (!scratch_.overlaps[as_index(p)] && is_zero(scratch_.body[as_index(pair.host)]) &&
        is_zero(scratch_.body[as_index(pair.guest_rigid)]))
      return false;
    if (!scratch_.measured[as_index(p)]) {  // written once, because other threads read neighboring entries
      for (int i = pair.begin; i < pair.end; ++i) measure(contacts_.points[as_index(i)]);
      scratch_.measured[as_index(p)] = 1;
    }
    return true;
  }

  // Updates geometry and response of a contact.
  void measure(ContactPoint& contact) const {
    update_geometry(bodies_, contact);
    if (linked_ && linked_->takes_part(contact)) contact.response = linked_->response(contact, bodies_);
  }

  bool is_linked(int body) const { return linked_ && linked_->contains(body); }

  // Displaces a body, or its jointed group, by the pseudo-impulse `push` (kg m) at `arm`.
  void move(int body, const Vec3& arm, const Vec3& push) {
    if (is_linked(body)) {
      linked_->for_each_change(body, wrench_of(arm, push), [&](std::size_t moved, const Vec6& change) {
        scratch_.body[moved].shift += change.head<3>();
        scratch_.body[moved].turn += change.tail<3>();
      });
      return;
    }
    const auto b = as_index(body);
    scratch_.body[b].shift += bodies_.rigid.properties[b].inverse_mass * push;
    scratch_.body[b].turn += bodies_.rigid.state[b].inverse_inertia * arm.cross(push);
  }

  // Returns the displacement of a body at `arm`, m.
  Vec3 displacement(int body, const Vec3& arm) const {
    const Displacement& d = scratch_.body[as_index(body)];
    return d.shift + d.turn.cross(arm);
  }

  // Returns the overlap of a contact after the displacements, m; minus infinity if it is passed over.
  double closing(const ContactPoint& contact) const {
    if (is_left_to_support(contact)) return -std::numeric_limits<double>::infinity();
    return -contact.gap - contact.normal.dot(displacement(contact.guest_rigid, contact.guest_arm) -
                                             displacement(contact.host, contact.host_arm));
  }

  // Returns the deepest overlap of a pair after the displacements, m over its precision.
  double left_in(int p) const {
    double deepest = 0;
    if (!scratch_.measured[as_index(p)]) return deepest;  // no body of the pair has moved
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    for (int i = pair.begin; i < pair.end; ++i)
      deepest =
          std::max(deepest, closing(contacts_.points[as_index(i)]) / contacts_.points[as_index(i)].precision);
    return deepest;
  }

  // Changes the pseudo-impulse of contact `i` so that it neither overlaps nor is pushed apart. Returns the
  // change, kg m.
  double change(int i, double normal_mass) {
    double& push = scratch_.push[as_index(i)];
    const double change = std::max(-push, normal_mass * closing(contacts_.points[as_index(i)]));
    push += change;
    return change;
  }

  // Updates the contacts of a pair once. Returns the largest displacement of a point, m over its precision.
  double update(int p) {
    if (!takes_part(p)) return 0;
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    double largest = 0;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts_.points[as_index(i)];
      const double push = change(i, contact.response.normal_mass);
      if (push == 0) continue;
      move(contact.guest_rigid, contact.guest_arm, push * contact.normal);
      move(contact.host, contact.host_arm, -push * contact.normal);
      largest = std::max(largest, std::abs(push) / (contact.response.normal_mass * contact.precision));
    }
    return largest;
  }

  // Updates the contacts of a pair once with the lower body held, or with both bodies free if they have one
  // level. Jointed upper bodies stay, because they would move others of any level. Returns the largest
  // displacement of a point, m over its precision.
  double update_upper(int p) {
    const ContactPair& pair = contacts_.pairs[as_index(p)];
    const int host_level = graph_.level[as_index(pair.host)],
              guest_level = graph_.level[as_index(pair.guest_rigid)];
    const int upper = host_level > guest_level ? pair.host : pair.guest_rigid;
    if (is_linked(upper) || (host_level == guest_level && is_linked(pair.host))) return 0;
    if (host_level == guest_level) return update(p);
    if (!takes_part(p)) return 0;
    const RigidState& state = bodies_.rigid.state[as_index(upper)];
    const double inverse_mass = bodies_.rigid.properties[as_index(upper)].inverse_mass;
    double largest = 0;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts_.points[as_index(i)];
      const bool is_guest = contact.guest_rigid == upper;
      const Vec3& arm = is_guest ? contact.guest_arm : contact.host_arm;
      const Vec3 normal = is_guest ? contact.normal : Vec3(-contact.normal);
      const double normal_mass = 1 / normal.dot(impulse_factor(state, inverse_mass, arm) * normal);
      const double push = change(i, normal_mass);
      if (push == 0) continue;
      move(upper, arm, push * normal);
      largest = std::max(largest, std::abs(push) / (normal_mass * contact.precision));
    }
    return largest;
  }

  Bodies& bodies_;
  const ArticulatedResponse* linked_;
  ContactGraph& graph_;
  ContactSet& contacts_;
  SeparationScratch& scratch_;
};

}  // namespace

int separate_rigid_bodies(Bodies& bodies, const ArticulatedResponse* linked, ContactGraph& graph,
                          int iterations, ContactSet& contacts, SeparationScratch& scratch) {
  Separator separator(bodies, linked, graph, contacts, scratch);
  int first = 0;
  for (int i = 0; i < iterations; ++i) {
    stop_if_asked();
    const int overlapping = separator.measure();
    if (i == 0) first = overlapping;
    if (overlapping == 0) break;
    if (separator.solve() > overlap_tolerance) separator.lift();
    separator.apply();
  }
  return first;
}

}  // namespace duet
