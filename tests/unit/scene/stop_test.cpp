// Giving up a frame: soon, and without a trace.
#include "sim/base/stop.h"

#include <chrono>
#include <thread>

#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/scene/plan.h"
#include "sim/scene/reader.h"
#include "sim/scene/simulation.h"

namespace duet {
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

constexpr int most_stops = 3, last_frame = 1;

// Advances by a frame, which is given up again and again, later in it from time to time. Returns how often.
int advance_with_stops(Simulation& simulation, std::atomic<bool>& flag, std::chrono::nanoseconds frame_time) {
  const int frame = simulation.frame();
  const std::uint64_t hash = simulation.stats().hash;
  for (int stops = 0; stops < most_stops; ++stops) {
    std::thread clock([&] {
      std::this_thread::sleep_for(frame_time * (2 * stops + 1) / (2 * most_stops + 2));
      flag = true;
    });
    bool is_stopped = false;
    try {
      simulation.advance_frame();
    } catch (const Stopped&) {
      is_stopped = true;
    }
    clock.join();
    flag = false;
    if (!is_stopped) return stops;  // on a busy machine the frame may be over before
    EXPECT_EQ(simulation.frame(), frame);
    EXPECT_EQ(simulation.stats().hash, hash);
  }
  simulation.advance_frame();
  return most_stops;
}

// Wherever in its step a frame was given up, it comes out the same afterwards, from the very simulation that
// was stopped.
TEST(Stop, LeavesTheStateOfTheLastFrame) {
  int stops = 0;
  for (const auto& [name, override_text] : {std::pair{"hard/ropes", ""},
                                            {"hard/incompressible", ""},
                                            {"maggot", ""},
                                            {"stack", "solver.integration=\"implicit\""},
                                            {"hard/cloth_on_ball", ""}}) {
    const std::string file = fmt::format("{}/scenes/{}.toml", test::source_folder(), name);
    std::vector<std::string> overrides;
    if (*override_text != '\0') overrides.emplace_back(override_text);
    const scene::Scene scene = scene::read(file, overrides).scene;
    const EffectSet effects = scene::plan_effects(scene).active();
    Simulation expected(scene, effects), stopped(scene, effects);
    std::atomic<bool> flag{false};
    stopped.stop_when(&flag);
    for (int frame = 1; frame <= last_frame; ++frame) {
      const auto begin = std::chrono::steady_clock::now();
      expected.advance_frame();
      stops += advance_with_stops(stopped, flag, std::chrono::steady_clock::now() - begin);
      EXPECT_EQ(stopped.stats().hash, expected.stats().hash) << name << ", frame " << frame;
    }
  }
  EXPECT_GT(stops, 3);
}

}  // namespace
}  // namespace duet
