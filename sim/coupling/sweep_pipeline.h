// Gauss-Seidel sweeps over pairs of bodies that follow each other without waiting for the last to end.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/coupling/contact_point.h"

namespace duet {

// A sweep up the levels of a pile has many short waves (PairSchedule), too few pairs at a time for several
// threads. But as soon as both bodies of a pair are done with one sweep, the pair may be visited in the next:
// so the waves of several sweeps are laid over each other, and become fewer and larger. Every body still sees
// its pairs in the order of one sweep after the other, and the results have the same bits.
class SweepPipeline {
 public:
  // For sweeps that visit the pairs in this `order` (indices of contacts.pairs).
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order);

  // Sweeps until no visit(pair index) of a sweep returned `tolerance` or more, but at most `most` times.
  // Looks at what the visits of a sweep returned after 1, 3, 7, 15 ... sweeps, and where there are so few
  // pairs that nothing is gained by overlap, after every one. Returns the number of sweeps.
  template <class Visit>
  int repeat(int most, double tolerance, Visit&& visit) const {
    const bool overlaps = pairs_ >= least_pairs;
    int done = 0;
    for (int count = 1; done < most; count = overlaps ? std::min(2 * count, deepest / 2) : 1) {
      if (overlaps && most - done < 2 * count) count = most - done;  // no short rest
      done += count;
      if (largest_of_last(count, visit) < tolerance) break;
    }
    return done;
  }

  int waves(int sweeps) const { return waves_[static_cast<std::size_t>(sweeps) - 1]; }
  static constexpr int deepest = 16;  // sweeps laid over each other

 private:
  static constexpr std::size_t least_pairs = 64;
  static constexpr std::size_t least_share = 4;  // pairs; fewer are not worth another thread

  struct Turn {  // a visit of a pair
    int pair = 0, sweep = 0;
  };

  // Sweeps `count` times and returns the largest visit of the last sweep, at least 0.
  template <class Visit>
  double largest_of_last(int count, Visit&& visit) const {
    const auto larger = [](double a, double b) { return std::max(a, b); };
    double most = 0;
    for (int w = 0; w < waves(count); ++w) {
      const std::span<const Turn> turns = wave(w, count);
      most = parallel_reduce(
          turns.size(), share_of(turns.size()), most,
          [&](std::size_t begin, std::size_t end) {
            double here = 0;
            for (std::size_t i = begin; i < end; ++i) {
              const double value = visit(turns[i].pair);
              if (turns[i].sweep == count - 1) here = larger(here, value);
            }
            return here;
          },
          larger);
    }
    return most;
  }

  // Even shares, an even number of them: waves are short, so that a small rest would be waited for.
  static std::size_t share_of(std::size_t turns) {
    const std::size_t shares = std::max(std::size_t{1}, turns / (2 * least_share) * 2);
    return (turns + shares - 1) / shares;
  }

  // The turns of the first `sweeps` sweeps in a wave, which come first in it.
  std::span<const Turn> wave(int w, int sweeps) const {
    const auto begin = turns_.begin() + begin_[static_cast<std::size_t>(w)],
               end = turns_.begin() + begin_[static_cast<std::size_t>(w) + 1];
    return {begin, std::partition_point(begin, end, [&](const Turn& turn) { return turn.sweep < sweeps; })};
  }

  std::size_t pairs_ = 0;
  std::vector<Turn> turns_;           // wave after wave
  std::vector<int> begin_;            // of every wave in turns_, one more than there are waves
  std::array<int, deepest> waves_{};  // of one sweep, two, ...
  std::vector<int> last_;             // last wave of every body
  std::vector<int> wave_of_;          // of every turn, sweep after sweep
};

}  // namespace duet
