// Tests of `duet study` and `duet report`: orders of convergence that theory knows, a cache that allows a
// study to go on, failures that show, and pages that need no other file.
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <sstream>

#include "tests/restart/program.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::study_test {
namespace {

using nlohmann::json;

constexpr const char* measure_of_top = R"(
[[measures]]
name = "orientation"
kind = "free_top"
body = "top"
)";

// Writes the specification into the folder and runs the study untimed.
Finished run_study(const ScratchFolder& folder, const std::string& spec) {
  io::write_atomically(folder / "spec.toml", spec);
  return run_duet({"study", (folder / "spec.toml").string(), "--untimed", "--jobs", "2", "--out",
                   (folder / "study").string()});
}

json results_of(const ScratchFolder& folder) {
  return json::parse(io::read_file(folder / "study/results.json"));
}

json study(const std::string& spec) {
  const ScratchFolder folder;
  const Finished finished = run_study(folder, spec);
  EXPECT_EQ(finished.status, 0) << finished.errors;
  return finished.status == 0 ? results_of(folder) : json();
}

// Returns the fitted order of convergence of a measure along a line of settings.
double order(const json& results, const std::string& line, const std::string& measure) {
  for (const json& fitted : results.at("orders"))
    if (fitted.at("line") == line && fitted.at("measure") == measure) return fitted.at("order").get<double>();
  ADD_FAILURE() << "no order of " << measure << " along " << line;
  return 0;
}

void expect_order(const json& results, const std::string& line, const std::string& measure, double expected,
                  double tolerance) {
  const double fitted = order(results, line, measure);
  record_margin(line + ": " + measure, fitted, fmt::format("{} +- {}", expected, tolerance));
  EXPECT_NEAR(fitted, expected, tolerance) << line << ": " << measure;
}

// Returns the number of new runs in the outcome, which reads "90 runs, 12 of them new; ...".
int new_runs(const Finished& finished) {
  const std::string outcome = finished.last_line();
  const std::size_t at = outcome.find(" runs, ");
  return at == std::string::npos ? -1 : std::stoi(outcome.substr(at + 7));
}

