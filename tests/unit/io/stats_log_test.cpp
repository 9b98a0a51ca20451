#include "sim/io/stats_log.h"

#include <csignal>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::io::stats_log_test {
namespace {

FrameStats stats_of(int frame) {
  FrameStats stats;
  stats.frame = frame;
  stats.time = frame / 24.0;
  stats.stages = {{"I.1 advance velocity", 0.25, 7}, {"II collide", 0, 0}};
  stats.momentum = Vec3(1, 0.1, -3);
  stats.hash = 0xff;
  return stats;
}

TEST(StatsLog, LineHasTheAgreedFieldsInOrder) {
  const std::string text = stats_json(stats_of(3));
  const auto object = nlohmann::ordered_json::parse(text);
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"frame",
                                            "time",
                                            "substeps",
                                            "dt_min",
                                            "dt_max",
                                            "seconds",
                                            "processor_seconds",
                                            "stages",
                                            "cg_iterations",
                                            "contacts",
                                            "max_penetration",
                                            "pressure_iterations",
                                            "volume_error",
                                            "min_det_F",
                                            "inverted",
                                            "max_stretch",
                                            "self_repulsions",
                                            "self_collisions",
                                            "impact_zone_particles",
                                            "kinetic",
                                            "potential",
                                            "elastic",
                                            "momentum",
                                            "angular_momentum",
                                            "hash"}));
  EXPECT_EQ(object["time"].get<double>(), 0.125);
  EXPECT_EQ(object["stages"].dump(),
            R"({"I.1 advance velocity":{"seconds":0.25,"calls":7},"II collide":{"seconds":0.0,"calls":0}})");
  EXPECT_EQ(object["momentum"].dump(), "[1.0,0.1,-3.0]");
  EXPECT_EQ(object["hash"], "00000000000000ff");
  EXPECT_EQ(text.find('\n'), std::string::npos);
  FrameStats counted = stats_of(3);
  counted.self_intersections = 2;
  EXPECT_EQ(nlohmann::json::parse(stats_json(counted))["self_intersections"], 2);
}

// Frames whose bodies are drawn by other surfaces than those that touch have two further keys, the second one
// only if the drawn surface lies in something.
TEST(StatsLog, DrawnSurfacesThatDoNotTouchHaveTheirDepth) {
  FrameStats stats = stats_of(3);
  EXPECT_FALSE(nlohmann::json::parse(stats_json(stats)).contains("drawn_penetration"));
  stats.drawn_overlap.emplace();
  nlohmann::json object = nlohmann::json::parse(stats_json(stats));
  EXPECT_EQ(object["drawn_penetration"], 0);
  EXPECT_FALSE(object.contains("deepest_drawn"));
  stats.drawn_overlap = DeepestOverlap{0.25, "fish", "step", Vec3(1, 2, 3)};
  object = nlohmann::json::parse(stats_json(stats));
  EXPECT_EQ(object["drawn_penetration"], 0.25);
  EXPECT_EQ(object["deepest_drawn"].dump(), R"({"body":"fish","in":"step","place":[1.0,2.0,3.0]})");
}

TEST(StatsLog, ResumingKeepsTheLinesUpToTheResumedFrame) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  {
    StatsLog log(run);
    for (int frame = 0; frame < 5; ++frame) log.append(stats_of(frame));
  }
  write_atomically(run.stats(), read_file(run.stats()) + "{\"frame\":1,\"ti");  // A power cut tore this line.
  {
    StatsLog log(run, 2);
    log.append(stats_of(3));
  }
  std::string expected;
  for (int frame = 0; frame < 4; ++frame) expected += stats_json(stats_of(frame)) + '\n';
  EXPECT_EQ(read_file(run.stats()), expected);
  { const StatsLog fresh(run); }
  EXPECT_EQ(read_file(run.stats()), "");
}

// A limit on file sizes stands for a full disk. The line that does not fit is cut off again, so that the file
// ends with a whole line.
TEST(StatsLog, ALineThatDoesNotFitIsNotThere) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  const std::string line = stats_json(stats_of(0)) + '\n';
  const pid_t child = ::fork();
  if (child == 0) {
    StatsLog log(run);
    log.append(stats_of(0));
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{line.size() + 20, line.size() + 20};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      log.append(stats_of(1));
      ::_exit(1);
    } catch (const FileError& error) {
      ::_exit(std::string(error.what()).find("ulimit -f") != std::string::npos ? 0 : 2);
    }
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0);
  EXPECT_EQ(read_file(run.stats()), line);
}

}  // namespace
}  // namespace duet::io::stats_log_test
