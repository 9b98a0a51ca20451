#include "sim/geometry/meshing/bcc_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Levels of the octree: the coarsest cells have 32 finest ones along an edge.
constexpr int levels = 6;
// Bits of a coordinate in a key.
constexpr int bits = 21;
// Bound on the slope of a level set: 1, with a margin for the error that interpolation adds. A larger value
// keeps more cells around the surface.
constexpr double lipschitz = 1.1;
// Distance to the surface, in spacings, beyond which no node is moved onto it: min_cut_place() of a short
// edge times its length, 0.40 sqrt(3)/2, rounded up.
constexpr double reach = 0.35;

// Returns the key of a point whose coordinates are in [0, 2^21).
std::uint64_t key_of(const Vec3i& p) {
  const auto part = [&](int axis) { return static_cast<std::uint64_t>(p[axis]); };
  return (part(2) << (2 * bits)) | (part(1) << bits) | part(0);
}

// Returns the point of a key.
Vec3i point_of(std::uint64_t key) {
  const auto part = [&](int shift) { return static_cast<int>(key >> shift & ((1ULL << bits) - 1)); };
  return {part(0), part(bits), part(2 * bits)};
}

// The cell at `place` among those of its level. Cells of level l have 2^l finest ones along an edge.
struct OctreeCell {
  int level = 0;
  Vec3i place = Vec3i::Zero();
  int edge() const { return 2 << level; }  // edge, corner and center are in half spacings
  Vec3i corner() const { return edge() * place; }
  Vec3i center() const { return corner() + Vec3i::Constant(edge() / 2); }
};

// The octree of the cells that the lattice consists of.
class Octree {
 public:
  Octree(const LevelSet& shape, double spacing, CellSizes sizes)
      : shape_(shape), spacing_(spacing), graded_(sizes == CellSizes::graded) {
    // The octree reaches two finest cells beyond the shape, and the middle of the shape is a common corner of
    // cells of all sizes.
    const Vec3 center = (shape.lower() + shape.upper()) / 2, half = (shape.upper() - shape.lower()) / 2;
    const double coarsest = spacing * (1 << (levels - 1));
    Vec3i count;
    for (int axis = 0; axis < 3; ++axis)
      count[axis] = static_cast<int>(std::ceil((half[axis] + 2 * spacing) / coarsest));
    origin_ = center - coarsest * count.cast<double>();
    for (int k = 0; k < 2 * count.z(); ++k)
      for (int j = 0; j < 2 * count.y(); ++j)
        for (int i = 0; i < 2 * count.x(); ++i) grow({levels - 1, Vec3i(i, j, k)});
    if (graded_) balance();
  }

  const Vec3& origin() const { return origin_; }
  bool is_leaf(const OctreeCell& cell) const {
    return leaves_[as_index(cell.level)].contains(key_of(cell.place));
  }

  // Returns the leaves in an order that does not depend on the hash tables.
  std::vector<OctreeCell> leaves() const {
    std::vector<OctreeCell> sorted;
    for (int level = 0; level < levels; ++level) {
      const auto& keys = leaves_[as_index(level)];
      std::vector<std::uint64_t> ordered(keys.begin(), keys.end());
      std::sort(ordered.begin(), ordered.end());
      for (const std::uint64_t key : ordered) sorted.push_back({level, point_of(key)});
    }
    return sorted;
  }

 private:
  // Returns the distance (m) of the center of a cell from the surface.
  double distance(const OctreeCell& cell) const {
    return shape_.distance(origin_ + spacing_ / 2 * cell.center().cast<double>());
  }

  // Adds the leaves within a cell. A cell is left out if all tets that have its center as a node lie outside;
  // these reach as far as the centers of its neighbors.
  void grow(const OctreeCell& cell) {
    const double edge = spacing_ / 2 * cell.edge(), distance_of_center = distance(cell);
    if (distance_of_center > lipschitz * (edge + spacing_)) return;
    if (cell.level == 0 || (graded_ && may_stay(edge, distance_of_center)))
      leaves_[as_index(cell.level)].insert(key_of(cell.place));
    else
      for (int child = 0; child < 8; ++child) grow(child_of(cell, child));
  }

  // Returns whether a coarse cell may be a leaf. The nodes of tets around it are at most its edge away from
  // its center, and the surface must not reach them.
  bool may_stay(double edge, double distance_of_center) const {
    return distance_of_center < -lipschitz * (edge + reach * spacing_);
  }

  static OctreeCell child_of(const OctreeCell& cell, int child) {
    return {cell.level - 1, 2 * cell.place + Vec3i(child & 1, child >> 1 & 1, child >> 2)};
  }

