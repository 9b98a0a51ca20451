#include "sim/scene/build/initial_overlaps.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/base/disjoint_sets.h"
#include "sim/contact/detection/surface_intersections.h"
#include "sim/scene/build/overlap_exit.h"
#include "sim/step/world.h"

namespace duet {
namespace {

// Relative error of depths that are reported and compared. A larger value measures faster and less exactly.
constexpr double fine = 0.01;
// Largest number of rounds, each of which displaces all bodies once.
constexpr int max_rounds = 50;
// Largest number of Gauss-Seidel sweeps over the demands of a round.
constexpr int sweeps = 1000;
// Smallest fraction of an island's sum of squared depths that a round must remove to be accepted.
constexpr double min_gain = 0.01;
// Largest number of times that a round's displacements are solved for again because they bring further pairs
// to overlap.
constexpr int max_repairs = 8;
// Largest number of times that an island's displacement is reduced because it does not gain enough: it is
// halved, and in the end dropped.
constexpr int max_halvings = 3;

// Groups of bodies that move together, because joints, attachments or springs hold them together. A cluster
// has the number of its first body.
class Clusters {
 public:
  explicit Clusters(const Bodies& bodies)
      : rigid_count_(bodies.rigid.size()), root_(rigid_count_ + bodies.deformable.size()) {
    DisjointSets sets(root_.size());
    for (const Joint& joint : bodies.articulation.joints) sets.join(joint.parent, joint.child);
    for (const EmbeddedParticle& bound : bodies.bound)
      if (const int body = deformable_of(bodies, bound.at); body >= 0)
        sets.join(static_cast<int>(bound.body), body);
    for (std::size_t i = 0; i < root_.size(); ++i) root_[i] = sets.first(static_cast<int>(i));
    mass_.assign(root_.size(), 0);
    held_.assign(root_.size(), 0);
    weigh(bodies);
  }

  // Returns the cluster of a body.
  int of(int body) const { return root_[as_index(body)]; }
  // Returns the inverse mass of a cluster, 1/kg; 0 if something holds it.
  double inverse_mass(int cluster) const {
    return held_[as_index(cluster)] != 0 ? 0 : 1 / mass_[as_index(cluster)];
  }

 private:
  // Returns the number of the deformable body that has the particle; -1: none.
  int deformable_of(const Bodies& bodies, std::size_t particle) const {
    const std::size_t body = body_of(bodies, static_cast<int>(particle));
    return body < bodies.deformable.size() ? static_cast<int>(rigid_count_ + body) : -1;
  }

  // Sums the masses of the clusters and finds those that a static or kinematic body, a pin or a spring to
  // such a body holds.
  void weigh(const Bodies& bodies) {
    for (std::size_t i = 0; i < rigid_count_; ++i) {
      mass_[as_index(root_[i])] += bodies.rigid.properties[i].mass;
      if (!bodies.rigid.properties[i].is_dynamic()) held_[as_index(root_[i])] = 1;
    }
    for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
      const auto cluster = as_index(root_[rigid_count_ + d]);
      for_each_particle(bodies.deformable[d], [&](std::size_t p) {
        mass_[cluster] += bodies.particles.mass[p];
        if (bodies.particles.mass[p] > 0 && is_held(bodies.particles, p)) held_[cluster] = 1;
      });
    }
    for (const ZeroLengthSpring& add_soft_binding :
         bodies.forces.zero_length_springs.all()) {  // hold where the anchor is not bound to a dynamic body
      const bool is_bound =
          std::any_of(bodies.bound.begin(), bodies.bound.end(),
                      [&](const EmbeddedParticle& b) { return b.particle == as_index(add_soft_binding.b); });
      const int body = deformable_of(bodies, as_index(add_soft_binding.a));
      if (!is_bound && body >= 0) held_[as_index(root_[as_index(body)])] = 1;
    }
  }

