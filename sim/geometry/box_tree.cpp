#include "sim/geometry/box_tree.h"

#include <algorithm>

namespace duet {
namespace {

constexpr int leaf_size = 4;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void BoxTree::build(const std::vector<Eigen::AlignedBox3d>& boxes, const std::vector<int>& items) {
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
  for (Leaf& leaf : leaves_) leaf.box = boxes[as_index(leaf.item)];
  for (std::size_t i = nodes_.size(); i-- > 0;) {  // children follow their parents
    Node& node = nodes_[i];
    node.box = node.begin != node.end ? box_of_leaves(node.begin, node.end)
                                      : nodes_[i + 1].box.merged(nodes_[as_index(node.second)].box);
  }
}

Eigen::AlignedBox3d BoxTree::box_of_leaves(int begin, int end) const {
  Eigen::AlignedBox3d box;
  for (int i = begin; i < end; ++i) box.extend(leaves_[as_index(i)].box);
  return box;
}

void BoxTree::split(int begin, int end) {
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  if (end - begin <= leaf_size) {
    nodes_[node].box = box_of_leaves(begin, end);
    nodes_[node].begin = begin;
    nodes_[node].end = end;
    return;
  }
  Eigen::AlignedBox3d centers;
  for (int i = begin; i < end; ++i) centers.extend(leaves_[as_index(i)].box.center());
  int axis = 0;
  centers.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(leaves_.begin() + begin, leaves_.begin() + middle, leaves_.begin() + end,
                   [axis](const Leaf& a, const Leaf& b) {
                     const double at_a = a.box.min()[axis] + a.box.max()[axis],
                                  at_b = b.box.min()[axis] + b.box.max()[axis];
                     return at_a != at_b ? at_a < at_b : a.item < b.item;
                   });
  split(begin, middle);
  const int second = static_cast<int>(nodes_.size());
  split(middle, end);
  nodes_[node].second = second;
  nodes_[node].box = nodes_[node + 1].box.merged(nodes_[as_index(second)].box);
}

}  // namespace duet
