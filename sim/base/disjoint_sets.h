// Disjoint sets of numbers, for islands, connected parts and groups of linked bodies.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "sim/base/index.h"

namespace duet {

/// A partition of the numbers 0, 1, ... size - 1 into disjoint sets. A set is known by its smallest member,
/// so that nothing depends on the order of joins.
class DisjointSets {
 public:
  /// Makes a partition without members.
  DisjointSets() = default;
  /// Makes a partition in which each of `size` numbers is alone.
  explicit DisjointSets(std::size_t size) { reset(size); }

  /// Puts each of `size` numbers into a set of its own. Allocates only if there were never as many before.
  void reset(std::size_t size) {
    parent_.resize(size);
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  /// Returns the number of members of all sets.
  std::size_t size() const { return parent_.size(); }

  /// Returns the smallest member of the set of `i`, and halves the path by which it is found (Tarjan and van
  /// Leeuwen 1984).
  int first(int i) {
    while (parent_[as_index(i)] != i) {
      int& next = parent_[as_index(i)];
      next = parent_[as_index(next)];
      i = next;
    }
    return i;
  }
  /// Returns the smallest member of the set of `i`.
  int first(int i) const {
    while (parent_[as_index(i)] != i) i = parent_[as_index(i)];
    return i;
  }

  /// Unites the sets of `a` and `b`. Returns whether they were two.
  bool join(int a, int b) {
    a = first(a);
    b = first(b);
    if (a != b) parent_[as_index(std::max(a, b))] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<int> parent_;  // of every number: a smaller one of its set, itself if there is none
};

}  // namespace duet