  std::size_t rigid_count_;
  std::vector<int> root_;
  std::vector<double> mass_;  // kg, of the clusters
  std::vector<char> held_;    // of the clusters: 1 if something holds it
};

// Two bodies that overlap.
struct Overlap {
  int a = -1, b = -1;  // numbers of the bodies, a < b
  OverlapProbe::Deepest deepest;
  Vec3 way = Vec3::Zero();  // m, displacement that takes b out of a; zero: none, see shortest_exit()
};

// A constraint on the displacements u of two bodies: n . (u_b - u_a) >= length.
struct Demand {
  int a = -1, b = -1;
  Vec3 normal = Vec3::Zero();
  double length = 0;  // m; negative: the gap that may be closed
};

// Finds the overlaps of a world and the displacements that part them; see separate_overlapping_bodies().
class Finder {
 public:
  Finder(const World& world, std::vector<const Surface*> rigid_surfaces)
      : world_(world),
        bodies_(world.bodies),
        probe_(world.bodies, std::move(rigid_surfaces)),
        clusters_(world.bodies),
        shift_(world.bodies.rigid.size() + world.bodies.deformable.size(), Vec3::Zero()),
        frozen_(shift_.size(), 0) {
    for (int a = 0; a < static_cast<int>(shift_.size()); ++a)
      for (int b = a + 1; b < static_cast<int>(shift_.size()); ++b)
        if (probe_.boxes_meet(a, b, Vec3::Zero()) && touch(a, b)) near_.emplace_back(a, b);
  }

  InitialSeparation part() {
    InitialSeparation parting;
    std::vector<Overlap> overlaps = find(fine);
    const std::vector<Overlap> first = overlaps;
    for (const Overlap& overlap : first) parting.overlaps.push_back(described(overlap));
    for (int round = 0; round < max_rounds && !overlaps.empty(); ++round)
      if (!take_round(overlaps)) break;
    for (std::size_t i = 0; i < first.size(); ++i) {
      InitialOverlap& overlap = parting.overlaps[i];
      overlap.first_moves = shift_[as_index(first[i].a)];
      overlap.second_moves = shift_[as_index(first[i].b)];
      overlap.is_pinned_inside = is_pinned_inside(first[i].a, first[i].b);
      for (const Overlap& left : overlaps)
        if (left.a == first[i].a && left.b == first[i].b) overlap.left = depth(left);
    }
    for (const Overlap& left : overlaps)
      if (is_rigid(left.a) && !is_rigid(left.b)) parting.left.emplace_back(left.a, deformable(left.b));
    std::sort(parting.left.begin(), parting.left.end());
    const auto rigid_count = static_cast<std::ptrdiff_t>(bodies_.rigid.size());
    parting.rigid.assign(shift_.begin(), shift_.begin() + rigid_count);
    parting.deformable.assign(shift_.begin() + rigid_count, shift_.end());
    return parting;
  }

 private:
  bool is_rigid(int body) const { return as_index(body) < bodies_.rigid.size(); }
  bool is_dynamic(int body) const { return bodies_.rigid.properties[as_index(body)].is_dynamic(); }
  int deformable(int body) const { return body - static_cast<int>(bodies_.rigid.size()); }
  const std::string& name(int body) const {
    return is_rigid(body) ? bodies_.rigid.name[as_index(body)]
                          : bodies_.deformable[as_index(deformable(body))].name;
  }
  // Returns the depth (m) to report: without the clearance, but with half the thicknesses of thin bodies.
  double depth(const Overlap& overlap) const {
    const double crossing = overlap.deepest.depth - probe_.clearance(overlap.a, overlap.b);
    return crossing > 0 ? crossing + probe_.thickness_between(overlap.a, overlap.b) : 0;
  }
  InitialOverlap described(const Overlap& overlap) const {
    return {name(overlap.a), name(overlap.b), depth(overlap),
            overlap.deepest.place + shift_[as_index(overlap.a)]};
  }

  // Returns whether forces move some particle of a deformable body.
  bool is_free(int body) const {
    bool free = false;
    for_each_particle(bodies_.deformable[as_index(deformable(body))], [&](std::size_t p) {
      free = free || bodies_.particles.mass[p] == 0 || !is_held(bodies_.particles, p);
    });
    return free;
  }

  // Returns whether body a is rigid, and body b has particles inside of it that pins hold.
  bool is_pinned_inside(int a, int b) const {
    if (!is_rigid(a) || is_rigid(b)) return false;
    const Particles& particles = bodies_.particles;
    const LevelSet& shape = bodies_.rigid.properties[as_index(a)].shape;
    const Pose pose = shape_pose(bodies_.rigid, as_index(a));
    bool is_inside = false;
    for_each_particle(bodies_.deformable[as_index(deformable(b))], [&](std::size_t p) {
      const bool is_pinned = is_held(particles, p) && particles.mass[p] > 0;
      is_inside = is_inside || (is_pinned && shape.distance(pose.to_body(particles.x[p])) < 0);
    });
    return is_inside;
  }

