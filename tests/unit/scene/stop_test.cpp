// Tests that a frame can be given up, soon and without a trace.
#include "sim/base/stop.h"

#include <atomic>
#include <csignal>
#include <ctime>
#include <thread>

#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/parallel.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::stop_test {
namespace {

TEST(StopScope, CountsForItsThreadAndItsLifetime) {
  std::atomic<bool> set{true}, unset{false};
  EXPECT_NO_THROW(stop_if_asked());
  {
    const StopScope outer(&set);
    EXPECT_THROW(stop_if_asked(), Stopped);
    {
      const StopScope inner(&unset);
      EXPECT_NO_THROW(stop_if_asked());
    }
    EXPECT_THROW(stop_if_asked(), Stopped);
    std::thread([] { EXPECT_NO_THROW(stop_if_asked()); }).join();
  }
  EXPECT_NO_THROW(stop_if_asked());
}

constexpr int max_stops = 3, last_frame = 1;

std::atomic<bool> asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

// Returns the processor time of this thread in s. Unlike wall time, it does not depend on other programs.
double computed() {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

// Sets `asked` once this thread has computed for `seconds` more.
class Request {
 public:
  explicit Request(double seconds) {
    asked = false;
    struct sigaction action {};
    action.sa_handler = [](int) { asked = true; };
    action.sa_flags = SA_RESTART;
    ::sigaction(SIGUSR1, &action, nullptr);
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGUSR1;
    EXPECT_EQ(::timer_create(CLOCK_THREAD_CPUTIME_ID, &event, &timer_), 0);
    const auto whole = static_cast<time_t>(seconds);
    const itimerspec after{{}, {whole, static_cast<long>(1e9 * (seconds - static_cast<double>(whole))) + 1}};
    EXPECT_EQ(::timer_settime(timer_, 0, &after, nullptr), 0);
  }
  ~Request() { ::timer_delete(timer_); }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

 private:
  timer_t timer_{};
};

// Advances by a frame, which is given up at most `max_stops` times before, each time later in the frame.
// Returns how often it was given up, and checks that the state is then that of the last frame.
int advance_with_stops(Simulation& simulation, double frame_time) {
  const int frame = simulation.frame();
  const std::uint64_t hash = simulation.stats().hash;
  for (int stops = 0; stops < max_stops; ++stops) {
    const Request request(frame_time * (2 * stops + 1) / (2 * max_stops + 2));
    bool is_stopped = false;
    try {
      simulation.advance_frame();
    } catch (const Stopped&) {
      is_stopped = true;
    }
    // The timer of processor time ticks every few milliseconds, so that a short frame may end first.
    if (!is_stopped) return stops;
    EXPECT_EQ(simulation.frame(), frame);
    EXPECT_EQ(simulation.stats().hash, hash);
  }
  asked = false;
  simulation.advance_frame();
  return max_stops;
}

// Wherever in its step a frame was given up, the same simulation computes the same frame afterwards, to the
// last bit. State that a step changes in place and does not restore is found.
TEST(Stop, LeavesTheStateOfTheLastFrame) {
  set_thread_count(1);  // One thread computes all, so that the request measures all of the work.
  int stops = 0;
  for (const auto& [name, override_text] : {std::pair{"hard/ropes", ""},
                                            {"hard/incompressible", ""},
                                            {"maggot", ""},
                                            {"stack", "solver.integration=\"implicit\""},
                                            {"hard/cloth_on_ball", ""}}) {
    const std::string file = fmt::format("{}/scenes/{}.toml", test::source_folder(), name);
    std::vector<std::string> overrides;
    if (*override_text != '\0') overrides.emplace_back(override_text);
    overrides.emplace_back("fps=72");  // frames long enough to be given up, and no longer
    const scene::Scene scene = scene::read(file, overrides).scene;
    const EffectSet effects = scene::plan_effects(scene).active();
    Simulation expected(scene, effects), stopped(scene, effects);
    stopped.stop_when(&asked);
    for (int frame = 1; frame <= last_frame; ++frame) {
      const double begin = computed();
      expected.advance_frame();
      stops += advance_with_stops(stopped, computed() - begin);
      EXPECT_EQ(stopped.stats().hash, expected.stats().hash) << name << ", frame " << frame;
    }
  }
  set_thread_count(0);
  EXPECT_GT(stops, 3);
}

}  // namespace
}  // namespace duet::stop_test
