// Gauss-Seidel sweeps over pairs of bodies by several threads, with the same bits for any number of them.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Parallel Gauss-Seidel sweeps. Bodies and their pairs are divided among the threads by position, so that
/// the data of a pair stay with one processor. Every thread visits its pairs in the given order, sweep after
/// sweep. It waits only where it must: a pair may be visited as soon as both of its bodies are done with the
/// pairs that precede it. Every body therefore sees its pairs in the order of consecutive sweeps, and the
/// results have the same bits for any number of threads. A thread that would wait for long takes a visit from
/// another thread.
class GaussSeidelPipeline {
 public:
  /// Prepares sweeps that visit the pairs in this `order` (indices into contacts.pairs).
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order);

  /// Sweeps until every visit of a sweep returned less than `tolerance`, at most `most` times. `visit` takes
  /// a pair index and returns the size of its change, in the unit of `tolerance`. The values are compared
  /// after 1, 3, 7, 15, 23 ... sweeps, because threads have to wait for each other at each comparison; where
  /// there are few pairs they are compared after every sweep. `look` is called after each comparison that
  /// does not end the loop. Returns the number of sweeps.
  template <class Visit, class Look>
  int repeat(int most, double tolerance, Visit&& visit, Look&& look) const {
    DUET_ASSERT(most >= 0 && tolerance >= 0);
    constexpr int max_at_once = 8;
    const bool overlaps = steps_.size() >= min_pairs;
    int done = 0;
    for (int count = 1; done < most; count = overlaps ? std::min(2 * count, max_at_once) : 1) {
      if (overlaps && most - done < 2 * count) count = most - done;  // leaves no short remainder
      done += count;
      if (sweep(count, visit) < tolerance) break;
      look();
    }
    return done;
  }
  /// Sweeps like the other overload, without `look`.
  template <class Visit>
  int repeat(int most, double tolerance, Visit&& visit) const {
    return repeat(most, tolerance, visit, [] {});
  }

  /// Calls visit(pair index) once for every pair, in an order that is equivalent to the given one.
  template <class Visit>
  void once(Visit&& visit) const {
    sweep(1, [&](int p) {
      visit(p);
      return 0.0;
    });
  }

 private:
  // Fewer pairs than this are swept by one thread, without synchronization.
  static constexpr std::size_t min_pairs = 64;
  // How often a thread looks at its next pair before it tries to take a visit from another thread.
  static constexpr int patience = 4;
  static constexpr int max_parts = 64;  // largest number of threads that share the pairs

  // The visit of one pair, which every sweep repeats.
  struct Step {
    int pair = 0;
    // For host and guest: place of its counter in progress_ (-1: it cannot move), how many visits of the same
    // sweep precede this one at that body, and how many visits a sweep makes there.
    std::array<int, 2> body{-1, -1}, before{0, 0}, visits{0, 0};
  };
  // The steps of one thread, alone on their cache line.
  struct alignas(64) Part {
    int begin = 0, end = 0;  // range in steps_
    std::uint64_t next = 0;  // sweep (upper half) and step (lower half) to visit next; atomic during sweeps
    double largest = 0;      // largest value that a visit of the last sweep returned
  };

  // Sweeps `count` times. Returns the largest value that a visit of the last sweep returned, at least 0.
  template <class Visit>
  double sweep(int count, Visit&& visit) const {
    const auto larger = [](double a, double b) { return std::max(a, b); };
    DUET_ASSERT(!parts_.empty());  // build() makes one at least
    if (parts_.size() == 1) {
      double largest = 0;
      for (int i = 0; i < count; ++i) {
        largest = 0;
        for (const Step& step : steps_) largest = larger(largest, visit(step.pair));
      }
      return largest;
    }
    begin_sweeps();
    parallel_for(parts_.size(), 1, [&](std::size_t begin, std::size_t) { visit_part(begin, count, visit); });
    double largest = 0;
    for (const Part& part : parts_) largest = larger(largest, part.largest);
    return largest;
  }

  // Visits the steps of the part `own`, and steps of other parts whose threads are late, until none is left.
  template <class Visit>
  void visit_part(std::size_t own, int count, Visit&& visit) const {
    double largest = 0;
    std::size_t part = own;
    for (int looks = 0;; ++looks) {
      int sweep = 0;
      if (const Step* step = take(parts_[part], count, sweep)) {
        const double value = visit(step->pair);
        if (sweep == count - 1) largest = std::max(largest, value);
        finish(*step, sweep);
        part = own;
        looks = 0;
      } else if (looks < patience) {
        pause_cpu();
      } else {
        if (all_taken(count)) break;
        part = (part + 1) % parts_.size();
      }
    }
    parts_[own].largest = largest;
  }

  // Takes the next step of a part, and sets `sweep` to the sweep that it belongs to. Returns null if its
  // bodies are not ready, another thread was faster, or all `count` sweeps are taken.
  const Step* take(Part& part, int count, int& sweep) const;
  // Tells the threads that wait for the bodies of `step` that its visit is done.
  void finish(const Step& step, int sweep) const;
  // Returns whether all steps of all `count` sweeps have been taken.
  bool all_taken(int count) const;
  void begin_sweeps() const;
  // Assigns every body to a part.
  void divide(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order);

  std::vector<Step> steps_;          // part after part, each in the given order
  mutable std::vector<Part> parts_;  // one for each thread, or a single one
  // Number of visits that each body has had, ordered by part; atomic during sweeps.
  mutable std::vector<int> progress_;
  std::vector<int> place_,      // for each body: index of its counter in progress_
      degree_;                  // for each body: number of its pairs
  std::vector<int> part_of_;    // for each body: its part
  std::vector<double> weight_;  // scratch: for each slice, number of contact points up to and including it
};

}  // namespace duet
