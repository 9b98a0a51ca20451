#include "sim/geometry/meshing/tet_smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/geometry/mesh/elements_around.h"
#include "sim/geometry/mesh/tet_quality.h"
#include "sim/geometry/meshing/tetrahedralizer.h"

namespace duet {
namespace {

// Bound on the number of sweeps over the nodes of flat tets.
constexpr int max_sweeps = 12;
// The step lengths of a search begin at the first value and are halved down to the second, in spacings.
constexpr double first_move = 0.12, last_move = 0.015;
// Distance from the surface, in spacings, beyond which a node of the boundary counts as off it and does not
// move.
constexpr double off_surface = 1e-3;
// Factor by which a move must raise the least altitude around the node to be kept.
constexpr double min_gain = 1.001;
// Lower bound of min_facing() after a move: 60 degrees. If a triangle is tilted more than that before the
// move, no triangle may be tilted more afterward.
constexpr double wanted_facing = 0.5;

// Returns the 26 unit directions to the neighbors in a cubic lattice.
const std::vector<Vec3>& directions() {
  static const std::vector<Vec3> all = [] {
    std::vector<Vec3> list;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x != 0 || y != 0 || z != 0) list.push_back(Vec3(x, y, z).normalized());
    return list;
  }();
  return all;
}

// Raises the altitudes of one mesh by sweeps over the nodes of its flat tets.
class Smoother {
 public:
  Smoother(TetMesh& mesh, const LevelSet& shape, double spacing)
      : mesh_(mesh),
        shape_(shape),
        spacing_(spacing),
        goal_(wanted_altitude * spacing),
        triangles_(boundary(mesh)) {
    tets_around_ = elements_around(mesh.nodes.size(), mesh.tets);
    triangles_around_ = elements_around(mesh.nodes.size(), triangles_);
    find_fixed();
    moved_in_.assign(mesh.nodes.size(), -max_sweeps);
  }

  void run() {
    for (sweep_ = 0; sweep_ < max_sweeps; ++sweep_) {
      choose_nodes();
      if (chosen_.empty()) return;
      color();
      bool moved = false;
      for (const std::vector<int>& nodes : colors_) moved = move_all(nodes) || moved;
      if (!moved) return;
    }
  }

 private:
  // How a node may move: freely, on the surface, or not at all.
  enum class Place : char { inside, surface, fixed };

  // Finds out how each node may move.
  void find_fixed() {
    place_.assign(mesh_.nodes.size(), Place::inside);
    for (const Triangle& triangle : triangles_)
      for (const int i : triangle)
        place_[as_index(i)] = is_on_surface(mesh_.nodes[as_index(i)]) ? Place::surface : Place::fixed;
  }

  std::span<const int> tets_around(int node) const { return tets_around_.of(node); }

  bool is_on_surface(const Vec3& x) const { return std::abs(shape_.distance(x)) <= off_surface * spacing_; }

