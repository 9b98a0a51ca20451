#include "sim/geometry/meshing/lattice_cuts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/geometry/mesh/elements_around.h"

namespace duet {
namespace {

// Nodes or cuts per chunk of a parallel loop.
constexpr std::size_t grain = 512;

// Returns whether one side is inside and the other outside.
bool differ(Side a, Side b) { return a != b && a != Side::surface && b != Side::surface; }

// Returns where the level set vanishes between a point inside and one outside, as a fraction of the way from
// the former. `at_inside` and `at_outside` are its values there (m). It uses regula falsi in the Illinois
// form, which keeps the bracket and converges faster than bisection.
double find_cut(const LevelSet& shape, const Vec3& inside, const Vec3& outside, double at_inside,
                double at_outside) {
  constexpr int max_steps = 60;
  constexpr double tolerance = 1e-13;  // relative: some hundred roundings of 1
  double low = 0, high = 1, below = at_inside, above = at_outside;
  if (above == 0) return 1;
  int last = 0;
  double place = 0;
  for (int step = 0; step < max_steps && high - low > tolerance; ++step) {
    place = low + (high - low) * below / (below - above);
    const double value = shape.distance(inside + place * (outside - inside));
    if (std::abs(value) <= tolerance * (at_outside - at_inside)) break;
    if (value < 0) {
      low = place;
      below = value;
      if (last == -1) above /= 2;
      last = -1;
    } else {
      high = place;
      above = value;
      if (last == 1) below /= 2;
      last = 1;
    }
  }
  return place;
}

// The boundary of the inside around a node, as arcs on the triangles opposite to it in the tets around it. If
// the node is on the surface, the boundary is a manifold there if and only if the arcs form one closed curve
// or there are none.
class Link {
 public:
  explicit Link(const std::vector<Side>& sides) : sides_(sides) {}

  void clear() { arcs_.clear(); }

  // Adds the arc on a triangle opposite to the node, if it has one.
  void add(const std::array<int, 3>& triangle) {
    std::array<int, 3> in{}, on{}, out{};
    std::size_t ins = 0, ons = 0, outs = 0;
    for (const int node : triangle) {
      const Side side = sides_[as_index(node)];
      if (side == Side::inside) in[ins++] = node;
      if (side == Side::surface) on[ons++] = node;
      if (side == Side::outside) out[outs++] = node;
    }
    if (ins == 1 && outs == 2) add_arc({in[0], out[0]}, {in[0], out[1]});
    if (ins == 2 && outs == 1) add_arc({in[0], out[0]}, {in[1], out[0]});
    if (ins == 1 && outs == 1) add_arc({in[0], out[0]}, {on[0], on[0]});
    if (ins == 1 && ons == 2) add_arc({on[0], on[0]}, {on[1], on[1]});
  }

  // Returns whether the boundary is a manifold at the node.
  bool is_manifold() {
    drop_doubled();
    if (arcs_.empty()) return true;
    return every_point_joins_two() && is_one_curve();
  }

 private:
  using Point = std::array<int, 2>;  // inner and outer node of a cut edge, or a node on the surface twice
  using Arc = std::array<Point, 2>;

  void add_arc(const Point& a, const Point& b) { arcs_.push_back(a < b ? Arc{a, b} : Arc{b, a}); }

  // Drops arcs between two nodes on the surface that have the inside on both of their sides: they are no
  // boundary.
  void drop_doubled() {
    std::sort(arcs_.begin(), arcs_.end());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < arcs_.size(); ++i)
      if (i + 1 < arcs_.size() && arcs_[i] == arcs_[i + 1])
        ++i;
      else
        arcs_[kept++] = arcs_[i];
    arcs_.resize(kept);
  }

  // Returns whether every point is the end of exactly two arcs.
  bool every_point_joins_two() {
    points_.clear();
    for (const Arc& arc : arcs_) points_.insert(points_.end(), arc.begin(), arc.end());
    std::sort(points_.begin(), points_.end());
    for (std::size_t i = 0; i < points_.size(); i += 2)
      if (points_[i] != points_[i + 1] || (i + 2 < points_.size() && points_[i + 2] == points_[i]))
        return false;
    return true;
  }

  // Returns whether the arcs form a single closed curve, given that every point joins two of them.
  bool is_one_curve() const {
    std::size_t length = 1, arc = 0;
    for (Point end = arcs_[0][1]; end != arcs_[0][0]; ++length) {
      const auto goes_on = [&](std::size_t i) {
        return i != arc && (arcs_[i][0] == end || arcs_[i][1] == end);
      };
      std::size_t next = 0;
      while (!goes_on(next)) ++next;
      end = arcs_[next][0] == end ? arcs_[next][1] : arcs_[next][0];
      arc = next;
    }
    return length == arcs_.size();
  }

  const std::vector<Side>& sides_;
  std::vector<Arc> arcs_;
  std::vector<Point> points_;
};

// Cuts a lattice by a level set, in the order of cut().
class Cutter {
 public:
  Cutter(BccLattice&& lattice, const LevelSet& shape) : shape_(shape), link_(result_.sides) {
    result_.lattice = std::move(lattice);
  }

  CutLattice cut() {
    find_sides();
    drop_outside();
    find_cuts();
    move_nodes();
    drop_spent_cuts();
    return std::move(result_);
  }