// The second-order update of the orientation and the first-order one converge at their orders, within 0.05.
TEST(Study, OrientationUpdateHasItsOrder) {
  const json results = study(std::string(R"(title = "top"
scene = "study/top"
frames = 12
)") + measure_of_top + R"(
[[knobs]]
name = "second"
set = ["solver.orientation=second_order"]
key = "solver.max_time_step"
values = [0.0052, 0.0026, 0.0013]
order = "steps"
[[knobs]]
name = "first"
set = ["solver.orientation=first_order"]
key = "solver.max_time_step"
values = [0.0026, 0.0013, 0.00065]
order = "steps"
)");
  expect_order(results, "second", "orientation", 2, 0.05);
  expect_order(results, "first", "orientation", 1, 0.05);
}

// The angle of a pendulum converges at second order, and its energy is kept to rounding at any step. The
// energy must not drift, because joints do no work.
TEST(Study, PendulumIsOfSecondOrder) {
  const json results = study(R"(title = "pendulum"
scene = "study/pendulum"
frames = 24
[[measures]]
name = "angle"
kind = "pendulum"
body = "bar"
[[measures]]
name = "energy"
kind = "energy"
[[measures]]
name = "gap"
kind = "joints"
[[knobs]]
name = "step"
key = "solver.max_time_step"
values = [0.0052, 0.0026, 0.0013]
order = "steps"
)");
  expect_order(results, "step", "angle", 2, 0.05);
  for (const json& row : results.at("rows")) {
    expect_below(row.at("errors").at("energy"), 1e-9, "energy, J");
    expect_below(row.at("errors").at("gap"), 1e-12, "gap, m");
  }
}

// Central differences and the trapezoidal rule of step V are of second order. The half step of the implicit
// integration is backward Euler, of first order. Linear elements are of second order, except at the front of
// the wave, which is a kink: 1.8 +- 0.2 allows for it.
TEST(Study, ElasticMotionHasItsOrders) {
  const json results = study(R"(title = "bar"
scene = "study/vibrating_bar"
frames = 12
[reference]
set = ["solver.cfl=0.02"]
[[measures]]
name = "state"
kind = "state"
[[measures]]
name = "motion"
kind = "vibrating_bar"
body = "bar"
[[knobs]]
name = "explicit"
key = "solver.cfl"
values = [0.8, 0.4, 0.2]
order = "steps"
[[knobs]]
name = "implicit"
set = ["solver.integration=implicit", "solver.cg_tolerance=1e-10"]
key = "solver.max_time_step"
values = [0.00004, 0.00002, 0.00001]
order = "steps"
[[knobs]]
name = "cells"
set = ["solver.cfl=0.3"]
key = "deformable.bar.shape.cells"
values = [[5, 2, 1], [10, 2, 1], [20, 2, 1]]
order = "cells"
)");
  expect_order(results, "explicit", "state", 2, 0.1);
  expect_order(results, "implicit", "state", 1, 0.1);
  expect_order(results, "cells", "motion", 1.8, 0.2);
}

// A slide at a constant deceleration is exact at any step. A soft box also shakes: the error of its sliding
// falls with the step, provided that the tolerance of the conjugate gradients is small enough.
TEST(Study, FrictionIsExactOrOfFirstOrderAtLeast) {
  const json rigid = study(R"(title = "rigid"
scene = "study/slide"
frames = 24
[[measures]]
name = "way"
kind = "slide"
body = "box"
slope = 10
friction = 0.2
[[knobs]]
name = "step"
key = "solver.max_time_step"
values = [0.02, 0.005]
)");
  for (const json& row : rigid.at("rows"))
    expect_below(row.at("errors").at("way"), 1e-9, "rigid box, relative");
  const json soft = study(R"(title = "soft"
scene = "friction"
frames = 1
set = ["fps=96", "solver.cg_tolerance=1e-9", "deformable.soft.shape.cells=[2, 2, 2]"]
[reference]
set = ["solver.max_time_step=7.8125e-7"]
[[measures]]
name = "state"
kind = "state"
body = "soft"
[[knobs]]
name = "step"
key = "solver.max_time_step"
values = [0.0000125, 0.00000625, 0.000003125]
order = "steps"
)");
  // A quantity of first order falls by a factor of 5 over these steps, when the reference has a quarter of
  // the last step: (16 - 1) / (4 - 1).
  expect_order(soft, "step", "state", std::log2(5) / 2, 0.1);
}

constexpr const char* two_steps = R"(title = "top"
scene = "study/top"
frames = 2
[[measures]]
name = "orientation"
kind = "free_top"
body = "top"
[[knobs]]
name = "step"
key = "solver.max_time_step"
values = [0.0052, 0.0026]
)";

TEST(Study, GoesOnWhereItStopped) {
  const ScratchFolder folder;
  const Finished first = run_study(folder, two_steps);
  ASSERT_EQ(first.status, 0) << first.errors;
  EXPECT_EQ(new_runs(first), 3) << first.last_line();
  const json results = results_of(folder);
  EXPECT_EQ(new_runs(run_study(folder, two_steps)), 0);
  // A run that was stopped has no outcome, and is run again.
  for (const auto& entry : fs::directory_iterator(folder / "study/runs"))
    if (contains(entry.path().string(), ".outcome.json")) {
      fs::remove(entry.path());
      break;
    }
  EXPECT_EQ(new_runs(run_study(folder, two_steps)), 1);
  EXPECT_EQ(results_of(folder), results) << "the same runs give the same results";
  // One more value is one more run.
  std::string longer = two_steps;
  longer.replace(longer.find("0.0026]"), 7, "0.0026, 0.0013]");
  EXPECT_EQ(new_runs(run_study(folder, longer)), 1);
}

TEST(Study, GoesOnAfterAnInterrupt) {
  const ScratchFolder folder;
  std::string spec = two_steps;
  spec.replace(spec.find("frames = 2"), 10, "frames = 400");
  io::write_atomically(folder / "spec.toml", spec);
  const std::vector<std::string> command = {"study", (folder / "spec.toml").string(), "--untimed", "--out",
                                            (folder / "study").string()};
  Program program(command);
  int done = 0;
  while (const auto line = program.line())
    if (contains(*line, "note: run ") && ++done == 1) program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 130) << program.errors();
  const Finished finished = run_duet(command);
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_EQ(new_runs(finished), 3 - done) << finished.last_line();
  EXPECT_GE(done, 1);
}

