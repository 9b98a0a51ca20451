// Tests that a run that is stopped at any moment leaves only whole files, and goes on as if it had never been
// stopped.
#include <algorithm>
#include <map>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/numerics.h"
#include "sim/io/checkpoint.h"
#include "sim/io/run_check.h"
#include "sim/io/run_directory.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"

namespace duet::test::restart_test {
namespace {

std::vector<nlohmann::json> statistics(const io::RunDirectory& run) {
  std::vector<nlohmann::json> lines;
  const std::string text = io::read_file(run.stats());
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    lines.push_back(nlohmann::json::parse(text.substr(begin, end - begin)));
  return lines;
}

// Returns the line without its times, which differ from run to run.
nlohmann::json without_times(nlohmann::json line) {
  line.erase("seconds");
  line.erase("processor_seconds");
  for (auto& [name, stage] : line["stages"].items()) stage.erase("seconds");
  return line;
}

// Checks that both runs have the same frames up to `last`, bit by bit. VDB files carry a random identifier,
// so that other tests compare their voxels.
void expect_same_run(const io::RunDirectory& run, const io::RunDirectory& reference, int last) {
  const auto lines = statistics(run), expected = statistics(reference);
  ASSERT_EQ(lines.size(), static_cast<std::size_t>(last) + 1);
  ASSERT_EQ(expected.size(), lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_EQ(without_times(lines[i]), without_times(expected[i]));
  for (int frame = 0; frame <= last; ++frame) {
    EXPECT_EQ(io::read_file(run.mesh(frame)), io::read_file(reference.mesh(frame))) << "frame " << frame;
    EXPECT_EQ(io::read_file(run.values(frame)), io::read_file(reference.values(frame))) << "frame " << frame;
    EXPECT_TRUE(fs::exists(run.level_set(frame))) << "frame " << frame;
  }
}

// Checks that every file with a final name is whole, and returns the number of meshes.
int expect_whole_files(const io::RunDirectory& run) {
  int meshes = 0;
  for (const auto& entry : fs::directory_iterator(run.root / "mesh")) {
    if (entry.path().extension() != ".obj") continue;
    const std::vector<BodySurface> bodies = io::read_obj(entry.path());
    EXPECT_EQ(bodies.size(), 2U);
    for (const BodySurface& body : bodies) EXPECT_FALSE(body.surface.triangles.empty());
    ++meshes;
  }
  const std::string text = io::read_file(run.stats());
  EXPECT_TRUE(text.empty() || text.back() == '\n');
  for (const nlohmann::json& line : statistics(run)) EXPECT_TRUE(line.is_object());
  return meshes;
}

// Returns the number of temporary files below the folder.
int leftovers(const fs::path& root) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    count += entry.path().extension().string().starts_with(io::temporary_mark) ? 1 : 0;
  return count;
}

// Starts a simulation and sends the signal when frame 1 is reported. The lines of --json fill the pipe long
// before frame 40, so that the simulation is then still at work.
Finished interrupt_simulation(const fs::path& out, int signal) {
  Program program({"sim", tiny, "--out", out.string(), "--json", "--overwrite"});
  while (const auto line = program.line())
    if (nlohmann::json::parse(*line).value("frame", -1) == 1) break;
  program.signal(signal);
  return finish(program);
}

class Restart : public testing::Test {
 protected:
  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"}, reference{scratch / "reference"};

  void simulate_reference() {
    const Finished whole = run_duet({"sim", tiny, "--out", reference.root.string(), "--quiet"});
    ASSERT_EQ(whole.status, 0) << whole.errors;
  }
  // Makes the run look as if a program with the next version of the numerics had computed it up to the frame.
  void computed_by_other_numerics(int frame) {
    const scene::ReadResult read = scene::read(tiny);
    const std::uint64_t identity =
        io::scene_identity(read.source, scene::plan_effects(read.scene).active()) ^ read.meshes;
    io::CheckpointSearch search = io::find_checkpoint(run, identity);
    ASSERT_TRUE(search.found);
    ASSERT_EQ(search.found->frame, frame);
    search.found->numerics = numerics_version + 1;
    io::write_checkpoint(run, identity, *search.found);
    io::Manifest manifest = io::read_manifest(run);
    manifest.origin.numerics = numerics_version + 1;
    io::write_manifest(run, manifest);
  }
  // Returns the path and content of every file in the run directory.
  std::map<fs::path, std::string> all_files() const {
    std::map<fs::path, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(run.root))
      if (entry.is_regular_file()) files[entry.path()] = io::read_file(entry.path());
    return files;
  }
  Finished resume() { return run_duet({"sim", tiny, "--out", run.root.string(), "--quiet", "--resume"}); }
};

// An interrupted run exits with status 130, leaves whole files, and continues to the bits of a run that was
// never stopped. State that a checkpoint lacks is found.
TEST_F(Restart, InterruptedRunContinuesBitIdentically) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const Finished stopped = interrupt_simulation(run.root, signal);
    ASSERT_EQ(stopped.status, 130) << stopped.errors;
    const auto outcome = nlohmann::json::parse(stopped.last_line());
    EXPECT_EQ(outcome["outcome"], "interrupted");
    EXPECT_NE(outcome["text"].get<std::string>().find("--resume"), std::string::npos) << outcome;