  // Chooses the nodes of flat tets around which a node has moved since they were tried.
  void choose_nodes() {
    std::vector<char> is_flat(mesh_.tets.size());
    parallel_for(mesh_.tets.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t)
        is_flat[t] = static_cast<char>(min_altitude(mesh_, mesh_.tets[t]) < goal_);
    });
    chosen_.clear();
    for (int i = 0; i < static_cast<int>(mesh_.nodes.size()); ++i) {
      const std::span<const int> tets = tets_around(i);
      if (place_[as_index(i)] != Place::fixed && has_news(i) &&
          std::any_of(tets.begin(), tets.end(), [&](int t) { return is_flat[as_index(t)] != 0; }))
        chosen_.push_back(i);
    }
  }

  // Returns whether a node of the tets around `node` has moved in the last sweep.
  bool has_news(int node) const {
    if (sweep_ == 0) return true;
    const std::span<const int> tets = tets_around(node);
    return std::any_of(tets.begin(), tets.end(), [&](int t) {
      const Tet& tet = mesh_.tets[as_index(t)];
      return std::any_of(tet.begin(), tet.end(), [&](int i) { return moved_in_[as_index(i)] + 1 >= sweep_; });
    });
  }

  // Divides the chosen nodes into colors so that no two nodes of a color share a tet. Nodes of one color move
  // at the same time.
  void color() {
    colors_.clear();
    std::vector<int> color_of(mesh_.nodes.size(), -1), last_user;
    for (const int node : chosen_) {
      for (const int t : tets_around(node))
        for (const int other : mesh_.tets[as_index(t)])
          if (const int used = color_of[as_index(other)]; used >= 0) last_user[as_index(used)] = node;
      std::size_t free = 0;
      while (free < colors_.size() && last_user[free] == node) ++free;
      if (free == colors_.size()) {
        colors_.emplace_back();
        last_user.push_back(-1);
      }
      colors_[free].push_back(node);
      color_of[as_index(node)] = static_cast<int>(free);
    }
  }

  // Moves all nodes of a color and returns whether any has moved.
  bool move_all(const std::vector<int>& nodes) {
    return parallel_reduce(
        nodes.size(), 16, false,
        [&](std::size_t begin, std::size_t end) {
          bool moved = false;
          for (std::size_t i = begin; i < end; ++i) moved = move(nodes[i]) || moved;
          return moved;
        },
        [](bool a, bool b) { return a || b; });
  }

  // Returns the least altitude around a node, or some value that is not above `floor` as soon as one is
  // found. `flattest` is the tet that was the flattest the last time; it is tested first and updated.
  double min_altitude_around(int node, double floor, int& flattest) const {
    double least = min_altitude(mesh_, mesh_.tets[as_index(flattest)]);
    for (const int t : tets_around(node)) {
      if (least <= floor) return least;
      if (const double altitude = min_altitude(mesh_, mesh_.tets[as_index(t)]); altitude < least) {
        least = altitude;
        flattest = t;
      }
    }
    return least;
  }

  // Returns whether all tets around a node keep the bounds of the dihedral angles.
  bool keeps_angles(int node) const {
    const std::span<const int> tets = tets_around(node);
    return std::all_of(tets.begin(), tets.end(), [&](int t) {
      return has_dihedral_angles_within(mesh_, mesh_.tets[as_index(t)], min_dihedral_angle,
                                        max_dihedral_angle);
    });
  }

  // Returns the cosine of the largest angle between the normal of the surface and that of a triangle around
  // the node. If all triangles face outward, they cannot fold over each other.
  double min_facing(int node) const {
    double least = 1;
    for (const int t : triangles_around_.of(node)) {
      const Triangle& triangle = triangles_[as_index(t)];
      const Vec3 &a = mesh_.nodes[as_index(triangle[0])], &b = mesh_.nodes[as_index(triangle[1])],
                 &c = mesh_.nodes[as_index(triangle[2])];
      least = std::min(least, (b - a).cross(c - a).normalized().dot(shape_.normal((a + b + c) / 3)));
    }
    return least;
  }

  // Moves `x` onto the surface by Newton steps. Returns false if it is still off the surface afterward.
  bool put_on_surface(Vec3& x) const {
    constexpr int max_steps = 4;
    // Distance in spacings at which the search ends.
    constexpr double exact = 1e-13;
    double distance = shape_.distance(x);
    for (int i = 0; i < max_steps && std::abs(distance) > exact * spacing_; ++i) {
      x -= distance * shape_.normal(x);
      distance = shape_.distance(x);
    }
    return std::abs(distance) <= off_surface * spacing_;
  }

  // Searches for a better place of a node by steps in all directions, which become smaller. Returns whether
  // the node has moved.
  bool move(int node) {
    Vec3& x = mesh_.nodes[as_index(node)];
    const Vec3 start = x;
    int flattest = tets_around(node).front();
    double best = min_altitude_around(node, -std::numeric_limits<double>::infinity(), flattest);
    if (best >= goal_) return false;
    const double facing = std::min(wanted_facing, min_facing(node));
    Vec3 kept = start;
    for (double step = first_move * spacing_; step > last_move * spacing_; step /= 2) {
      const Vec3 from = kept;
      for (const Vec3& direction : directions()) {
        x = from + step * direction;
        if (place_[as_index(node)] == Place::surface && !put_on_surface(x)) continue;
        const double least = min_altitude_around(node, min_gain * best, flattest);
        if (least <= min_gain * best || !keeps_angles(node) || min_facing(node) < facing) continue;
        best = least;
        kept = x;
      }
    }
    x = kept;
    if (kept == start) return false;
    moved_in_[as_index(node)] = sweep_;
    return true;
  }

  TetMesh& mesh_;
  const LevelSet& shape_;
  double spacing_, goal_;
  std::vector<Place> place_;         // how each node may move
  std::vector<Triangle> triangles_;  // the boundary
  ElementLists tets_around_, triangles_around_;
  int sweep_ = 0;
  std::vector<int> moved_in_;  // the sweep that last moved each node
  std::vector<int> chosen_;
  std::vector<std::vector<int>> colors_;
};

}  // namespace

void raise_altitudes(TetMesh& mesh, const LevelSet& shape, double spacing) {
  DUET_ASSERT(spacing > 0);
  Smoother(mesh, shape, spacing).run();
}

}  // namespace duet
