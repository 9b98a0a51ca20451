#include "sim/contact/push_out/push_out.h"

#include <algorithm>
#include <span>
#include <tuple>

#include "sim/base/rotation.h"
#include "sim/base/stop.h"

namespace duet {
namespace {

constexpr int all_levels = -1;  // a level that stands for all

// One call of resolve_interpenetration().
class PushOut {
 public:
  PushOut(Bodies& bodies, ContactSet& contacts, const ContactGraph& graph, const PushOutSettings& settings,
          PushOutScratch& scratch)
      : bodies_(bodies), contacts_(contacts), graph_(graph), settings_(settings), scratch_(scratch) {
    const std::size_t nodes = bodies.rigid.size() + bodies.deformable.size();
    scratch_.gap.resize(contacts.points.size());
    contacts.measured.touch.resize(contacts.points.size());
    contacts.measured.x.clear();
    find_kept();
    scratch_.order.reserve(contacts.points.size());
    scratch_.moved.assign(nodes, 1);
    scratch_.opened.assign(contacts.points.size(), 0);
    scratch_.opening.assign(contacts.points.size(), 0);
    scratch_.frozen.clear();
    scratch_.taken.assign(bodies.particles.size(), -1);
    sort_central();
  }

  // Opens `fraction` of every overlap of the central bodies of a level. Returns the number of sweeps; 0: no
  // overlap.
  int push(int level, double fraction) {
    measure();
    scratch_.system.begin(bodies_, scratch_.frozen);
    if (gather(level, fraction) == 0) return 0;
    rank_central(level);
    scratch_.system.factor(scratch_.rank);
    const int sweeps = scratch_.system.solve(solve_tolerance * precision_, settings_.sweeps);
    scratch_.system.apply(bodies_, scratch_.moved);
    std::fill(scratch_.moved.begin() + static_cast<std::ptrdiff_t>(bodies_.rigid.size()),
              scratch_.moved.end(), 1);
    std::swap(scratch_.opened, scratch_.opening);
    return sweeps;
  }

  // Opens `fraction` of every overlap level by level, from the lowest. Returns the largest number of sweeps
  // of a level.
  int push_levels(double fraction) {
    const bool freezes = settings_.order == PushOutOrder::frozen_levels;
    const int highest =
        graph_.level.empty() ? 0 : *std::max_element(graph_.level.begin(), graph_.level.end());
    if (freezes) scratch_.frozen.assign(graph_.level.size(), 0);
    int most = 0;
    for (int level = 0; level <= highest; ++level) {
      most = std::max(most, push(level, fraction));
      for (std::size_t body = 0; freezes && body < graph_.level.size(); ++body)
        if (graph_.level[body] == level && graph_.supported[body]) scratch_.frozen[body] = 1;
    }
    scratch_.frozen.clear();
    return most;
  }

 private:
  // Lists the rigid bodies that take part in contact, in the order of the contact graph.
  void sort_central() {
    std::vector<int>& central = scratch_.central;
    central.clear();
    for (std::size_t body = 0; body < bodies_.rigid.size(); ++body)
      if (graph_.first_pair[body] < graph_.first_pair[body + 1]) central.push_back(static_cast<int>(body));
    // Within a level the lightest come first: a light body between heavy ones then meets all of them at once,
    // before one of them alone throws it into the next (the messenger problem, paper section 6.1).
    const auto key = [&](int body) {
      return std::tuple(graph_.level[as_index(body)], bodies_.rigid.properties[as_index(body)].mass, body);
    };
    std::sort(central.begin(), central.end(), [&](int a, int b) { return key(a) < key(b); });
  }

  // Ranks the central bodies of a level.
  void rank_central(int level) {
    scratch_.rank.assign(bodies_.rigid.size(), -1);
    for (std::size_t i = 0; i < scratch_.central.size(); ++i) {
      const auto body = as_index(scratch_.central[i]);
      if (level == all_levels || graph_.level[body] == level) scratch_.rank[body] = static_cast<int>(i);
    }
  }

  // Finds the overlaps that this step leaves, from the gaps that the contacts have: those of the start of the
  // step.
  void find_kept() {
    scratch_.kept.assign(contacts_.points.size(), 0);
    if (settings_.overlapping.empty()) return;
    for (const int p : graph_.pairs) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      if (pair.guest_rigid >= 0 ||
          !std::binary_search(settings_.overlapping.begin(), settings_.overlapping.end(),
                              std::pair(pair.host, pair.guest_deformable)))
        continue;
      const double size = bodies_.deformable[as_index(pair.guest_deformable)].element_size;
      for (int i = pair.begin; i < pair.end; ++i)
        scratch_.kept[as_index(i)] = overlap_kept(-contacts_.points[as_index(i)].gap, size);
    }
  }

  bool takes_part(const ContactPair& pair) const { return settings_.rigid_pairs || pair.guest_rigid < 0; }