    const int meshes = expect_whole_files(run);
    EXPECT_GE(meshes, 2);
    EXPECT_LT(meshes, 41);
    EXPECT_EQ(statistics(run).size(), static_cast<std::size_t>(meshes));
    EXPECT_EQ(leftovers(run.root), 0);
  }
  simulate_reference();
  const Finished resumed = resume();
  ASSERT_EQ(resumed.status, 0) << resumed.errors;
  EXPECT_TRUE(resumed.last_line().starts_with("done: ")) << resumed.last_line();
  expect_same_run(run, reference, 40);
}

// SIGKILL gives the program no chance to clean up. Its files are whole all the same, and the run continues to
// the same bits.
TEST_F(Restart, KilledRunContinuesBitIdentically) {
  const Finished killed = interrupt_simulation(run.root, SIGKILL);
  ASSERT_EQ(killed.status, 128 + SIGKILL);
  expect_whole_files(run);
  EXPECT_EQ(io::check_run(run).faults, std::vector<std::string>());
  for (int frames = 1; frames <= 4; ++frames) {  // The run is killed again, each time a little later.
    Program program({"sim", tiny, "--out", run.root.string(), "--resume", "--json"});
    for (int seen = 0; seen < frames;) {
      const auto line = program.line();
      ASSERT_TRUE(line) << program.errors();
      seen += nlohmann::json::parse(*line).value("event", "") == "frame" ? 1 : 0;
    }
    program.signal(SIGKILL);
    ASSERT_EQ(finish(program).status, 128 + SIGKILL);
    expect_whole_files(run);
    EXPECT_EQ(io::check_run(run).faults, std::vector<std::string>());
  }
  simulate_reference();
  const Finished resumed = resume();
  ASSERT_EQ(resumed.status, 0) << resumed.errors;
  EXPECT_EQ(leftovers(run.root), 0) << "what the killed run left half written is cleared away";
  expect_same_run(run, reference, 40);
}

// Sums must not depend on the number of threads: runs with 1, 2 and 3 threads are equal bit by bit.
TEST_F(Restart, ThreadsDoNotChangeTheRun) {
  const auto simulate = [&](const io::RunDirectory& out, const char* threads) {
    const Finished finished = run_duet({"sim", "stack", "--frames", "4", "--threads", threads, "--out",
                                        out.root.string(), "--quiet", "--overwrite"});
    ASSERT_EQ(finished.status, 0) << finished.errors;
  };
  simulate(reference, "1");
  for (const char* threads : {"2", "3"}) {
    simulate(run, threads);
    expect_same_run(run, reference, 4);
  }
}

TEST_F(Restart, DamagedCheckpointFallsBackToThePreviousOne) {
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "6", "--quiet"}).status, 0);
  std::string bytes = io::read_file(run.checkpoint() / "0006.bin");
  bytes[bytes.size() / 2] ^= 1;
  io::write_atomically(run.checkpoint() / "0006.bin", bytes);
  const Finished resumed = run_duet({"sim", tiny, "--out", run.root.string(), "--resume", "--json"});
  ASSERT_EQ(resumed.status, 0) << resumed.errors;
  EXPECT_NE(resumed.output.at(0).find("0006.bin is damaged"), std::string::npos) << resumed.output[0];
  EXPECT_NE(resumed.output.at(1).find("after frame 5"), std::string::npos) << resumed.output[1];
  simulate_reference();
  expect_same_run(run, reference, 40);
}

// Simulates `scene` up to the frame `last` twice: `run` in two parts, the first one up to the frame `first`,
// and `reference` in one.
void simulate_in_parts(const std::string& scene, int first, int last, const io::RunDirectory& run,
                       const io::RunDirectory& reference) {
  for (const auto& [out, frames] : {std::pair(run, first), {run, last}, {reference, last}}) {
    std::vector<std::string> arguments = {
        "sim", scene, "--out", out.root.string(), "--frames", std::to_string(frames), "--quiet"};
    if (fs::exists(out.root)) arguments.emplace_back("--resume");
    const Finished finished = run_duet(arguments);
    ASSERT_EQ(finished.status, 0) << finished.errors;
  }
}