TEST(Study, ShowsFailedRunsAndGoesOn) {
  const ScratchFolder folder;
  io::write_atomically(folder / "boxes.toml", R"(title = "Two boxes"
frames = 1
[solver]
initial_overlap = "refuse"
[materials.rubber]
youngs_modulus = 1e5
[[deformable]]
name = "lower"
shape = { box = [1, 1, 1], cells = [2, 2, 2] }
material = "rubber"
[[deformable]]
name = "upper"
shape = { box = [1, 1, 1], cells = [2, 2, 2] }
position = [0, 2, 0]
material = "rubber"
)");
  const Finished finished = run_study(folder, fmt::format(R"(title = "overlap"
scene = "{}"
frames = 1
[[measures]]
name = "energy"
kind = "energy_gain"
[[knobs]]
name = "height"
key = "deformable.upper.position"
values = [[0, 1.5, 0], [0, 0.5, 0]]
)",
                                                          (folder / "boxes.toml").string()));
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_TRUE(contains(finished.last_line(), "1 failed")) << finished.last_line();
  const json rows = results_of(folder).at("rows");
  EXPECT_FALSE(rows.at(0).at("failed"));
  EXPECT_TRUE(rows.at(1).at("failed"));
  EXPECT_TRUE(contains(rows.at(1).at("error"), "upper")) << rows.at(1).at("error");
  EXPECT_TRUE(contains(io::read_file(folder / "study/report.html"), "failed"));
  EXPECT_TRUE(contains(io::read_file(folder / "study/results.csv"), ",yes,"));
}

// Checks that the page holds nothing but its own data, and no address of another machine or file.
void expect_stands_alone(const std::string& html) {
  EXPECT_FALSE(contains(html, "http"));
  EXPECT_FALSE(contains(html, "url("));
  EXPECT_FALSE(contains(html, "@import"));
  EXPECT_FALSE(contains(html, "<script"));
  for (const std::string attribute : {"src=\"", "href=\""})
    for (std::size_t at = html.find(attribute); at != std::string::npos; at = html.find(attribute, at + 1)) {
      const std::string target = html.substr(at + attribute.size(), 5);
      EXPECT_TRUE(target == "data:" || target.starts_with("#")) << target;
    }
}

TEST(Study, ItsPageStandsAlone) {
  const ScratchFolder folder;
  const Finished finished = run_study(folder, std::string(two_steps) + "pictures = true\n");
  ASSERT_EQ(finished.status, 0) << finished.errors;
  const std::string html = io::read_file(folder / "study/report.html");
  expect_stands_alone(html);
  EXPECT_TRUE(contains(html, "<svg"));
  EXPECT_TRUE(contains(html, "data:image/png;base64,"));
}

TEST(Study, RefusesABrokenSpecWithItsPlaces) {
  const ScratchFolder folder;
  const Finished finished = run_study(folder, R"(title = "broken"
scene = "study/top"
frames = 0
repetition = 3
[[measures]]
name = "state"
kind = "state"
[[measures]]
name = "slide"
kind = "slid"
body = "top"
[[knobs]]
name = "step"
key = "solver.max_time_step"
)");
  EXPECT_EQ(finished.status, 2);
  for (const char* part :
       {"spec.toml:3:10: frames: must be in [1,", "spec.toml:4:1: repetition: unknown key",
        "did you mean `repetitions`?", "spec.toml:7:8: measures[0]: is measured against a reference",
        "spec.toml:10:8: measures[1].kind: must be one of", "did you mean `slide`?",
        "spec.toml:12:1: knobs[0]: turns nothing"})
    EXPECT_TRUE(contains(finished.errors, part)) << part << "\n" << finished.errors;
}

// The tests run in another folder than that of the spec and its scene.
TEST(Study, FindsASceneBesideItsSpec) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder / "scenes_of_mine");
  io::write_atomically(folder / "scenes_of_mine/brick.toml",
                       "gravity = [0, 0, 0]\n[[rigid]]\nname = \"top\"\nshape = { box = [3, 2, 1] }\n"
                       "density = 1000\nangular_velocity = [0, 1, 2]\n");
  std::string spec = two_steps;
  spec.replace(spec.find("study/top"), 9, "scenes_of_mine/brick.toml");
  const Finished finished = run_study(folder, spec);
  EXPECT_EQ(finished.status, 0) << finished.errors;
}

