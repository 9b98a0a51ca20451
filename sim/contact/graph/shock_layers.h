// Shock layers: the pairs of a pile level by level, for passes that hold the lower body of each pair fixed.
#pragma once

#include <span>
#include <vector>

#include "sim/base/disjoint_sets.h"
#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Shock layers of the contact graph. If only the upper body of a pair moves, bodies of one level do not
/// affect each other. Their pairs form groups: one for every upper body, or for upper bodies that carry each
/// other on the same level. Groups of one level are independent, and each may take as many sweeps as it
/// needs.
class ShockLayers {
 public:
  /// Takes those of `pairs` (indices into contacts.pairs) that join two rigid bodies and whose lower body is
  /// supported. Within a group, pairs keep their given order. `level` and `supported` have an entry for every
  /// body, as in ContactGraph.
  void build(const ContactSet& contacts, std::span<const int> pairs, const std::vector<int>& level,
             const std::vector<char>& supported);

  /// Calls solve(pair indices) once for every group, level after level from the lowest, and in parallel
  /// within a level.
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
  static constexpr std::size_t grain = 4;  // groups of one task; fewer are not worth another thread

  // A pair with its sort keys.
  struct Member {
    int level, group, position, pair;
  };
  std::vector<int> pairs_;                // pair indices, group after group
  std::vector<std::size_t> group_begin_;  // start of each group in pairs_, and the end
  std::vector<std::size_t> level_begin_;  // start of each level in group_begin_, and the end
  DisjointSets groups_;                   // of bodies of one level that touch each other
  std::vector<Member> members_;           // scratch of build()
};

}  // namespace duet
