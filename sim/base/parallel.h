// The one parallel layer. Work is cut into chunks whose bounds depend on the problem's size alone, never on
// the number of threads, so every result is bit-identical for any thread count. Nothing here allocates once
// it is warmed up.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>

namespace duet {

// Threads used by all loops; count <= 0 takes all cores. Not to be called while a loop runs.
void set_thread_count(int count);
int thread_count();

// Processor time (s) that the calling thread and the threads that help in its loops have spent so far.
double loop_processor_seconds();

// For loops that wait for another thread: tells the processor so.
inline void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

namespace detail {
void run_chunks(std::size_t chunks, void (*body)(void*, std::size_t), void* state);
}

// Calls body(begin, end) for consecutive ranges of at most `grain` items of [0, n), in parallel.
template <class Body>
void parallel_for(std::size_t n, std::size_t grain, Body&& body) {
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

// Sum (or any associative `join`) of map(begin, end) over fixed chunks, joined in order: deterministic.
template <class Value, class Map, class Join>
Value parallel_reduce(std::size_t n, std::size_t least_grain, Value zero, Map&& map, Join&& join) {
  constexpr std::size_t most_chunks = 64;
  const std::size_t grain = std::max(least_grain, (n + most_chunks - 1) / most_chunks);
  std::array<Value, most_chunks> partial;
  const std::size_t chunks = (n + grain - 1) / grain;
  parallel_for(n, grain,
               [&](std::size_t begin, std::size_t end) { partial[begin / grain] = map(begin, end); });
  Value total = zero;
  for (std::size_t i = 0; i < chunks; ++i) total = join(total, partial[i]);
  return total;
}

}  // namespace duet
