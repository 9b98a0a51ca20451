// A tree of axis-aligned boxes over moving things.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

// Every node has up to four children, whose boxes are looked at together.
class BoxTree {
 public:
  // Over the boxes of `items`, indices into `boxes`. Storage is kept, and so is the last order as long as the
  // items are the same: splitting what is almost split already is cheap.
  void build(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<int>& items);
  // Takes the boxes of the same items anew and keeps the tree as it is split: much cheaper than build(), but
  // queries become slower the farther items have moved since.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);
  const std::vector<int>& items() const { return items_; }  // of the last build

  // Calls visit(item) for every item whose box meets `box`, touching included, in no particular order.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::array<int, most_pending> pending;
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

  // Calls visit(item) for every item whose box is nearer to `x` than the square root of `squared` (m^2),
  // which visit may lessen: nearer boxes come first, as far as the tree tells.
  template <class Visit>
  void query_near(const Vec3& x, const double& squared, Visit&& visit) const {
    if (nodes_.empty()) return;
    struct Pending {
      int child;
      double squared;
    };
    std::array<Pending, most_pending> pending;
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
      const Quad away = node.squared_distances(x);
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
  static constexpr int width = 4;
  static constexpr std::size_t most_pending = 3 * 16 + 1;  // nodes that wait: 4^16 items have so many levels
  struct Leaf {
    Eigen::AlignedBox3d box;
    int item = 0;
  };
  struct Node {
    std::array<Quad, 3> lower, upper;  // of the children's boxes; empty where there is no child
    std::array<int, width> child;      // nodes, which come after their parent, or ~item
    Node() {
      lower.fill(Quad{} + std::numeric_limits<double>::infinity());
      upper.fill(Quad{} - std::numeric_limits<double>::infinity());
      child.fill(-1);
    }
    void set(int lane, const Eigen::AlignedBox3d& box);
    Eigen::AlignedBox3d hull() const;
    unsigned meeting(const Eigen::AlignedBox3d& box) const {  // bits of the children whose boxes do
      const auto on = [&](std::size_t axis, double least, double most) -> QuadMask {
        return (lower[axis] <= most) & (upper[axis] >= least);
      };
      const Vec3 &least = box.min(), &most = box.max();
      const QuadMask meets =
          on(0, least.x(), most.x()) & on(1, least.y(), most.y()) & on(2, least.z(), most.z());
      return lanes_of(meets);
    }
    Quad squared_distances(const Vec3& x) const {  // m^2, of the children's boxes; infinite without a child
      Quad squared{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double at = x[static_cast<Eigen::Index>(axis)];
        const Quad below = lower[axis] - at, above = at - upper[axis], beside = below > above ? below : above;
        squared += beside > 0 ? beside * beside : Quad{};
      }
      return squared;
    }
  };
  Eigen::AlignedBox3d split(int begin, int end);
  void halve(int begin, int middle, int end);

  std::vector<Leaf> leaves_;
  std::vector<Node> nodes_;
  std::vector<int> items_;
};

}  // namespace duet