  // Returns whether contact or self-collision keeps the two bodies apart. Requires a < b.
  bool touch(int a, int b) const {
    const CandidateFilter filter = world_.contact_filter();
    if (is_rigid(b))
      return filter.rigid_pairs && (is_dynamic(a) || is_dynamic(b)) && !is_excluded(bodies_, a, b);
    if (is_rigid(a))
      return filter.rigid_deformable && (is_dynamic(a) || is_free(b)) &&
             !is_excluded_deformable(bodies_, a, deformable(b));
    if (!is_free(a) && !is_free(b)) return false;
    const auto is_particle = [&](int body) {
      const DeformableBody& one = bodies_.deformable[as_index(deformable(body))];
      return one.triangle_count + one.segment_count == 0;
    };
    return (world_.has(Effect::self_collision) || world_.has(Effect::self_repulsion)) && !is_particle(a) &&
           !is_particle(b);
  }

  Vec3 relative_shift(int a, int b) const { return shift_[as_index(b)] - shift_[as_index(a)]; }

  // Returns all pairs that overlap at the current displacements.
  std::vector<Overlap> find(double slack) {
    std::vector<Overlap> found;
    const int count = static_cast<int>(shift_.size());
    const auto look = [&](int a, int b) {
      if (!probe_.boxes_meet(a, b, relative_shift(a, b))) return;
      const OverlapProbe::Deepest deepest = probe_.deepest(a, b, relative_shift(a, b), slack);
      if (deepest.depth > 0) found.push_back({a, b, deepest});
    };
    if (!has_moved_) {
      for (const auto& [a, b] : near_) look(a, b);
      return found;
    }
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b)
        if (probe_.boxes_meet(a, b, relative_shift(a, b)) && touch(a, b)) look(a, b);
    return found;
  }

  int cluster(int body) const { return clusters_.of(body); }
  // Returns whether displacements can move the body.
  bool can_move(int body) const {
    return clusters_.inverse_mass(cluster(body)) > 0 && frozen_[as_index(cluster(body))] == 0;
  }
  bool can_part(const Overlap& overlap) const {
    return cluster(overlap.a) != cluster(overlap.b) && (can_move(overlap.a) || can_move(overlap.b));
  }