  // Measures the gaps of the pairs with a body that has moved.
  void measure() {
    parallel_for(graph_.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const ContactPair& pair = contacts_.pairs[as_index(graph_.pairs[i])];
        if (!takes_part(pair)) continue;
        if (!scratch_.moved[as_index(pair.host)] && !scratch_.moved[guest_node(bodies_, pair)]) continue;
        for (int k = pair.begin; k < pair.end; ++k) {
          Touch& now = contacts_.measured.touch[as_index(k)];
          now = touch(bodies_, contacts_.points[as_index(k)]);
          scratch_.gap[as_index(k)] = now.gap + scratch_.kept[as_index(k)];
        }
      }
    });
    std::fill(scratch_.moved.begin(), scratch_.moved.end(), 0);
  }

  // Adds the overlaps to the system, and the contacts that the last system opened and that still touch, so
  // that this one does not close them again. Returns the number of overlaps.
  int gather(int level, double fraction) {
    std::fill(scratch_.opening.begin(), scratch_.opening.end(), 0);
    precision_ = 1;
    int overlapping = 0;
    for (const int p : graph_.pairs) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      if (!takes_part(pair)) continue;
      if (level != all_levels && graph_.level[as_index(pair.host)] != level &&
          graph_.level[guest_node(bodies_, pair)] != level)
        continue;
      overlapping += pair.guest_rigid < 0 ? gather_points(pair, fraction) : gather_deepest(pair, fraction);
    }
    return overlapping;
  }

  double tolerance(int i) const { return overlap_tolerance * contacts_.points[as_index(i)].precision; }
  bool overlaps(int i) const { return scratch_.gap[as_index(i)] < -tolerance(i); }
  bool touches(int i) const {
    return scratch_.opened[as_index(i)] && scratch_.gap[as_index(i)] < tolerance(i);
  }

  // Adds the overlapping points of a deformable body, the deepest first, but no two with a common particle,
  // which would move twice. In another order a slight overlap could keep the deepest one from its turn in
  // every iteration of every step. Returns the number of overlaps.
  int gather_points(const ContactPair& pair, double fraction) {
    std::vector<int>& order = scratch_.order;
    order.clear();
    for (int i = pair.begin; i < pair.end; ++i)
      if (overlaps(i) || touches(i)) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
      return std::tuple(scratch_.gap[as_index(a)], a) < std::tuple(scratch_.gap[as_index(b)], b);
    });
    const int mark = ++stamp_;
    int overlapping = 0;
    for (const int i : order) {
      const SurfacePoint& carrier = surface_point(bodies_, contacts_.points[as_index(i)]);
      const auto particles = std::span(carrier.particle).first(static_cast<std::size_t>(carrier.count));
      if (std::any_of(particles.begin(), particles.end(),
                      [&](int q) { return scratch_.taken[as_index(q)] == mark; }))
        continue;
      for (int q : particles) scratch_.taken[as_index(q)] = mark;
      add(i, pair, fraction);
      overlapping += overlaps(i);
    }
    return overlapping;
  }

  // Adds the deepest overlap of two rigid bodies, which may have been found from either side. Returns 1 if it
  // overlaps, else 0.
  int gather_deepest(const ContactPair& pair, double fraction) {
    int deepest = pair.begin;
    bool touched = false;
    for (int i = pair.begin; i < pair.end; ++i) {
      touched = touched || touches(i);
      if (scratch_.gap[as_index(i)] < scratch_.gap[as_index(deepest)]) deepest = i;
    }
    if (pair.begin == pair.end || (!overlaps(deepest) && !touched)) return 0;
    add(deepest, pair, fraction);
    return overlaps(deepest);
  }

  // Updates a contact to the present geometry and adds it to the system.
  void add(int i, const ContactPair& pair, double fraction) {
    ContactPoint& contact = contacts_.points[as_index(i)];
    update_geometry(bodies_, contact);
    precision_ = std::min(precision_, contact.precision);
    scratch_.opening[as_index(i)] = 1;
    const double gap = contact.gap + scratch_.kept[as_index(i)];
    scratch_.system.add(contact, guest_node(bodies_, pair), -fraction * gap * contact.normal);
  }

  // Error of the displacements of a system, m over the precision of its contacts.
  static constexpr double solve_tolerance = 0.1 * overlap_tolerance;

  Bodies& bodies_;
  ContactSet& contacts_;
  const ContactGraph& graph_;
  const PushOutSettings& settings_;
  PushOutScratch& scratch_;
  int stamp_ = 0;         // the last mark in scratch_.taken
  double precision_ = 1;  // the least ContactPoint::precision in the present system
};

}  // namespace

double overlap_kept(double depth, double size) {
  // Depth that is opened at once, and largest change in a step, over the size of an element.
  constexpr double at_once = 1e-3, most = 0.01;
  constexpr double part = 1.0 / 32;  // change in a step over the depth
  if (!(depth > at_once * size)) return 0;
  return depth - std::min(part * depth, most * size);
}

void displace(RigidState& state, const RigidProperties& properties, const Vec3& shift, const Vec3& turn) {
  state.pose.position += shift;
  if (!turn.isZero(0)) state.pose.orientation = (exponential(turn) * state.pose.orientation).normalized();
  update_orientation_dependents(state, properties);
}

int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch) {
  PushOut push_out(bodies, contacts, graph, settings, scratch);
  int most = 0;
  for (int iteration = 1; iteration <= settings.iterations; ++iteration) {
    stop_if_asked();
    // Removing the whole of every overlap at once would correct too much if normals turn as the bodies move.
    const double fraction =
        settings.gradual ? std::min(1.0, 2.0 * iteration / (settings.iterations + 1.0)) : 1;
    const int sweeps = settings.order == PushOutOrder::together ? push_out.push(all_levels, fraction)
                                                                : push_out.push_levels(fraction);
    if (sweeps == 0) {
      contacts.measured.keep(bodies);
      break;
    }
    most = std::max(most, sweeps);
  }
  return most;
}

}  // namespace duet
