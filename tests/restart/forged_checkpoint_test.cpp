// Tests of checkpoints whose checksum is right and whose numbers are wrong: they are refused, or simulated
// without harm.
#include <atomic>
#include <chrono>
#include <cstring>
#include <limits>
#include <random>
#include <thread>

#include "tests/restart/program.h"
#include "tests/support/full.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/io/checkpoint.h"
#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::test::forged_checkpoint_test {
namespace {

using Bytes = std::vector<unsigned char>;

const std::string forged_scene = source_folder() + "/tests/restart/forged.toml";

// Returns the state with one number of four or eight bytes replaced, one bit flipped, or fewer contacts. Half
// of the forgeries are among the last bytes, which hold the contacts.
Bytes forged(Bytes state, std::mt19937_64& random) {
  constexpr std::int32_t integers[] = {-1, -2, 0, 1, 7, 1000, 1 << 30, 2147483647, -2147483647 - 1};
  constexpr double numbers[] = {1e300,
                                -1e300,
                                1e-300,
                                1e30,
                                1e9,
                                -1,
                                0,
                                std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()};
  const std::size_t contacts = std::min(state.size(), 20 * sizeof(CachedContact));
  const std::size_t begin = random() % 2 == 0 ? 0 : state.size() - contacts;
  const auto place = [&](std::size_t size) {
    return begin + random() % ((state.size() - begin) / size) * size;
  };
  switch (random() % 4) {
    case 0:
      std::memcpy(state.data() + place(4), &integers[random() % std::size(integers)], 4);
      break;
    case 1:
      std::memcpy(state.data() + place(8), &numbers[random() % std::size(numbers)], 8);
      break;
    case 2:
      state[place(1)] ^= static_cast<unsigned char>(1U << (random() % 8));
      break;
    default:
      state.resize(state.size() - (random() % 3 + 1) * (random() % 2 == 0 ? sizeof(CachedContact) : 8));
  }
  return state;
}

// Advances by a frame for at most 0.1 s. Forged velocities may ask for more steps than anybody waits for.
void advance_for_a_moment(Simulation& simulation) {
  std::atomic<bool> stop = false;
  simulation.stop_when(&stop);
  std::thread timer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop = true;
  });
  try {
    simulation.advance_frame();
  } catch (const Error& error) {
    EXPECT_NE(error.status(), ExitStatus::files);
  }
  timer.join();
  simulation.stop_when(nullptr);
}

TEST(ForgedCheckpoints, NeverEndTheSimulatorByASignal) {
  const scene::Scene scene = scene::read(forged_scene).scene;
  Simulation simulation(scene, plan(scene));
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  ASSERT_FALSE(simulation.world().last_step.contact_cache.empty());
  const Bytes whole = simulation.save_state();
  std::mt19937_64 random(47);
  int refused = 0;
  const int forgeries = runs_in_full() ? 200 : 60;
  for (int i = 0; i < forgeries; ++i) {
    try {
      simulation.load_state(whole);
      simulation.load_state(forged(whole, random));
      advance_for_a_moment(simulation);
    } catch (const Error& error) {
      // The state was accepted, and could not be simulated.
      if (error.status() != ExitStatus::files) continue;
      EXPECT_EQ(simulation.save_state(), whole) << "a refused state changes nothing";
      ++refused;
    }
  }
  EXPECT_GT(refused, forgeries / 4);
}

// The program knows the hash of the state of every frame from the statistics, so that it refuses every forged
// checkpoint.
TEST(ForgedCheckpoints, AreRefusedByResume) {
  ScratchFolder scratch;
  const io::RunDirectory run{scratch / "run"};
  const std::vector<std::string> words = {"sim", forged_scene, "--out", run.root.string(), "--quiet"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return run_duet(more);
  };
  ASSERT_EQ(with({"--frames", "12"}).status, 0);
  const std::string file = io::read_file(io::checkpoint_path(run, 12));
  std::uint64_t identity = 0;
  std::memcpy(&identity, file.data() + 24, sizeof identity);
  const Bytes whole = io::find_checkpoint(run, identity).found.value().state;
  std::mt19937_64 random(48);
  for (int i = 0; i < 12; ++i) {
    Bytes state = forged(whole, random);
    if (state == whole) continue;
    io::write_checkpoint(run, identity, {12, state});
    const Finished finished = with({"--resume", "--frames", "13"});
    EXPECT_EQ(finished.status, 4) << finished.errors;
    EXPECT_NE(finished.errors.find("0012.bin: "), std::string::npos) << finished.errors;
  }
  io::write_checkpoint(run, identity, {12, whole});
  EXPECT_EQ(with({"--resume", "--frames", "13"}).status, 0);
}

}  // namespace
}  // namespace duet::test::forged_checkpoint_test
