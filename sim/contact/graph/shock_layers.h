// The pairs of a pile level by level, for what holds lower bodies as if they were fixed.
#pragma once

#include <span>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

// Where only the upper body of a pair gives way, bodies of one level do not know of each other: their pairs
// fall into groups, one for every body, or for those that carry each other on the same level. Groups of one
// level are independent, and may each take as many sweeps as they need.
class ShockLayers {
 public:
  // Of `pairs` (indices of contacts.pairs), those of rigid bodies whose lower one is supported; a group has
  // them in the order in which they are given. `level` and `supported` are of every body.
  void build(const ContactSet& contacts, std::span<const int> pairs, const std::vector<int>& level,
             const std::vector<char>& supported);

  // Calls solve(pair indices) for every group of one level after the other, lowest first.
  template <class Solve>
  void for_each(Solve&& solve) const {
    for (std::size_t l = 0; l + 1 < level_begin_.size(); ++l) {
      const std::size_t first = level_begin_[l];
      parallel_for(level_begin_[l + 1] - first, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = first + begin; g < first + end; ++g)
          solve(std::span(pairs_).subspan(group_begin_[g], group_begin_[g + 1] - group_begin_[g]));
      });
    }
  }

 private:
  static constexpr std::size_t grain = 4;  // groups; fewer are not worth another thread

  struct Member {
    int level, group, position, pair;
  };
  std::vector<int> pairs_;                // group after group
  std::vector<std::size_t> group_begin_;  // into pairs_, one more than there are groups
  std::vector<std::size_t> level_begin_;  // into the groups, one more than there are levels
  std::vector<int> group_;                // of every body: the first body known of its group
  std::vector<Member> members_;           // scratch
};

}  // namespace duet
