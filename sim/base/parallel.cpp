#include "sim/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <pthread.h>
#include <tbb/global_control.h>
#include <time.h>

namespace duet {
namespace {

using Work = void (*)(void* state, std::size_t chunk);

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

double seconds_of(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The threads that help the one that calls run(). A time step makes hundreds of calls of some ten
// microseconds each, which is what waking a sleeping thread takes: helpers look out for the next call for a
// while before they sleep. Each thread takes the chunks of its own part first, which are the same ones in the
// next loop over the same data: these stay in its cache.
class Team {
 public:
  explicit Team(int helpers)
      : looks_(helpers < hardware_threads() ? looks_before_sleep : 0),  // else in each other's way
        parts_(static_cast<std::size_t>(helpers) + 1) {
    for (std::size_t i = 1; i < parts_.size(); ++i) threads_.emplace_back([this, i] { help(i); });
  }
  ~Team() {
    ends_ = true;
    announce();
    for (std::thread& thread : threads_) thread.join();
  }
  // Processor time (s) of the helpers.
  double processor_seconds() {
    double seconds = 0;
    for (std::thread& thread : threads_) {
      clockid_t clock{};
      if (::pthread_getcpuclockid(thread.native_handle(), &clock) == 0) seconds += seconds_of(clock);
    }
    return seconds;
  }

  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  // Calls work(state, i) for all i in [0, chunks). A call from within a chunk, or beside another thread's,
  // is carried out by its caller alone. Throws what a chunk threw first, when all have been called.
  void run(std::size_t chunks, Work work, void* state) {
    if (busy_.exchange(true, std::memory_order_acquire)) {
      for (std::size_t i = 0; i < chunks; ++i) work(state, i);
      return;
    }
    ++job_;
    for (Part& part : parts_) part.ticket = job_ << 32 | closed;
    work_ = work;
    state_ = state;
    finished_ = 0;
    ++job_;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      parts_[i].end = (i + 1) * chunks / parts_.size();
      parts_[i].ticket = job_ << 32 | i * chunks / parts_.size();
    }
    announce();
    take_chunks(0);
    for (int looks = 0; finished_.load(std::memory_order_acquire) < chunks; ++looks)
      looks < looks_before_sleep ? relax() : std::this_thread::yield();
    const std::exception_ptr failure = std::exchange(failure_, nullptr);
    failed_ = false;
    busy_.store(false, std::memory_order_release);
    if (failure) std::rethrow_exception(failure);
  }

 private:
  static constexpr std::uint64_t closed = 0xffffffff;  // in place of a chunk: the job is not complete yet
  static constexpr int looks_before_sleep = 4000;      // 0.1 ms

  struct alignas(64) Part {
    std::atomic<std::uint64_t> ticket{0};
    std::atomic<std::uint64_t> end{0};
  };

  void announce() {
    jobs_.fetch_add(1, std::memory_order_release);
    jobs_.notify_all();
  }

  void help(std::size_t own) {
    for (std::uint32_t seen = 0; !ends_; seen = jobs_.load(std::memory_order_acquire)) {
      take_chunks(own);
      for (int looks = 0; looks < looks_ && jobs_.load(std::memory_order_relaxed) == seen; ++looks) relax();
      jobs_.wait(seen, std::memory_order_acquire);
    }
  }

  // A ticket names a job and the next chunk of a part. Who changes it has the chunk, and knows that what it
  // has read of the job was of this one: a job is only written while its tickets are closed.
  void take_chunks(std::size_t own) {
    std::size_t taken = 0;  // the job cannot end, nor another one begin, before these are reported
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      Part& part = parts_[(own + k) % parts_.size()];
      for (std::uint64_t ticket = part.ticket; (ticket & closed) < part.end;) {
        const Work work = work_;
        void* const state = state_;
        if (!part.ticket.compare_exchange_weak(ticket, ticket + 1)) continue;
        try {
          work(state, ticket & closed);
        } catch (...) {
          if (!failed_.exchange(true)) failure_ = std::current_exception();
        }
        ++taken;
        ticket = part.ticket;
      }
    }
    if (taken > 0) finished_.fetch_add(taken, std::memory_order_release);
  }

  int looks_;
  std::atomic<bool> ends_{false}, busy_{false}, failed_{false};
  std::exception_ptr failure_;
  std::uint64_t job_ = 0;
  std::vector<Part> parts_;  // one a thread
  // What announces a job lies together: it has to get from one processor to the other.
  alignas(64) std::atomic<Work> work_{nullptr};
  std::atomic<void*> state_{nullptr};
  std::atomic<std::uint32_t> jobs_{0};
  alignas(64) std::atomic<std::size_t> finished_{0};
  std::vector<std::thread> threads_;
};

struct Pool {
  explicit Pool(int count)
      : threads(count),
        limit(std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(count))),
        team(std::make_unique<Team>(count - 1)) {}

  int threads;
  std::unique_ptr<tbb::global_control> limit;  // holds the other user of threads, OpenVDB, to the same number
  std::unique_ptr<Team> team;
};

Pool& pool() {
  static Pool instance(hardware_threads());
  return instance;
}

}  // namespace

void set_thread_count(int count) {
  pool().limit.reset();  // of several limits TBB takes the smallest
  pool() = Pool(count > 0 ? count : hardware_threads());
}

int thread_count() { return pool().threads; }

double loop_processor_seconds() {
  return seconds_of(CLOCK_THREAD_CPUTIME_ID) + pool().team->processor_seconds();
}

void detail::run_chunks(std::size_t chunks, void (*body)(void*, std::size_t), void* state) {
  Pool& p = pool();
  if (p.threads == 1 || chunks == 1)
    for (std::size_t i = 0; i < chunks; ++i) body(state, i);
  else
    p.team->run(chunks, body, state);
}

}  // namespace duet
