#include "sim/base/parallel.h"

#include <memory>
#include <thread>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace duet {
namespace {

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

std::unique_ptr<tbb::global_control> limit_to(int threads) {
  return std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                               static_cast<std::size_t>(threads));
}

struct Pool {
  int threads = hardware_threads();
  // Also allows more threads than cores, and holds other users of TBB (OpenVDB) to the same number.
  std::unique_ptr<tbb::global_control> limit = limit_to(threads);
  std::unique_ptr<tbb::task_arena> arena = std::make_unique<tbb::task_arena>(threads);
};

Pool& pool() {
  static Pool instance;
  return instance;
}

}  // namespace

void set_thread_count(int count) {
  Pool& p = pool();
  p.threads = count > 0 ? count : hardware_threads();
  p.arena.reset();
  p.limit.reset();  // of several limits TBB takes the smallest
  p.limit = limit_to(p.threads);
  p.arena = std::make_unique<tbb::task_arena>(p.threads);
}

int thread_count() { return pool().threads; }

void detail::run_chunks(std::size_t chunks, void (*body)(void*, std::size_t), void* state) {
  Pool& p = pool();
  if (p.threads == 1 || chunks == 1) {
    for (std::size_t i = 0; i < chunks; ++i) body(state, i);
    return;
  }
  p.arena->execute([&] {
    tbb::parallel_for(
        std::size_t{0}, chunks, [&](std::size_t i) { body(state, i); }, tbb::simple_partitioner{});
  });
}

}  // namespace duet
