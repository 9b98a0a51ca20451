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

// The function that carries out one chunk of a job.
using Work = void (*)(void* state, std::size_t chunk);

// Returns the number of hardware threads, at least 1.
int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

// Returns the processor time (s) that a clock of a thread shows.
double seconds_of(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The helper threads of the one that calls run(). A time step makes hundreds of calls of some ten
// microseconds each. Waking a sleeping thread takes as long, so helpers poll for the next job for a while
// before they sleep. Each thread takes the chunks of its own part first. These are the same ones in the next
// loop over the same data, so the data stays in its cache.
class Team {
 public:
  // Starts the helpers. They do not poll if there are more threads than hardware threads, because they would
  // delay each other. Throws std::system_error if the system refuses a thread; those that run are ended
  // first.
  explicit Team(int helpers)
      : polls_(helpers < hardware_threads() ? polls_before_sleep : 0),
        parts_(static_cast<std::size_t>(helpers) + 1) {
    try {
      for (std::size_t i = 1; i < parts_.size(); ++i) threads_.emplace_back([this, i] { help(i); });
    } catch (...) {
      end();  // the destructor is not called
      throw;
    }
  }
  ~Team() { end(); }
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

  // Calls work(state, i) for all i in [0, chunks). A call from within a chunk, or one while another thread's
  // job runs, is carried out by its caller alone. The first exception of a chunk is thrown after all chunks
  // have been called.
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
    for (int polls = 0; finished_.load(std::memory_order_acquire) < chunks; ++polls)
      polls < polls_before_sleep ? pause_cpu() : std::this_thread::yield();
    const std::exception_ptr failure = std::exchange(failure_, nullptr);
    failed_ = false;
    busy_.store(false, std::memory_order_release);
    if (failure) std::rethrow_exception(failure);
  }

 private:
  // Takes the place of a chunk number while the job is not complete yet.
  static constexpr std::uint64_t closed = 0xffffffff;
  // Number of times that a thread polls before it sleeps: about 0.1 ms, several times the duration of a call.
  // More would keep processors busy between time steps.
  static constexpr int polls_before_sleep = 4000;

  // The chunks of one thread, in a cache line of their own. `ticket` holds the job number in its upper 32
  // bits and the next chunk in its lower ones; `end` is one past the last chunk.
  struct alignas(64) Part {
    std::atomic<std::uint64_t> ticket{0};
    std::atomic<std::uint64_t> end{0};
  };

  // Ends the helpers and waits for them.
  void end() {
    ends_ = true;
    announce();
    for (std::thread& thread : threads_) thread.join();
  }

  // Wakes the helpers.
  void announce() {
    jobs_.fetch_add(1, std::memory_order_release);
    jobs_.notify_all();
  }

  // The main function of a helper thread.
  void help(std::size_t own) {
    for (std::uint32_t seen = 0; !ends_; seen = jobs_.load(std::memory_order_acquire)) {
      take_chunks(own);
      for (int polls = 0; polls < polls_ && jobs_.load(std::memory_order_relaxed) == seen; ++polls)
        pause_cpu();
      jobs_.wait(seen, std::memory_order_acquire);
    }
  }

  // Carries out chunks until none is left, beginning with the part `own`. A thread that changes a ticket owns
  // its chunk. It also knows that the `work_` and `state_` it has read belong to this job, because they are
  // written only while the tickets are closed.
  void take_chunks(std::size_t own) {
    std::size_t taken = 0;  // until these are reported, the job cannot end and no other one can begin
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

  int polls_;  // number of times that helpers poll
  std::atomic<bool> ends_{false}, busy_{false}, failed_{false};
  std::exception_ptr failure_;
  std::uint64_t job_ = 0;    // number of the current job
  std::vector<Part> parts_;  // one per thread
  // The members that announce a job share a cache line, which travels from one processor to the other.
  alignas(64) std::atomic<Work> work_{nullptr};
  std::atomic<void*> state_{nullptr};
  std::atomic<std::uint32_t> jobs_{0};
  alignas(64) std::atomic<std::size_t> finished_{0};
  std::vector<std::thread> threads_;
};

// The number of threads and the threads themselves.
struct Pool {
  explicit Pool(int count)
      : threads(count),
        limit(std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(count))),
        team(std::make_unique<Team>(count - 1)) {}

  int threads;
  std::unique_ptr<tbb::global_control> limit;  // holds OpenVDB, which also uses threads, to the same number
  std::unique_ptr<Team> team;
};

Pool& pool() {
  static Pool instance(hardware_threads());
  return instance;
}

}  // namespace

void set_thread_count(int count) {
  pool().limit.reset();  // TBB applies the smallest of several limits
  pool() = Pool(count > 0 ? count : hardware_threads());
}

void forget_threads() {
  // Their destructors would wait for the threads.
  (void)pool().team.release();
  (void)pool().limit.release();
  pool().threads = 1;
  pool().team = std::make_unique<Team>(0);
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