  // Returns the displacements (m) of the clusters that minimize sum m |u|^2 / 2 subject to the demands, by
  // projected Gauss-Seidel on the multipliers `push`.
  std::vector<Vec3> displacements(const std::vector<Demand>& demands) const {
    std::vector<Vec3> u(shift_.size(), Vec3::Zero());
    std::vector<double> push(demands.size(), 0);
    double longest = 0;
    for (const Demand& demand : demands) longest = std::max(longest, demand.length);
    const auto inverse_mass = [&](int body) {
      return can_move(body) ? clusters_.inverse_mass(cluster(body)) : 0.0;
    };
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      double largest = 0;  // largest change of a relative displacement, as a fraction of the longest demand
      for (std::size_t i = 0; i < demands.size(); ++i) {
        const auto& [first, second, normal, length] = demands[i];
        Vec3 &a = u[as_index(cluster(first))], &b = u[as_index(cluster(second))];
        const double wa = inverse_mass(first), wb = inverse_mass(second);
        const double change = std::max(-push[i], (length - normal.dot(b - a)) / (wa + wb));
        push[i] += change;
        a -= wa * change * normal;
        b += wb * change * normal;
        largest = std::max(largest, std::abs(change) * (wa + wb) / longest);
      }
      if (largest < 1e-9) break;  // of the longest displacement: a tenth of it would only add rounds
    }
    return u;
  }

  // Returns displacements (m) of the clusters that meet the demands of the overlaps. Pairs that these
  // displacements would bring to overlap become demands as well.
  std::vector<Vec3> displacements_of(const std::vector<Overlap>& overlaps) {
    std::vector<Demand> demands;
    for (const Overlap& overlap : overlaps)
      if (const double length = overlap.way.norm(); can_part(overlap) && length > 0)
        demands.push_back({overlap.a, overlap.b, overlap.way / length, length});
    const std::vector<Vec3> start = shift_;
    std::vector<Vec3> u = displacements(demands);
    for (int i = 0; i < max_repairs; ++i) {
      const std::size_t count = demands.size();
      shift_ = shifted(start, u);
      for (const Overlap& met : find(fine)) {
        const auto is_met = [&](const auto& known) { return known.a == met.a && known.b == met.b; };
        if (!can_part(met) || std::any_of(overlaps.begin(), overlaps.end(), is_met)) continue;
        const Vec3 relative = u[as_index(cluster(met.b))] - u[as_index(cluster(met.a))];
        const Vec3& normal = met.deepest.way;
        demands.push_back({met.a, met.b, normal, normal.dot(relative) + beyond_surface * met.deepest.depth});
      }
      if (demands.size() == count) break;
      u = displacements(demands);
    }
    shift_ = start;
    return u;
  }

  // Returns the displacements of the bodies after the clusters have moved by `u` from `start`, m.
  std::vector<Vec3> shifted(const std::vector<Vec3>& start, const std::vector<Vec3>& u) const {
    std::vector<Vec3> shift = start;
    for (std::size_t i = 0; i < shift.size(); ++i) shift[i] += u[as_index(clusters_.of(static_cast<int>(i)))];
    return shift;
  }

  // Returns the island of every cluster: the first cluster of those that overlaps of movable bodies connect.
  std::vector<int> islands(const std::vector<Overlap>& overlaps) const {
    DisjointSets sets(shift_.size());
    for (const Overlap& overlap : overlaps) {
      if (can_move(overlap.a) && can_move(overlap.b)) sets.join(cluster(overlap.a), cluster(overlap.b));
    }
    std::vector<int> island(shift_.size());
    for (int i = 0; i < static_cast<int>(island.size()); ++i) island[as_index(i)] = sets.first(i);
    return island;
  }

  // Returns the sum of squared depths (m^2) of the overlaps of every island's bodies.
  std::vector<double> squares(const std::vector<Overlap>& overlaps, const std::vector<int>& island) const {
    std::vector<double> sum(shift_.size(), 0);
    for (const Overlap& overlap : overlaps) {
      const int a = can_move(overlap.a) ? island[as_index(cluster(overlap.a))] : -1;
      const int b = can_move(overlap.b) ? island[as_index(cluster(overlap.b))] : -1;
      const double square = overlap.deepest.depth * overlap.deepest.depth;
      if (a >= 0) sum[as_index(a)] += square;
      if (b >= 0 && b != a) sum[as_index(b)] += square;
    }
    return sum;
  }

  // Returns for every island whether its displacements `u` (m) are far longer than the exits from its
  // overlaps in sum, as those of a body between the sides of a narrow wedge. They are never said to be so for
  // islands that deformation cannot help: of rigid bodies, or with overlaps of two deformable bodies.
  std::vector<char> overshoot(const std::vector<Overlap>& overlaps, const std::vector<int>& island,
                              const std::vector<Vec3>& u) const {
    std::vector<double> exits(shift_.size(), 0);
    std::vector<char> deforms(shift_.size(), 0), overshoots(shift_.size(), 0);
    const auto island_of = [&](int body) { return as_index(island[as_index(cluster(body))]); };
    for (const Overlap& overlap : overlaps) {
      const std::size_t a = island_of(overlap.a), b = island_of(overlap.b);
      exits[a] += overlap.way.norm();
      if (b != a) exits[b] += overlap.way.norm();
      deforms[a] = deforms[a] || !is_rigid(overlap.b);
      deforms[b] = deforms[b] || !is_rigid(overlap.b);
    }
    for (const Overlap& overlap : overlaps)
      if (!is_rigid(overlap.a)) deforms[island_of(overlap.a)] = deforms[island_of(overlap.b)] = 0;
    for (std::size_t c = 0; c < shift_.size(); ++c) {
      const auto i = as_index(island[c]);
      if (deforms[i] && u[c].norm() > far_exit * exits[i]) overshoots[i] = 1;
    }
    return overshoots;
  }

  // Displaces the bodies once. Islands whose overlaps do not lessen move half as far, then not at all, and
  // are frozen from then on. Returns whether anything moved, and replaces `overlaps` by those at the new
  // positions.
  bool take_round(std::vector<Overlap>& overlaps) {
    bool any = false;
    for (Overlap& overlap : overlaps) {
      if (!can_part(overlap)) continue;
      overlap.way =
          shortest_exit(probe_, overlap.a, overlap.b, relative_shift(overlap.a, overlap.b), overlap.deepest);
      any = any || !overlap.way.isZero(0);
    }
    if (!any) return false;
    has_moved_ = true;
    const std::vector<Vec3> start = shift_, u = displacements_of(overlaps);
    const std::vector<int> island = islands(overlaps);
    const std::vector<double> before = squares(overlaps, island);
    std::vector<double> fraction(shift_.size(), 1);
    const std::vector<char> too_far = overshoot(overlaps, island, u);
    for (std::size_t i = 0; i < shift_.size(); ++i)
      if (too_far[i]) fraction[i] = 0;
    for (int halvings = 0; halvings <= max_halvings; ++halvings) {
      for (std::size_t i = 0; i < shift_.size(); ++i) {
        const auto c = as_index(clusters_.of(static_cast<int>(i)));
        shift_[i] = start[i] + fraction[as_index(island[c])] * u[c];
      }
      overlaps = find(fine);
      const std::vector<double> after = squares(overlaps, island);
      bool all_gain = true;
      for (std::size_t i = 0; i < shift_.size(); ++i) {
        if (fraction[i] == 0 || before[i] == 0 || after[i] <= (1 - min_gain) * before[i]) continue;
        all_gain = false;
        fraction[i] = halvings + 1 < max_halvings ? fraction[i] / 2 : 0;
      }
      if (all_gain) break;
    }
    bool moved = false;
    for (std::size_t c = 0; c < shift_.size(); ++c) {
      const auto i = as_index(island[c]);
      if (before[i] > 0 && fraction[i] == 0) frozen_[c] = 1;
      moved = moved || (fraction[i] > 0 && !u[c].isZero(0));
    }
    return moved;
  }

  const World& world_;
  const Bodies& bodies_;
  OverlapProbe probe_;
  Clusters clusters_;
  std::vector<std::pair<int, int>> near_;  // pairs that contact parts and whose boxes meet at the start
  std::vector<Vec3> shift_;                // m, current displacement of every body
  std::vector<char> frozen_;               // of every cluster: 1 if moving it does not help
  bool has_moved_ = false;
};

}  // namespace