TEST_F(Restart, PrescribedMotionGoesOnWhereItWas) {
  simulate_in_parts(source_folder() + "/tests/restart/kinematic.toml", 4, 10, run, reference);
  expect_same_run(run, reference, 10);
}

// Checks that a scene of tests/restart goes on to the same statistics after three of six frames. Returns
// those.
std::vector<nlohmann::json> expect_goes_on(const std::string& name, const io::RunDirectory& run,
                                           const io::RunDirectory& reference) {
  simulate_in_parts(source_folder() + "/tests/restart/" + name, 3, 6, run, reference);
  const auto lines = statistics(run), expected = statistics(reference);
  EXPECT_EQ(lines.size(), 7U);
  EXPECT_EQ(expected.size(), lines.size());
  for (std::size_t i = 0; i < std::min(lines.size(), expected.size()); ++i)
    EXPECT_EQ(without_times(lines[i]), without_times(expected[i]));
  return lines;
}

TEST_F(Restart, FrictionBetweenSurfacesGoesOnAsItWas) {
  EXPECT_GT(expect_goes_on("sliding.toml", run, reference).at(3)["self_repulsions"], 0);
}

TEST_F(Restart, ForcesBetweenSurfacesGoOnAsTheyWere) {
  EXPECT_GT(expect_goes_on("stacked.toml", run, reference).at(3)["self_repulsions"], 0);
}

TEST_F(Restart, ForcesOfControlGoOnAsTheyWere) {
  EXPECT_GT(expect_goes_on("pressed.toml", run, reference).at(3)["contacts"], 0);
}

TEST_F(Restart, ResumeRefusesAnotherScene) {
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "2", "--quiet"}).status, 0);
  const auto mesh_time = fs::last_write_time(run.mesh(2));
  for (const std::vector<std::string>& change :
       {std::vector<std::string>{"--set", "rigid.ball.mass=21"}, {"--without", "push_out"}}) {
    std::vector<std::string> arguments = {"sim", tiny, "--out", run.root.string(), "--resume"};
    arguments.insert(arguments.end(), change.begin(), change.end());
    const Finished refused = run_duet(arguments);
    EXPECT_EQ(refused.status, 2);
    EXPECT_NE(refused.errors.find("the scene and settings of the earlier run"), std::string::npos)
        << refused.errors;
  }
  EXPECT_EQ(fs::last_write_time(run.mesh(2)), mesh_time);
}

// A run that solver.max_substeps stopped continues with a larger bound, or with that of the scene, to the
// bits of a run without that stop.
TEST_F(Restart, AStoppedFrameGoesOnWithMoreSubsteps) {
  const auto simulate = [](const io::RunDirectory& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"sim", tiny, "--frames", "12", "--quiet", "--out", out.root.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words);
  };
  ASSERT_EQ(simulate(reference, {}).status, 0);
  int most = 0;  // substeps of a frame
  for (const nlohmann::json& line : statistics(reference)) most = std::max(most, line["substeps"].get<int>());
  ASSERT_GT(most, 1);
  for (const bool has_bound : {true, false}) {
    const std::string few = fmt::format("solver.max_substeps={}", most - 1);
    const Finished stopped = simulate(run, {"--set", few, "--overwrite"});
    EXPECT_EQ(stopped.status, 3) << most << " substeps: " << stopped.errors;
    EXPECT_NE(stopped.errors.find("solver.max_substeps"), std::string::npos) << stopped.errors;
    const Finished resumed =
        has_bound ? simulate(run, {"--resume", "--set", fmt::format("solver.max_substeps={}", most)})
                  : simulate(run, {"--resume"});
    ASSERT_EQ(resumed.status, 0) << resumed.errors;
    expect_same_run(run, reference, 12);
  }
}

