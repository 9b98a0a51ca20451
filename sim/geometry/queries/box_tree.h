// A tree of axis-aligned boxes over moving objects.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "sim/base/assert.h"
#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

/// A tree of axis-aligned boxes. Every node has up to four children, whose boxes are tested together.
class BoxTree {
 public:
  /// Builds the tree over the boxes of `items`, which are indices into `boxes`. Storage is kept, and so is
  /// the last order of the items if they are the same, because splitting an order that is almost right is
  /// cheap.
  void build(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<int>& items);
  /// Takes the current boxes of the same items and keeps the structure of the tree. This is much cheaper than
  /// build(), but queries become slower the farther the items have moved since then.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);
  /// Returns the items of the last build.
  const std::vector<int>& items() const { return items_; }

  /// Calls visit(item) for every item whose box meets `box`, touching included, in no particular order. `box`
  /// must be bounded.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    DUET_ASSERT(!box.min().array().isInf().any() && !box.max().array().isInf().any());
    if (nodes_.empty()) return;
    std::array<int, max_pending> pending;
    std::size_t size = 0;
    pending[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[static_cast<std::size_t>(pending[--size])];
      for (unsigned lanes = node.meeting(box); lanes != 0; lanes &= lanes - 1) {
        const int child = node.child[static_cast<std::size_t>(__builtin_ctz(lanes))];
        if (child < 0)
          visit(~child);
        else
          pending[size++] = child;
      }
    }
  }

  /// Calls visit(item) for every item whose box is nearer to `x` (m) than the square root of `squared` (m^2).
  /// `visit` may lower the referenced `squared` to narrow the search. Nearer boxes come first, as far as the
  /// tree tells.
  template <class Visit>
  void query_near(const Vec3& x, const double& squared, Visit&& visit) const {
    if (nodes_.empty()) return;
    struct Pending {
      int child;
      double squared;
    };
    std::array<Pending, max_pending> pending;
    std::size_t size = 0;
    pending[size++] = {0, 0};
    while (size > 0) {
      const Pending next = pending[--size];
      if (!(next.squared < squared)) continue;
      if (next.child < 0) {
        visit(~next.child);
        continue;
      }
      const Node& node = nodes_[static_cast<std::size_t>(next.child)];
      const double4 away = node.squared_distances(x);
      const std::size_t first = size;
      for (unsigned lanes = lanes_of(away < squared); lanes != 0; lanes &= lanes - 1) {
        const int lane = __builtin_ctz(lanes);
        std::size_t at = size++;
        for (; at > first && pending[at - 1].squared < away[lane]; --at) pending[at] = pending[at - 1];
        pending[at] = {node.child[static_cast<std::size_t>(lane)], away[lane]};
      }
    }
  }

 private:
  // Number of children of a node.
  static constexpr int width = 4;
  // Bound on the number of nodes that wait in a search: each of at most 16 levels leaves up to 3. A tree of
  // 4^16 items has 16 levels.
  static constexpr std::size_t max_pending = 3 * 16 + 1;
  // An item with its box, in the order of the tree.
  struct Leaf {
    Eigen::AlignedBox3d box;
    int item = 0;
  };
  struct Node {
    // Bounds of the boxes of the children by axis, one lane per child; empty boxes where there is no child.
    std::array<double4, 3> lower, upper;
    // Index of a node, which comes after its parent, or ~item.
    std::array<int, width> child;
    Node() {
      lower.fill(double4{} + std::numeric_limits<double>::infinity());
      upper.fill(double4{} - std::numeric_limits<double>::infinity());
      child.fill(-1);
    }
    // Sets the box of a child.
    void set(int lane, const Eigen::AlignedBox3d& box);
    // Returns the box of all children.
    Eigen::AlignedBox3d hull() const;
    // Returns a bit for each child whose box meets `box`.
    unsigned meeting(const Eigen::AlignedBox3d& box) const {
      const auto on = [&](std::size_t axis, double least, double most) -> mask4 {
        return (lower[axis] <= most) & (upper[axis] >= least);
      };
      const Vec3 &least = box.min(), &most = box.max();
      const mask4 meets =
          on(0, least.x(), most.x()) & on(1, least.y(), most.y()) & on(2, least.z(), most.z());
      return lanes_of(meets);
    }
    // Returns the squared distances (m^2) from `x` to the boxes of the children; infinite where there is no
    // child.
    double4 squared_distances(const Vec3& x) const {
      double4 squared{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double at = x[static_cast<Eigen::Index>(axis)];
        const double4 below = lower[axis] - at, above = at - upper[axis],
                      beside = below > above ? below : above;
        squared += beside > 0 ? beside * beside : double4{};
      }
      return squared;
    }
  };
  // Makes a node, and recursively its children, of the leaves [begin, end) and returns their box.
  Eigen::AlignedBox3d split(int begin, int end);
  // Orders the leaves [begin, end) so that those before `middle` lie below the others, along the axis on
  // which they are spread the farthest.
  void halve(int begin, int middle, int end);

  std::vector<Leaf> leaves_;
  std::vector<Node> nodes_;
  std::vector<int> items_;
};

}  // namespace duet
