// Gauss-Seidel sweeps over pairs of bodies, by several threads, each of which has its own pairs.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

// The bodies of a pile are divided among the threads by where they are, and the pairs with them, so that
// their data stay with one processor. Every thread visits its own pairs in the given order, sweep after
// sweep, and does not wait for the others but where it has to: a pair may be visited as soon as both bodies
// are done with the pairs that precede it. So every body sees its pairs in the order of one sweep after the
// other, and the results have the same bits for any number of threads. A thread that would wait for long
// takes a visit from another one.
class GaussSeidelPipeline {
 public:
  // For sweeps that visit the pairs in this `order` (indices of contacts.pairs).
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order);

  // Sweeps until no visit(pair index) of a sweep returned `tolerance` or more, but at most `most` times.
  // Looks at what the visits of a sweep returned after 1, 3, 7, 15, 23 ... sweeps, as threads would have to
  // wait for each other at the end of every one, and where there are few pairs after every one; then it calls
  // look(). Returns the number of sweeps.
  template <class Visit, class Look>
  int repeat(int most, double tolerance, Visit&& visit, Look&& look) const {
    constexpr int most_at_once = 8;
    const bool overlaps = steps_.size() >= least_pairs;
    int done = 0;
    for (int count = 1; done < most; count = overlaps ? std::min(2 * count, most_at_once) : 1) {
      if (overlaps && most - done < 2 * count) count = most - done;  // no short rest
      done += count;
      if (sweep(count, visit) < tolerance) break;
      look();
    }
    return done;
  }
  template <class Visit>
  int repeat(int most, double tolerance, Visit&& visit) const {
    return repeat(most, tolerance, visit, [] {});
  }

  // Calls visit(pair index) once for all pairs.
  template <class Visit>
  void once(Visit&& visit) const {
    sweep(1, [&](int p) {
      visit(p);
      return 0.0;
    });
  }

 private:
  static constexpr std::size_t least_pairs = 64;  // for more than one thread
  static constexpr int patience = 4;              // looks at the next pair before another thread's is taken
  static constexpr int most_parts = 64;

  struct Step {  // the visit of a pair in each sweep
    int pair = 0;
    // Of both bodies: whose progress to look at, or -1 of a body that cannot move; how many visits of a sweep
    // precede this one there, and how many there are.
    std::array<int, 2> body{-1, -1}, before{0, 0}, visits{0, 0};
  };
  struct alignas(64) Part {  // a thread's steps
    int begin = 0, end = 0;
    std::uint64_t next = 0;  // sweep and step to be visited next; atomic while threads sweep
    double largest = 0;      // visit of the last sweep
  };

  // Sweeps `count` times and returns the largest visit of the last sweep, at least 0.
  template <class Visit>
  double sweep(int count, Visit&& visit) const {
    const auto larger = [](double a, double b) { return std::max(a, b); };
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

  // Visits the steps of one part, and such of others as their thread is late with, until none is left.
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
        relax();
      } else {
        if (all_taken(count)) break;
        part = (part + 1) % parts_.size();
      }
    }
    parts_[own].largest = largest;
  }

  // The next step of a part if it can be visited now, and no other thread has taken it.
  const Step* take(Part& part, int count, int& sweep) const;
  void finish(const Step& step, int sweep) const;
  bool all_taken(int count) const;
  void begin_sweeps() const;
  void divide(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order);

  std::vector<Step> steps_;          // part after part, each in the given order
  mutable std::vector<Part> parts_;  // one a thread, or one for all
  mutable std::vector<int>
      progress_;  // visits of every body, in the order of parts; atomic while threads sweep
  std::vector<int> place_, degree_;  // of every body: where its progress is; pairs
  std::vector<int> part_of_;         // scratch of the division: of every body
  std::vector<double> weight_;       // of every slice, and those before it
};

}  // namespace duet