  // Splits leaves until those that share a face, an edge or a corner differ by one level at most.
  void balance() {
    for (int level = 0; level + 2 < levels; ++level) {
      const std::vector<std::uint64_t> finer(leaves_[as_index(level)].begin(),
                                             leaves_[as_index(level)].end());
      for (const std::uint64_t key : finer)
        for (int d = 0; d < 27; ++d) {
          const Vec3i neighbor = point_of(key) + Vec3i(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
          if (neighbor.minCoeff() >= 0) split_down_to(level + 1, {level, neighbor});
        }
    }
  }

  // Splits the leaf that contains the cell into leaves of `level`, if it is coarser.
  void split_down_to(int level, const OctreeCell& cell) {
    const auto ancestor = [&](int l) {
      const int shift = l - cell.level;
      return OctreeCell{l, Vec3i(cell.place.x() >> shift, cell.place.y() >> shift, cell.place.z() >> shift)};
    };
    int coarse = level + 1;
    while (coarse < levels && !is_leaf(ancestor(coarse))) ++coarse;
    if (coarse == levels) return;
    for (; coarse > level; --coarse) {
      leaves_[as_index(coarse)].erase(key_of(ancestor(coarse).place));
      for (int child = 0; child < 8; ++child)
        leaves_[as_index(coarse - 1)].insert(key_of(child_of(ancestor(coarse), child).place));
    }
  }

  const LevelSet& shape_;
  double spacing_;
  bool graded_;
  Vec3 origin_;
  std::array<std::unordered_set<std::uint64_t>, levels> leaves_;
};

// Fills the octree with tets between the centers of neighboring leaves and their common faces.
class LatticeBuilder {
 public:
  LatticeBuilder(const Octree& octree, double spacing) : octree_(octree), leaves_(octree.leaves()) {
    lattice_.origin = octree.origin();
    lattice_.spacing = spacing;
    number_nodes();
    for (const OctreeCell& leaf : leaves_)
      for (int axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) join(leaf, axis, side);
  }
  BccLattice take() { return std::move(lattice_); }

 private:
  // Numbers the centers and corners of all leaves in the order of their keys.
  void number_nodes() {
    std::vector<std::uint64_t> keys;
    for (const OctreeCell& leaf : leaves_) {
      keys.push_back(key_of(leaf.center()));
      for (int c = 0; c < 8; ++c)
        keys.push_back(key_of(leaf.corner() + leaf.edge() * Vec3i(c & 1, c >> 1 & 1, c >> 2)));
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    numbers_.reserve(keys.size());
    for (const std::uint64_t key : keys) {
      numbers_.emplace(key, static_cast<int>(lattice_.nodes.size()));
      lattice_.nodes.push_back(point_of(key));
    }
  }

  // Adds the tets at one face of a leaf, if the neighbor there is a leaf of its size or of the next coarser
  // level.
  void join(const OctreeCell& leaf, int axis, int side) {
    OctreeCell neighbor = leaf;
    neighbor.place[axis] += side;
    if (neighbor.place.minCoeff() < 0) return;
    if (octree_.is_leaf(neighbor)) {
      if (side > 0) join_equals(leaf, neighbor, axis);  // each pair once
      return;
    }
    const OctreeCell coarse{leaf.level + 1, neighbor.place / 2};
    if (coarse.level < levels && octree_.is_leaf(coarse)) join_to_coarse(leaf, coarse, axis, side);
  }

  // Returns the corners of a face of a leaf, in order around it.
  std::array<Vec3i, 4> face(const OctreeCell& leaf, int axis, int side) const {
    const Vec3i u = leaf.edge() * Vec3i::Unit((axis + 1) % 3), v = leaf.edge() * Vec3i::Unit((axis + 2) % 3);
    Vec3i first = leaf.corner();
    if (side > 0) first[axis] += leaf.edge();
    return {first, first + u, first + u + v, first + v};
  }

  // Adds the tets around the line between the centers of two leaves of one size, one for each edge of their
  // common face. If smaller leaves have a node in the middle of such an edge, that tet is cut in two.
  void join_equals(const OctreeCell& a, const OctreeCell& b, int axis) {
    const std::array<Vec3i, 4> corners = face(a, axis, 1);
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3i &begin = corners[i], &end = corners[(i + 1) % 4];
      const Vec3i middle = (begin + end) / 2;
      if (a.level > 0 && numbers_.contains(key_of(middle))) {
        add(a.center(), b.center(), begin, middle);
        add(a.center(), b.center(), middle, end);
      } else {
        add(a.center(), b.center(), begin, end);
      }
    }
  }

  // Adds the tets at the face of a leaf that is a quarter of that of its neighbor. Both centers are joined to
  // it as pyramids, cut along the diagonal from the middle of the coarse face to its corner.
  void join_to_coarse(const OctreeCell& leaf, const OctreeCell& coarse, int axis, int side) {
    const std::array<Vec3i, 4> corners = face(leaf, axis, side);
    std::size_t outer = 0;
    while (!is_corner(coarse, corners[outer])) ++outer;
    const Vec3i &corner = corners[outer], &middle = corners[(outer + 2) % 4];
    for (const std::size_t i : {outer + 1, outer + 3}) {
      add(leaf.center(), middle, corner, corners[i % 4]);
      add(coarse.center(), middle, corner, corners[i % 4]);
    }
  }

  static bool is_corner(const OctreeCell& cell, const Vec3i& x) {
    const Vec3i offset = x - cell.corner();
    return (offset.array() == 0 || offset.array() == cell.edge()).all();
  }

  // Appends a tet, turned if its volume is negative.
  void add(const Vec3i& a, const Vec3i& b, const Vec3i& c, const Vec3i& d) {
    Tet tet{number(a), number(b), number(c), number(d)};
    if ((b - a).cross(c - a).dot(d - a) < 0) std::swap(tet[2], tet[3]);
    lattice_.tets.push_back(tet);
  }
  int number(const Vec3i& x) const { return numbers_.at(key_of(x)); }

  const Octree& octree_;
  std::vector<OctreeCell> leaves_;
  BccLattice lattice_;
  std::unordered_map<std::uint64_t, int> numbers_;
};

}  // namespace

bool BccLattice::is_long(int a, int b) const {
  return (nodes[as_index(a)] - nodes[as_index(b)]).cwiseAbs().sum() == 2;
}

BccLattice bcc_lattice(const LevelSet& shape, double spacing, CellSizes sizes) {
  DUET_ASSERT(spacing > 0);
  const Octree octree(shape, spacing, sizes);
  return LatticeBuilder(octree, spacing).take();
}

}  // namespace duet