 private:
  // Computes positions, distances and sides of all nodes.
  void find_sides() {
    const std::size_t nodes = result_.lattice.nodes.size();
    result_.positions.resize(nodes);
    result_.sides.resize(nodes);
    distances_.resize(nodes);
    parallel_for(nodes, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        result_.positions[i] = result_.lattice.position(static_cast<int>(i));
        distances_[i] = shape_.distance(result_.positions[i]);
        result_.sides[i] = distances_[i] < 0 ? Side::inside : Side::outside;
      }
    });
  }

  // Drops tets without a node inside.
  void drop_outside() {
    std::erase_if(result_.lattice.tets, [&](const Tet& tet) {
      return std::none_of(tet.begin(), tet.end(), [&](int i) { return side(i) == Side::inside; });
    });
  }

  // Finds the cuts of all edges between inside and outside.
  void find_cuts() {
    std::vector<Cut>& cuts = result_.cuts;
    for (const Tet& tet : result_.lattice.tets)
      for (const int a : tet)
        for (const int b : tet)
          if (side(a) == Side::inside && side(b) == Side::outside) cuts.push_back({a, b});
    std::sort(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) {
      return std::pair(a.inside, a.outside) < std::pair(b.inside, b.outside);
    });
    const auto same = [](const Cut& a, const Cut& b) {
      return a.inside == b.inside && a.outside == b.outside;
    };
    cuts.erase(std::unique(cuts.begin(), cuts.end(), same), cuts.end());
    parallel_for(cuts.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        Cut& cut = cuts[c];
        const std::size_t a = as_index(cut.inside), b = as_index(cut.outside);
        cut.place =
            find_cut(shape_, result_.positions[a], result_.positions[b], distances_[a], distances_[b]);
      }
    });
  }

  // Moves every node with close cuts onto the nearest of them, one node after the other.
  void move_nodes() {
    const std::size_t nodes = result_.positions.size();
    const ElementLists tets_around = elements_around(nodes, result_.lattice.tets);
    const ElementLists cuts_around = elements_around(nodes, result_.cuts, [](const Cut& cut) {
      return std::array{cut.inside, cut.outside};
    });
    for (int node = 0; node < static_cast<int>(nodes); ++node)
      if (const std::optional<Vec3> target = nearest_cut(node, cuts_around.of(node)))
        if (put_on_surface(node, tets_around)) result_.positions[as_index(node)] = *target;
  }

  // Puts a node on the surface. If the boundary would not be a manifold there or at one of its neighbors, it
  // leaves the node on its side and returns false.
  bool put_on_surface(int node, const ElementLists& tets_around) {
    Side& own = result_.sides[as_index(node)];
    const Side before = std::exchange(own, Side::surface);
    for (const int t : tets_around.of(node))
      for (const int i : result_.lattice.tets[as_index(t)])
        if (side(i) == Side::surface && !is_manifold_at(i, tets_around.of(i))) {
          own = before;
          return false;
        }
    return true;
  }

  // Returns the nearest of the cuts that are too close to the node, if there are any.
  std::optional<Vec3> nearest_cut(int node, std::span<const int> around) const {
    std::optional<Vec3> nearest;
    double least = result_.lattice.spacing;
    for (const int c : around) {
      const Cut& cut = result_.cuts[as_index(c)];
      if (!differ(side(cut.inside), side(cut.outside))) continue;  // one end has moved already
      const Vec3 &a = result_.positions[as_index(cut.inside)], &b = result_.positions[as_index(cut.outside)];
      const double part = cut.inside == node ? cut.place : 1 - cut.place, length = (b - a).norm();
      if (part < min_place(cut) && part * length < least) {
        least = part * length;
        nearest = a + cut.place * (b - a);
      }
    }
    return nearest;
  }

  double min_place(const Cut& cut) const {
    return min_cut_place(result_.lattice.is_long(cut.inside, cut.outside));
  }

  // Returns whether the boundary is a manifold at a node on the surface.
  bool is_manifold_at(int node, std::span<const int> tets) {
    link_.clear();
    for (const int t : tets) {
      std::array<int, 3> opposite{};
      std::size_t count = 0;
      for (const int i : result_.lattice.tets[as_index(t)])
        if (i != node) opposite[count++] = i;
      link_.add(opposite);
    }
    return link_.is_manifold();
  }

  // Drops the cuts at nodes that have moved. Close cuts to which a node could not move are shifted away from
  // it instead.
  void drop_spent_cuts() {
    std::erase_if(result_.cuts, [&](const Cut& cut) { return !differ(side(cut.inside), side(cut.outside)); });
    for (Cut& cut : result_.cuts) cut.place = std::clamp(cut.place, min_place(cut), 1 - min_place(cut));
  }

  Side side(int node) const { return result_.sides[as_index(node)]; }

  const LevelSet& shape_;
  CutLattice result_;
  Link link_;
  std::vector<double> distances_;  // m, of the nodes before they move
};

}  // namespace

std::size_t CutLattice::cut_of(int inside, int outside) const {
  const auto found = std::lower_bound(cuts.begin(), cuts.end(), std::pair(inside, outside),
                                      [](const Cut& cut, const std::pair<int, int>& edge) {
                                        return std::pair(cut.inside, cut.outside) < edge;
                                      });
  DUET_ASSERT(found != cuts.end() && found->inside == inside && found->outside == outside);
  return static_cast<std::size_t>(found - cuts.begin());
}

CutLattice cut_lattice(BccLattice lattice, const LevelSet& shape) {
  return Cutter(std::move(lattice), shape).cut();
}

}  // namespace duet