// Another variant of the same numerics computes the same bits, so that the program says nothing. Only the
// manifest tells which program computed which frames.
TEST_F(Restart, AnotherVariantOfTheSameNumericsContinues) {
  simulate_reference();
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "3", "--quiet"}).status, 0);
  io::Manifest manifest = io::read_manifest(run);
  EXPECT_EQ(manifest.origin.numerics, numerics_version);
  EXPECT_NE(manifest.origin.compiler, "");
  EXPECT_NE(manifest.origin.variant, "");
  const io::Origin here = manifest.origin;
  manifest.origin.variant = "another variant";
  manifest.origin.machine = "another machine";
  io::write_manifest(run, manifest);
  const Finished resumed = run_duet({"sim", tiny, "--out", run.root.string(), "--resume", "--json"});
  ASSERT_EQ(resumed.status, 0) << resumed.errors;
  EXPECT_NE(resumed.output.at(0).find("continuing after frame 3"), std::string::npos) << resumed.output[0];
  expect_same_run(run, reference, 40);
  EXPECT_EQ(io::read_manifest(run).earlier, (std::vector<io::EarlierFrames>{{3, manifest.origin}}));
  EXPECT_EQ(io::read_manifest(run).origin, here);
}

TEST_F(Restart, OtherNumericsContinueOnlyWhenAllowed) {
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "3", "--quiet"}).status, 0);
  computed_by_other_numerics(3);
  const auto files = all_files();
  const Finished refused = resume();
  EXPECT_EQ(refused.status, 2);
  for (const std::string& part :
       {fmt::format("numerics {} (duet ", numerics_version + 1),
        fmt::format("numerics {} (duet ", numerics_version), std::string("--allow-other-build")})
    EXPECT_NE(refused.errors.find(part), std::string::npos) << refused.errors;
  EXPECT_EQ(all_files(), files) << "a refused run stays as it is";

  const Finished allowed = run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "5", "--json",
                                     "--resume", "--allow-other-build"});
  ASSERT_EQ(allowed.status, 0) << allowed.errors;
  EXPECT_NE(allowed.output.at(0).find("not to the same bits"), std::string::npos) << allowed.output[0];
  EXPECT_TRUE(fs::exists(run.mesh(5)));
  EXPECT_EQ(io::read_manifest(run).earlier.at(0).last_frame, 3);
  EXPECT_EQ(io::read_manifest(run).earlier.at(0).origin.numerics, numerics_version + 1);
  EXPECT_EQ(resume().status, 0) << "the newest frames are of this program now";
}

TEST_F(Restart, CheckpointsOfAnotherFormatAreRefusedAndKept) {
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "3", "--quiet"}).status, 0);
  for (const char* name : {"0002.bin", "0003.bin"}) {
    std::string bytes = io::read_file(run.checkpoint() / name);
    bytes[8] = 5;  // The number of the format follows the mark of eight bytes.
    io::write_atomically(run.checkpoint() / name, bytes);
  }
  const auto files = all_files();
  for (const bool allow : {false, true}) {
    std::vector<std::string> arguments = {"sim", tiny, "--out", run.root.string(), "--resume"};
    if (allow) arguments.emplace_back("--allow-other-build");
    const Finished refused = run_duet(arguments);
    EXPECT_EQ(refused.status, 2);
    EXPECT_NE(refused.errors.find("its checkpoints are of duet "), std::string::npos) << refused.errors;
    EXPECT_EQ(all_files(), files);
  }
}

TEST_F(Restart, FrameWindowWritesOnlyItsFrames) {
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "3:5", "--quiet"}).status, 0);
  ASSERT_EQ(run_duet({"sim", tiny, "--out", reference.root.string(), "--frames", "5", "--quiet"}).status, 0);
  for (int frame = 0; frame <= 5; ++frame) {
    EXPECT_EQ(fs::exists(run.mesh(frame)), frame >= 3);
    EXPECT_EQ(fs::exists(run.level_set(frame)), frame >= 3);
    if (frame < 3) continue;
    EXPECT_EQ(io::read_file(run.mesh(frame)), io::read_file(reference.mesh(frame)));
  }
}

// A task with little time is given again and again. Every call computes at least one frame, and the result
// equals that of one long call.
TEST_F(Restart, ShortTasksGoOnToTheSameRun) {
  const std::vector<std::string> task = {"run",      tiny,     "--out",    run.root.string(),
                                         "--frames", "4",      "--resume", "--stop-after",
                                         "1e-6",     "--quiet"};
  int calls = 0, frames = 0;
  for (; calls < 20; ++calls) {
    const Finished finished = run_duet(task);
    ASSERT_TRUE(finished.status == 75 || finished.status == 0) << finished.errors;
    const int simulated = expect_whole_files(run);
    EXPECT_TRUE(simulated == frames + 1 || frames == 5 || calls == 0) << simulated << " after " << frames;
    frames = simulated;
    if (finished.status == 0) break;
    EXPECT_NE(finished.last_line().find("--resume"), std::string::npos) << finished.last_line();
  }
  EXPECT_GE(calls, 3) << "calls before the last one: each simulates one frame of four";
  const Finished whole =
      run_duet({"run", tiny, "--out", reference.root.string(), "--frames", "4", "--quiet"});
  ASSERT_EQ(whole.status, 0) << whole.errors;
  expect_same_run(run, reference, 4);
  for (int frame = 0; frame <= 4; ++frame)
    EXPECT_EQ(io::read_file(run.image(frame)), io::read_file(reference.image(frame))) << frame;
  EXPECT_TRUE(fs::exists(run.root / "tiny.mp4"));
}