TEST(Study, RefusesSettingsThatTheSceneDoesNotHave) {
  const ScratchFolder folder;
  std::string spec = two_steps;
  spec.replace(spec.find("solver.max_time_step"), 20, "solver.max_time_stop");
  const Finished finished = run_study(folder, spec);
  EXPECT_EQ(finished.status, 2);
  EXPECT_TRUE(contains(finished.errors, "max_time_step")) << finished.errors;
}

TEST(Study, SaysThatGnuplotIsMissing) {
  const ScratchFolder folder;
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  const Finished finished = run_study(folder, two_steps);
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(finished.status, 4);
  EXPECT_TRUE(contains(finished.errors, "gnuplot-nox")) << finished.errors;
}

// An effect that a scene does not need costs no call, and leaving it out changes no bit of the state.
TEST(Study, EffectsThatAreNotCalledForCostNothing) {
  const ScratchFolder folder;
  const std::string scene = "study/pendulum";
  const auto last_line = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"sim",          scene,     "--frames", "4",
                                      "--stats-only", "--quiet", "--out",    (folder / name).string()};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(run_duet(words).status, 0);
    const std::string text = io::read_file(folder / name / "stats.jsonl");
    return json::parse(text.substr(text.rfind('\n', text.size() - 2) + 1));
  };
  const json with = last_line("with", {});
  for (const char* stage :
       {"elastic forces", "damping solve", "I.3 self-repulsion", "IV self-collision", "I.2 volume correction",
        "V.1 make incompressible", "shock propagation", "0 kinematic motion"})
    EXPECT_EQ(with.at("stages").at(stage).at("calls"), 0) << stage;
  const json without =
      last_line("without", {"--without", "deformable_elasticity", "--without", "self_collision", "--without",
                            "incompressibility", "--without", "springs"});
  EXPECT_EQ(with.at("hash"), without.at("hash"));
}

TEST(Report, OfARunStandsAlone) {
  const ScratchFolder folder;
  const std::string run = (folder / "tiny").string();
  ASSERT_EQ(run_duet({"run", source_folder() + "/tests/restart/tiny.toml", "--frames", "3", "--out", run,
                      "--quiet", "--set", "render.width=64", "--set", "render.height=48"})
                .status,
            0);
  const Finished finished = run_duet({"report", run});
  ASSERT_EQ(finished.status, 0) << finished.errors;
  const std::string html = io::read_file(folder / "tiny/report/report.html");
  expect_stands_alone(html);
  for (const char* part :
       {"Energy", "Momentum", "Substeps a frame", "Seconds by stage", "rigid_collision", "frame 3"})
    EXPECT_TRUE(contains(html, part)) << part;
}

// Stages have other names in runs of older versions. A run that a newer version has continued has names of
// both.
TEST(Report, ShowsStagesByTheNamesThatTheRunHas) {
  const ScratchFolder folder;
  const std::string run = (folder / "tiny").string();
  ASSERT_EQ(run_duet({"sim", source_folder() + "/tests/restart/tiny.toml", "--frames", "3", "--out", run,
                      "--quiet", "--stats-only"})
                .status,
            0);
  std::istringstream lines(io::read_file(run + "/stats.jsonl"));
  std::string stats;
  for (std::string line; std::getline(lines, line);) {
    nlohmann::ordered_json frame = nlohmann::ordered_json::parse(line);
    if (frame.at("frame") < 3)
      frame["stages"] = {{"II collide", {{"seconds", 1.0}, {"calls", 3}}},
                         {"joints", {{"seconds", 0.5}, {"calls", 2}}}};
    stats += frame.dump() + "\n";
  }
  io::write_atomically(run + "/stats.jsonl", stats);
  io::remove_file(run + "/journal.jsonl");  // Runs of those versions have no journal.
  const Finished finished = run_duet({"report", run});
  ASSERT_EQ(finished.status, 0) << finished.errors;
  const std::string html = io::read_file(folder / "tiny/report/report.html");
  for (const char* part : {"II collide", "joints (within others)", "II.1 collisions"})
    EXPECT_TRUE(contains(html, part)) << part;
}

}  // namespace
}  // namespace duet::test::study_test
