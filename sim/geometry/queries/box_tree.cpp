#include "sim/geometry/queries/box_tree.h"

#include <algorithm>

namespace duet {
void BoxTree::build(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<int>& items) {
  // Storage is reserved for as many items as there may ever be, because lists of items grow when bodies come
  // near each other.
  items_.reserve(boxes.size());
  leaves_.reserve(boxes.size());
  nodes_.reserve(boxes.size() / (width - 1) + max_pending);  // one node per level may not be full
  if (items != items_) {
    items_ = items;
    leaves_.resize(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) leaves_[i].item = items[i];
  }
  for (Leaf& leaf : leaves_) leaf.box = boxes[as_index(leaf.item)];
  nodes_.clear();
  if (!leaves_.empty()) split(0, static_cast<int>(leaves_.size()));
}

void BoxTree::refit(const std::vector<Eigen::AlignedBox3d>& boxes) {
  for (std::size_t i = nodes_.size(); i-- > 0;) {  // children come after their parents
    Node& node = nodes_[i];
    for (int lane = 0; lane < width; ++lane) {
      const int child = node.child[as_index(lane)];
      if (child >= 0)
        node.set(lane, nodes_[as_index(child)].hull());
      else if (node.lower[0][lane] <= node.upper[0][lane])
        node.set(lane, boxes[as_index(~child)]);
    }
  }
}

void BoxTree::Node::set(int lane, const Eigen::AlignedBox3d& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lower[axis][lane] = box.min()[static_cast<Eigen::Index>(axis)];
    upper[axis][lane] = box.max()[static_cast<Eigen::Index>(axis)];
  }
}

Eigen::AlignedBox3d BoxTree::Node::hull() const {
  Eigen::AlignedBox3d hull;
  for (int lane = 0; lane < width; ++lane)
    hull.extend(Eigen::AlignedBox3d(Vec3(lower[0][lane], lower[1][lane], lower[2][lane]),
                                    Vec3(upper[0][lane], upper[1][lane], upper[2][lane])));
  return hull;
}

void BoxTree::halve(int begin, int middle, int end) {
  Eigen::AlignedBox3d centers;
  for (int i = begin; i < end; ++i) centers.extend(leaves_[as_index(i)].box.center());
  int axis = 0;
  centers.sizes().maxCoeff(&axis);
  std::nth_element(leaves_.begin() + begin, leaves_.begin() + middle, leaves_.begin() + end,
                   [axis](const Leaf& a, const Leaf& b) {
                     const double at_a = a.box.min()[axis] + a.box.max()[axis],
                                  at_b = b.box.min()[axis] + b.box.max()[axis];
                     return at_a != at_b ? at_a < at_b : a.item < b.item;
                   });
}

// At most one node on each level has fewer than `width` children.
Eigen::AlignedBox3d BoxTree::split(int begin, int end) {
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  if (end - begin <= width) {
    // The order that std::nth_element leaves within its halves is not specified; sorting fixes it.
    std::sort(leaves_.begin() + begin, leaves_.begin() + end,
              [](const Leaf& a, const Leaf& b) { return a.item < b.item; });
    for (int i = begin; i < end; ++i) {
      nodes_[node].set(i - begin, leaves_[as_index(i)].box);
      nodes_[node].child[as_index(i - begin)] = ~leaves_[as_index(i)].item;
    }
    return nodes_[node].hull();
  }
  int part = width;  // number of leaves of a child: a power of the width
  while (width * part < end - begin) part *= width;
  const int parts = (end - begin + part - 1) / part;
  const auto bound = [&](int i) { return std::min(begin + i * part, end); };
  halve(begin, bound((parts + 1) / 2), end);
  if (parts > 2) halve(begin, bound(1), bound(2));
  if (parts > 3) halve(bound(2), bound(3), end);
  for (int i = 0; i < parts; ++i) {
    nodes_[node].child[as_index(i)] = static_cast<int>(nodes_.size());
    const Eigen::AlignedBox3d box = split(bound(i), bound(i + 1));
    nodes_[node].set(i, box);
  }
  return nodes_[node].hull();
}

}  // namespace duet
