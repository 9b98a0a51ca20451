// A tree of axis-aligned boxes over moving things.
#pragma once

#include <array>
#include <vector>

#include "sim/base/types.h"

namespace duet {

class BoxTree {
 public:
  // Over the boxes of `items`, indices into `boxes`. Storage is kept, and so is the last order as long as the
  // items are the same: splitting what is almost split already is cheap.
  void build(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<int>& items);
  // Takes the boxes of the same items anew and keeps the tree as it is split: much cheaper than build(), but
  // queries become slower the farther items have moved since.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);

  // Calls visit(item) for every item whose box meets `box`, touching included, in no particular order.
  template <class Visit>
  void query(const Eigen::AlignedBox3d& box, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::array<int, most_levels> pending;
    std::size_t size = 0;
    pending[size++] = 0;
    while (size > 0) {
      const int index = pending[--size];
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      if (!node.box.intersects(box)) continue;
      for (int i = node.begin; i < node.end; ++i)
        if (leaves_[static_cast<std::size_t>(i)].box.intersects(box))
          visit(leaves_[static_cast<std::size_t>(i)].item);
      if (node.begin != node.end) continue;
      pending[size++] = node.second;
      pending[size++] = index + 1;
    }
  }

 private:
  static constexpr std::size_t most_levels = 64;  // splits halve the number of items
  struct Leaf {
    Eigen::AlignedBox3d box;
    int item = 0;
  };
  struct Node {
    Eigen::AlignedBox3d box;
    int begin = 0, end = 0;  // leaves: range of leaves_
    int second = 0;          // inner nodes (begin == end): the second child; the first one follows its parent
  };
  void split(int begin, int end);
  Eigen::AlignedBox3d box_of_leaves(int begin, int end) const;

  std::vector<Leaf> leaves_;
  std::vector<Node> nodes_;
  std::vector<int> items_;  // of the last build
};

}  // namespace duet