bool InitialSeparation::moves() const {
  const auto moves = [](const Vec3& u) { return !u.isZero(0); };
  return std::any_of(rigid.begin(), rigid.end(), moves) ||
         std::any_of(deformable.begin(), deformable.end(), moves);
}

InitialSeparation separate_overlapping_bodies(const World& world,
                                              std::vector<const Surface*> rigid_surfaces) {
  return Finder(world, std::move(rigid_surfaces)).part();
}

void apply(const InitialSeparation& parting, World& world) {
  Bodies& bodies = world.bodies;
  for (std::size_t i = 0; i < parting.rigid.size(); ++i)
    bodies.rigid.state[i].pose.position += parting.rigid[i];
  for (std::size_t d = 0; d < parting.deformable.size(); ++d)
    for_each_particle(bodies.deformable[d],
                      [&](std::size_t p) { bodies.particles.x[p] += parting.deformable[d]; });
  follow_bodies(bodies.rigid, bodies.bound, bodies.particles);
}

std::string describe(const InitialOverlap& overlap) {
  const std::string pair = fmt::format("`{}` and `{}`", overlap.first, overlap.second);
  const std::string place =
      fmt::format("at ({:.4g}, {:.4g}, {:.4g})", overlap.place.x(), overlap.place.y(), overlap.place.z());
  if (overlap.depth == 0) return fmt::format("{} touch {}", pair, place);
  return fmt::format("{} overlap by {:.3g} m {}", pair, overlap.depth, place);
}

std::string describe_separation(const InitialOverlap& overlap) {
  std::string text = describe(overlap);
  const auto moved = [](const std::string& name, const Vec3& by) {
    return fmt::format("`{}` by ({:.4g}, {:.4g}, {:.4g}) m", name, by.x(), by.y(), by.z());
  };
  const bool first = !overlap.first_moves.isZero(0), second = !overlap.second_moves.isZero(0);
  if (first || second) {
    text += "; the first step begins with moving ";
    if (first) text += moved(overlap.first, overlap.first_moves);
    if (first && second) text += " and ";
    if (second) text += moved(overlap.second, overlap.second_moves);
  }
  if (overlap.left > 0)
    text += fmt::format("; moving whole bodies leaves {:.3g} m of it, which contact opens step by step",
                        overlap.left);
  if (overlap.left > 0 && overlap.is_pinned_inside)
    text += fmt::format(
        "; pins inside of `{}` hold `{}` there, so that the overlap stays beside them: pin it half of its "
        "thickness away from the surface",
        overlap.first, overlap.second);
  return text;
}

}  // namespace duet
