// The order in which Gauss-Seidel sweeps visit pairs of bodies, cut into waves that can run in parallel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/coupling/contact_point.h"

namespace duet {

// Pairs of one wave share no movable body, so they can be processed at the same time; wave after wave gives
// the same bits as one pair after the other.
class PairSchedule {
 public:
  // Orders `pairs` (indices of contacts.pairs) by level, lowest first, and within a level by a coloring of
  // their bodies that keeps the chains of dependent pairs short. Waves hold pairs of several levels unless
  // `levels_apart`.
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs, bool levels_apart);

  std::span<const int> order() const { return order_; }
  int waves() const { return static_cast<int>(wave_begin_.size()) - 1; }
  // The waves of one level, if levels are apart: [first_wave(level), first_wave(level + 1)).
  int levels() const { return static_cast<int>(level_begin_.size()) - 1; }
  int first_wave(int level) const { return level_begin_[static_cast<std::size_t>(level)]; }

  // Calls visit(pair index) for all pairs in order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (int w = 0; w < waves(); ++w) {
      const std::span<const int> pairs = wave(w);
      parallel_for(pairs.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) visit(pairs[i]);
      });
    }
  }
  // The largest visit(pair index) in the waves [first, last), at least 0.
  template <class Visit>
  double largest(int first, int last, Visit&& visit) const {
    const auto larger = [](double a, double b) { return std::max(a, b); };
    double most = 0;
    for (int w = first; w < last; ++w) {
      const std::span<const int> pairs = wave(w);
      most = parallel_reduce(
          pairs.size(), grain, most,
          [&](std::size_t begin, std::size_t end) {
            double here = 0;
            for (std::size_t i = begin; i < end; ++i) here = larger(here, visit(pairs[i]));
            return here;
          },
          larger);
    }
    return most;
  }

 private:
  void sort_by_level_and_color(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs);

  static constexpr std::size_t grain = 16;  // pairs; fewer are not worth another thread

  std::span<const int> wave(int w) const {
    const auto begin = static_cast<std::size_t>(wave_begin_[static_cast<std::size_t>(w)]);
    return std::span(order_).subspan(
        begin, static_cast<std::size_t>(wave_begin_[static_cast<std::size_t>(w) + 1]) - begin);
  }

  std::vector<int> order_;                 // pair indices, wave after wave
  std::vector<int> wave_begin_ = {0};      // into order_, one more than there are waves
  std::vector<int> level_begin_ = {0};     // into the waves, one more than there are levels
  std::vector<std::uint64_t> used_;        // colors taken, of every body
  std::vector<int> last_;                  // last wave of every body
  std::vector<int> key_, sorted_, begin_;  // scratch of the sorts
};

// Index of a pair's guest among all bodies: rigid ones first, then deformable ones.
inline std::size_t guest_node(const Bodies& bodies, const ContactPair& pair) {
  return pair.guest_rigid >= 0 ? static_cast<std::size_t>(pair.guest_rigid)
                               : bodies.rigid.size() + static_cast<std::size_t>(pair.guest_deformable);
}

}  // namespace duet