// Static bodies have one file of level sets for all frames, which is written with the first of them.
class StaticLevelSets : public Restart {
 protected:
  void simulate(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"sim", source_folder() + "/tests/restart/static.toml", "--out",
                                          run.root.string(), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::find(more.begin(), more.end(), "--resume") == more.end()) arguments.emplace_back("--overwrite");
    const Finished finished = run_duet(arguments);
    ASSERT_EQ(finished.status, 0) << finished.errors;
  }
  bool exists() const { return fs::exists(run.static_level_sets()); }
};

TEST_F(StaticLevelSets, AResumedRunHasThem) {
  simulate({"--frames", "2"});
  EXPECT_TRUE(exists());
  const auto whole = fs::file_size(run.static_level_sets());
  io::write_atomically(run.static_level_sets(), "damaged");
  simulate({"--resume"});
  EXPECT_EQ(fs::file_size(run.static_level_sets()), whole);
  for (int frame = 0; frame <= 6; ++frame) {
    EXPECT_TRUE(fs::exists(run.level_set(frame)));
    EXPECT_LT(fs::file_size(run.level_set(frame)), whole) << "a ball of fewer voxels than the plate";
  }
}

TEST_F(StaticLevelSets, AreWrittenWithTheFirstFrameOfAWindow) {
  simulate({"--stats-only", "--frames", "1"});
  EXPECT_FALSE(exists());
  simulate({"--resume", "--frames", "3:4"});
  EXPECT_TRUE(exists());
  EXPECT_FALSE(fs::exists(run.level_set(2)));
  EXPECT_TRUE(fs::exists(run.level_set(3)));
}

TEST_F(StaticLevelSets, OfAnEarlierRunGoAway) {
  simulate({"--frames", "1"});
  simulate({"--stats-only", "--frames", "1"});
  EXPECT_FALSE(exists());
  simulate({"--frames", "1"});
  simulate({"--frames", "1", "--set", "rigid.plate.static=false", "--set", "rigid.plate.mass=1"});
  EXPECT_FALSE(exists());
}

TEST_F(StaticLevelSets, WhereNothingMovesAreAllThereAre) {
  simulate({"--frames", "2"});
  const std::string scene = (run.root.parent_path() / "plate.toml").string();
  io::write_atomically(scene, "[[rigid]]\nname = \"plate\"\nshape = { box = [2, 0.2, 2] }\nstatic = true\n");
  const Finished finished =
      run_duet({"sim", scene, "--out", run.root.string(), "--frames", "2", "--quiet", "--overwrite"});
  ASSERT_EQ(finished.status, 0) << finished.errors;
  EXPECT_TRUE(exists());
  for (int frame = 0; frame <= 2; ++frame) {
    EXPECT_TRUE(fs::exists(run.mesh(frame)));
    EXPECT_FALSE(fs::exists(run.level_set(frame)));
  }
}

// The pictures of `duet run` equal those of `duet render`, also after an interruption, because both draw the
// files.
TEST_F(Restart, InterruptedRunIsDrawnLikeTheWhole) {
  {
    Program program({"run", tiny, "--out", run.root.string(), "--frames", "12", "--json"});
    while (const auto line = program.line())
      if (nlohmann::json::parse(*line).value("event", "") == "drawn") break;
    program.signal(SIGINT);
    const Finished stopped = finish(program);
    ASSERT_TRUE(stopped.status == 130 || stopped.status == 0) << stopped.errors;
  }
  const Finished resumed =
      run_duet({"run", tiny, "--out", run.root.string(), "--frames", "12", "--quiet", "--resume"});
  ASSERT_EQ(resumed.status, 0) << resumed.errors;
  std::map<int, std::string> pictures;
  for (int frame = 0; frame <= 12; ++frame) pictures[frame] = io::read_file(run.image(frame));
  const Finished drawn = run_duet({"render", run.root.string(), "--frames", "0:12", "--quiet"});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  for (const auto& [frame, picture] : pictures) EXPECT_EQ(picture, io::read_file(run.image(frame))) << frame;
  EXPECT_NE(pictures[0], pictures[12]) << "the ball has moved";
}

}  // namespace
}  // namespace duet::test::restart_test
