// Parallel loops. Work is cut into chunks whose bounds depend on the size of the problem alone, never on the
// number of threads, so every result is bit-identical for any thread count. Nothing here allocates once it
// has warmed up.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "sim/base/assert.h"

namespace duet {

/// Sets the number of threads that all loops use, OpenVDB's included. `count` <= 0 takes one per hardware
/// thread. Must not be called while a loop runs.
void set_thread_count(int count);
/// Returns the number of threads that all loops use.
int thread_count();

/// Continues with one thread in a process that fork() has just made: the threads of the other process are not
/// in it. set_thread_count() starts new ones. What belonged to those that are gone is never released.
void forget_threads();

/// Returns the processor time (s) that the calling thread and the helper threads of its loops have used so
/// far.
double loop_processor_seconds();

/// Tells the processor that the calling loop waits for another thread. Does nothing on processors other than
/// x86-64.
inline void pause_cpu() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Implementation of the loops below.
namespace detail {
/// Calls body(state, i) for all i in [0, chunks) on the threads of the pool, and waits for all of them. An
/// exception of a chunk is thrown after all chunks have been called.
void run_chunks(std::size_t chunks, void (*body)(void*, std::size_t), void* state);
}  // namespace detail

/// Calls body(begin, end) in parallel for consecutive ranges of `grain` items of [0, n). The last range may
/// be shorter; `grain` is positive. If calls throw, one of the exceptions is thrown when all calls have
/// ended. A loop that is started from within a chunk runs on its own thread alone.
template <class Body>
void parallel_for(std::size_t n, std::size_t grain, Body&& body) {
  DUET_ASSERT(grain > 0);
  if (n == 0) return;
  struct State {
    std::remove_reference_t<Body>* body;
    std::size_t n, grain;
  } state{&body, n, grain};
  const auto chunk = [](void* data, std::size_t index) {
    const State& s = *static_cast<State*>(data);
    const std::size_t begin = index * s.grain;
    (*s.body)(begin, std::min(begin + s.grain, s.n));
  };
  detail::run_chunks((n + grain - 1) / grain, chunk, &state);
}

/// Returns `zero` joined with map(begin, end) of all ranges of [0, n), in their order. There are at most 64
/// ranges, of at least `min_grain` > 0 items; they depend on n alone, so the result is the same for any
/// thread count. `join` must be associative up to rounding, and `zero` is its neutral element.
template <class Value, class Map, class Join>
Value parallel_reduce(std::size_t n, std::size_t min_grain, Value zero, Map&& map, Join&& join) {
  // Bound on the number of ranges, whose results are kept on the stack.
  constexpr std::size_t max_chunks = 64;
  DUET_ASSERT(min_grain > 0);
  const std::size_t grain = std::max(min_grain, (n + max_chunks - 1) / max_chunks);
  std::array<Value, max_chunks> partial;
  const std::size_t chunks = (n + grain - 1) / grain;
  parallel_for(n, grain,
               [&](std::size_t begin, std::size_t end) { partial[begin / grain] = map(begin, end); });
  Value total = zero;
  for (std::size_t i = 0; i < chunks; ++i) total = join(total, partial[i]);
  return total;
}

/// Returns the sum of all that add(i, sum) adds to `sum` for i in [0, n). Ranges, threads and order are those
/// of parallel_reduce().
template <class Add>
double parallel_sum(std::size_t n, std::size_t min_grain, Add&& add) {
  return parallel_reduce(
      n, min_grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) add(i, sum);
        return sum;
      },
      [](double a, double b) { return a + b; });
}

/// The lists that the ranges of a parallel_collect() have found. It keeps its storage from call to call.
template <class Item>
using CollectScratch = std::vector<std::vector<Item>>;

/// Sets `all` to what find(i, found) appends to `found` for i in [0, n), in the order of i. The calls run in
/// parallel, `grain` > 0 of them in each range. Lists get room for more items than they hold, so that storage
/// stops growing once a scene has warmed up.
template <class Item, class Find>
void parallel_collect(std::size_t n, std::size_t grain, CollectScratch<Item>& scratch, std::vector<Item>& all,
                      Find&& find) {
  DUET_ASSERT(grain > 0);
  const std::size_t ranges = (n + grain - 1) / grain;
  if (scratch.size() < ranges) scratch.resize(ranges);
  const auto make_room = [](std::vector<Item>& items, std::size_t count) {
    if (items.capacity() < count) items.reserve(2 * count);
  };
  parallel_for(n, grain, [&](std::size_t begin, std::size_t end) {
    std::vector<Item>& found = scratch[begin / grain];
    found.clear();
    make_room(found, grain);
    for (std::size_t i = begin; i < end; ++i) find(i, found);
    make_room(found, found.size() + grain);
  });
  std::size_t total = 0;
  for (std::size_t range = 0; range < ranges; ++range) total += scratch[range].size();
  all.clear();
  make_room(all, total);
  for (std::size_t range = 0; range < ranges; ++range)
    all.insert(all.end(), scratch[range].begin(), scratch[range].end());
}

}  // namespace duet
