// Tests of the program as a user meets it: exit statuses, messages, and a last line that states the outcome.
#include "tests/restart/program.h"

#include <algorithm>
#include <array>
#include <csignal>

#include "tests/support/environment.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/stat.h>

#include "sim/base/files.h"
#include "sim/base/numerics.h"
#include "sim/io/run_directory.h"

namespace duet::test::program_test {
namespace {

TEST(Program, HelpAndVersionSucceed) {
  const Finished version = run_duet({"--version"});
  EXPECT_EQ(version.status, 0);
  // An example is: duet 0.1.0 (0123456789ab), g++ 12.2.0, native (x86-64-v4), numerics 1
  EXPECT_TRUE(version.last_line().starts_with("duet 0.")) << version.last_line();
  EXPECT_TRUE(contains(version.last_line(), "++ ")) << version.last_line();
  EXPECT_TRUE(version.last_line().ends_with(fmt::format(", numerics {}", numerics_version)))
      << version.last_line();
  EXPECT_EQ(run_duet({"--help"}).status, 0);
  for (const char* command :
       {"run", "sim", "render", "check", "explain", "tetrahedralize", "compare", "study", "report", "verify",
        "export", "overlaps", "hashes", "list", "new", "preview"})
    EXPECT_EQ(run_duet({command, "--help"}).status, 0) << command;
}

TEST(Program, BadUsageHasStatusTwoAndSaysWhy) {
  struct Case {
    std::vector<std::string> arguments;
    std::string message;
  };
  for (const Case& bad :
       {Case{{}, "subcommand"},
        {{"rnder"}, "did you mean `render`?"},
        {{"sim"}, "scene is required"},
        {{"sim", tiny, "--fraems", "3"}, "--fraems"},
        {{"sim", tiny, "--frames", "5:3"}, "A <= B"},
        {{"sim", tiny, "--frames", "3x"}, "N or A:B"},
        {{"sim", tiny, "--frames", "-1"}, "N or A:B"},
        {{"sim", tiny, "--threads", "0"}, "--threads"},
        {{"sim", tiny, "--accuracy", "best"}, "draft"},
        {{"sim", tiny, "--without", "push_oot"}, "push_out"},
        {{"sim", tiny, "--set", "rigid.ball.mas=3"}, "mass"},
        {{"sim", tiny, "--quiet", "--json"}, "--quiet"},
        {{"sim", tiny, "--allow-other-build"}, "--resume"},
        {{"sim", tiny, "--resume", "--overwrite"}, "--overwrite"},
        {{"overlaps", tiny, "--spacing", "nan"}, "1e+06 is expected, not nan"},
        {{"tetrahedralize", "a.obj", "a.mesh", "--spacing", "nan"}, "is expected, not nan"},
        {{"render", "somewhere", "--set", "solver.cfl=0.5"}, "solver.cfl"},
        {{"check"}, "SCENE"},
        {{"tetrahedralize", "a.obj", "a.msh"}, ".mesh (Medit"},
        {{"tetrahedralize", "a.obj", "a.mesh", "--cells", "1"}, "--cells"},
        {{"tetrahedralize", "a.obj", "a.mesh", "--cells", "9", "--spacing", "1"}, "--spacing"},
        {{"list", "--frames", "3"}, "--frames"}}) {
    const Finished finished = run_duet(bad.arguments);
    EXPECT_EQ(finished.status, 2) << bad.message;
    EXPECT_TRUE(contains(finished.errors, bad.message)) << finished.errors;
    EXPECT_TRUE(contains(finished.last_line(), "failed")) << finished.last_line();
  }
}

TEST(Program, AnUnknownSceneNamesTheNearestOneThatShips) {
  const Finished finished = run_duet({"run", "stak"});
  EXPECT_EQ(finished.status, 2);
  EXPECT_TRUE(contains(finished.errors, "did you mean `stack`?")) << finished.errors;
  EXPECT_TRUE(finished.last_line().starts_with("failed: ")) << finished.last_line();
}

TEST(Program, ListShowsTheShippedScenesAndTheyAreValid) {
  const Finished list = run_duet({"list"});
  EXPECT_EQ(list.status, 0) << list.errors;
  ASSERT_GE(list.output.size(), 2U);
  bool stack = false;
  for (const std::string& line : list.output)
    stack |= line.starts_with("stack ") && contains(line, "form a stack");
  EXPECT_TRUE(stack);
  const Finished check = run_duet({"check", "stack"});
  EXPECT_EQ(check.status, 0);
  EXPECT_EQ(check.last_line(), "scenes/stack.toml: ok");
}

// Returns an OBJ mesh of two boxes of 1 m with a bar between them that is 3 m long and 2 cm thick. Square
// rings along the x axis bound the parts. The bar is beside the axis, between the nodes of the lattice, and
// is lost when the mesh is filled.
std::string dumbbell() {
  const std::array<std::pair<int, double>, 6> rings{
      {{0, 0.5}, {1, 0.5}, {1, 0.01}, {4, 0.01}, {4, 0.5}, {5, 0.5}}};
  std::string text;
  for (const auto& [x, half] : rings)
    for (const auto& [y, z] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
      text += fmt::format("v {} {} {}\n", x, half * y + (half < 0.1 ? 0.11 : 0),
                          half * z + (half < 0.1 ? 0.07 : 0));
  for (int ring = 0; ring < 5; ++ring)
    for (int side = 0; side < 4; ++side) {
      const int a = 4 * ring + side + 1, b = 4 * ring + (side + 1) % 4 + 1;
      text += fmt::format("f {} {} {} {}\n", b, b + 4, a + 4, a);
    }
  return text + "f 4 3 2 1\nf 21 22 23 24\n";
}

TEST(Program, CheckFindsBodiesThatFallIntoPartsOnceTheyAreFilled) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "dumbbell.obj", dumbbell());
  io::write_atomically(scratch / "thin.toml",
                       "[materials.rubber]\n\n[[deformable]]\nname = \"thin\"\nmaterial = \"rubber\"\n"
                       "shape = { mesh = \"dumbbell.obj\", spacing = 0.3 }\n");
  const Finished finished = run_duet({"check", "thin.toml"}, scratch.path());
  EXPECT_EQ(finished.status, 2);
  ASSERT_EQ(finished.output.size(), 2U);
  EXPECT_TRUE(finished.output[0].starts_with("thin.toml:3:1: deformable.thin.shape: ")) << finished.output[0];
  EXPECT_TRUE(contains(finished.output[0], "fall into 2 parts")) << finished.output[0];
  EXPECT_EQ(finished.last_line(), "failed: 1 problem");
}

TEST(Program, CheckShowsAllProblemsWithTheirPlaces) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "bad.toml", "title = 3\nframs = 10\n");
  const Finished finished = run_duet({"check", "bad.toml"}, scratch.path());
  EXPECT_EQ(finished.status, 2);
  ASSERT_EQ(finished.output.size(), 4U);
  EXPECT_TRUE(contains(finished.output[0], "no body")) << finished.output[0];
  EXPECT_TRUE(finished.output[1].starts_with("bad.toml:1:")) << finished.output[1];
  EXPECT_TRUE(finished.output[2].starts_with("bad.toml:2:")) << finished.output[2];
  EXPECT_TRUE(contains(finished.output[2], "`frames`")) << finished.output[2];
  EXPECT_EQ(finished.output[3], "failed: 3 problems");
}

// Numbers within their bounds may still ask for millions of steps. `check` says so before anybody waits for
// them.
TEST(Program, CheckNamesFramesOfThousandsOfSteps) {
  for (const char* setting :
       {"fps=0.001", "materials.jelly.youngs_modulus=1e15", "solver.cfl=1e-6", "solver.max_time_step=1e-12",
        "rigid.ball.velocity=[0,-1e9,0]", "gravity=[0,-1e9,0]"}) {
    const Finished finished = run_duet({"check", tiny, "--set", setting});
    EXPECT_EQ(finished.status, 0) << finished.errors;
    ASSERT_EQ(finished.output.size(), 2U) << setting;
    EXPECT_TRUE(finished.last_line().ends_with(": ok, with 1 warning")) << finished.last_line();
    EXPECT_TRUE(contains(finished.output[0], "substeps a frame") ||
                contains(finished.output[0], "the first step is"))
        << setting << ": " << finished.output[0];
  }
}

// The energy of the default model has no lower bound for elements of such materials.
TEST(Program, CheckWarnsOfMaterialsThatFailUnderCompression) {
  const auto checked = [](const std::string& ratio, const std::string& model) {
    return run_duet({"check", tiny, "--set", "materials.jelly.poisson_ratio=" + ratio, "--set",
                     "materials.jelly.model=" + model});
  };
  const Finished warned = checked("-0.9", "neo_hookean");
  EXPECT_EQ(warned.status, 0) << warned.errors;
  ASSERT_EQ(warned.output.size(), 2U);
  EXPECT_TRUE(contains(warned.output[0], "material `jelly`: with a Poisson's ratio of -0.9"))
      << warned.output[0];
  EXPECT_EQ(checked("-0.4", "neo_hookean").output.size(), 1U);
  EXPECT_EQ(checked("-0.9", "st_venant_kirchhoff").output.size(), 1U);
}

TEST(Program, CheckWarnsOfBodiesThatAreParted) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "two.toml",
                       "[[rigid]]\nname = \"a\"\nshape = { sphere = 1 }\nmass = 1\n"
                       "[[rigid]]\nname = \"b\"\nshape = { sphere = 1 }\nmass = 1\nposition = [1.5, 0, 0]\n");
  const Finished warned = run_duet({"check", "two.toml"}, scratch.path());
  EXPECT_EQ(warned.status, 0) << warned.errors;
  ASSERT_EQ(warned.output.size(), 2U);
  EXPECT_TRUE(warned.output[0].starts_with("two.toml: warning: `a` and `b` overlap by 0.5 m"))
      << warned.output[0];
  EXPECT_EQ(warned.last_line(), "two.toml: ok, with 1 warning");
  const Finished refused =
      run_duet({"check", "two.toml", "--set", "solver.initial_overlap=\"refuse\""}, scratch.path());
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(refused.last_line(), "failed: 1 problem");
}

TEST(Program, ReferenceAndExplainPrintText) {
  const Finished reference = run_duet({"check", "--reference"});
  EXPECT_EQ(reference.status, 0);
  EXPECT_GT(reference.output.size(), 50U);
  const Finished explained = run_duet({"explain", tiny, "--without", "push_out"});
  EXPECT_EQ(explained.status, 0) << explained.errors;
  std::string text;
  for (const std::string& line : explained.output) text += line + '\n';
  EXPECT_TRUE(contains(text, "push_out")) << text;
  const Finished json = run_duet({"explain", tiny, "--json"});
  EXPECT_EQ(json.status, 0);
  text.clear();
  for (const std::string& line : json.output) text += line + '\n';
  EXPECT_TRUE(nlohmann::json::parse(text).is_object());
}

TEST(Program, OverlapsAreThoseOfTheScenesRun) {
  const ScratchFolder scratch;
  const std::string out = (scratch / "run").string();
  const std::string corners_only = "solver.face_samples=1";
  ASSERT_EQ(run_duet({"sim", tiny, "--out", out, "--frames", "12", "--quiet", "--set", corners_only}).status,
            0);
  const Finished text = run_duet({"overlaps", tiny, "--out", out, "--set", corners_only});
  EXPECT_EQ(text.status, 0) << text.errors;
  ASSERT_EQ(text.output.size(), 3U);
  EXPECT_EQ(text.output[0], "frame 12, surfaces looked at every 20 mm");
  EXPECT_EQ(text.output[1], "rigid bodies: none overlaps");
  const Finished json =
      run_duet({"overlaps", tiny, "--out", out, "--set", corners_only, "--json", "--spacing", "0.005"});
  ASSERT_EQ(json.output.size(), 1U) << json.errors;
  const auto found = nlohmann::json::parse(json.output[0]);
  // Between the corners of the cube's cells, which are 25 cm wide in the draft preset, the ball sinks into
  // the cube.
  EXPECT_EQ(found["deformable"]["guest"], "cube");
  EXPECT_EQ(found["deformable"]["host"], "ball");
  EXPECT_GT(found["deformable"]["depth"], 1e-3);
  const Finished other = run_duet({"overlaps", tiny, "--out", out, "--set", "rigid.ball.mass=3"});
  EXPECT_EQ(other.status, 2);
  EXPECT_TRUE(contains(other.errors, "no whole checkpoint of this scene")) << other.errors;
}

TEST(Program, FilesThatCannotBeWrittenHaveStatusFour) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "file", "precious");
  for (const std::string& out :
       {(scratch / "file").string(), scratch.path().string(), std::string("/proc/duet-test")}) {
    const Finished finished = run_duet({"sim", tiny, "--frames", "1", "--out", out});
    EXPECT_EQ(finished.status, 4) << out;
    EXPECT_TRUE(contains(finished.errors, out)) << finished.errors;
    EXPECT_TRUE(finished.last_line().starts_with("failed: ")) << finished.last_line();
  }
  EXPECT_EQ(io::read_file(scratch / "file"), "precious");
  EXPECT_EQ(run_duet({"render", scratch.path().string()}).status, 4);
}

TEST(Program, ScenesThatAreNoFilesAreRefusedAtOnce) {
  const ScratchFolder scratch;
  fs::create_directory(scratch / "folder.toml");
  ASSERT_EQ(::mkfifo((scratch / "pipe.toml").c_str(), 0600), 0);
  io::write_atomically(scratch / "mesh.toml",
                       "[[rigid]]\nname = \"a\"\nshape = { mesh = \"pipe.obj\" }\nmass = 1\n");
  ASSERT_EQ(::mkfifo((scratch / "pipe.obj").c_str(), 0600), 0);
  for (const auto& [scene, status] :
       {std::pair{"folder.toml", 2}, {"pipe.toml", 4}, {"/dev/zero", 4}, {"mesh.toml", 2}}) {
    const Finished finished = run_duet({"sim", scene, "--frames", "1"}, scratch.path());
    EXPECT_EQ(finished.status, status) << scene << ": " << finished.errors;
    EXPECT_FALSE(fs::exists(scratch / "out")) << scene;
  }
}

TEST(Program, HelpThatCannotBeWrittenHasStatusFour) {
  Program program({"-c", duet_program() + " --help >/dev/full"}, source_folder(), "/bin/sh");
  const Finished finished = finish(program);
  EXPECT_EQ(finished.status, 4);
  EXPECT_TRUE(contains(finished.errors, "standard output: cannot write: No space left")) << finished.errors;
}

// Files that are no libraries precede the real ones in the search path, as on a machine where these are
// missing or broken.
TEST(Program, WithoutOpenGlItSaysWhatToInstallAndStillSimulates) {
  const ScratchFolder scratch;
  for (const char* library : {"libOSMesa.so.8", "libOSMesa.so.6", "libEGL.so.1"})
    io::write_atomically(scratch / library, "");
  const Environment path("LD_LIBRARY_PATH", scratch.path().string());
  const Finished run = run_duet({"run", tiny, "--frames", "1", "--out", (scratch / "run").string()});
  EXPECT_EQ(run.status, 4);
  for (const char* part : {"apt install libosmesa6", "libegl1", "`duet sim` simulates without drawing"})
    EXPECT_TRUE(contains(run.errors, part)) << run.errors;
  EXPECT_TRUE(run.last_line().starts_with("failed: ")) << run.last_line();
  EXPECT_FALSE(fs::exists(scratch / "run/mesh"));
  const Finished sim = run_duet({"sim", tiny, "--frames", "1", "--out", (scratch / "run").string()});
  EXPECT_EQ(sim.status, 0) << sim.errors;
}

TEST(Program, WithoutFfmpegThePicturesAreThereAndANote) {
  const ScratchFolder scratch;
  const Environment path("PATH", scratch.path().string());
  const Finished run =
      run_duet({"run", tiny, "--frames", "1", "--quiet", "--out", (scratch / "run").string()});
  EXPECT_EQ(run.status, 0) << run.errors;
  EXPECT_TRUE(contains(run.last_line(), "no video: ffmpeg is not installed")) << run.last_line();
  EXPECT_TRUE(fs::exists(scratch / "run/image/0001.png"));
}

// When the disk fills up in the middle of a run, the program exits with status 4, keeps whole frames, and
// says how to go on.
TEST(Program, ADiskThatFillsUpKeepsTheFramesSoFar) {
  const ScratchFolder scratch;
  const io::RunDirectory run{scratch / "run"};
  ASSERT_EQ(run_duet({"sim", tiny, "--frames", "1", "--quiet", "--out", run.root.string()}).status, 0);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto stats_size = fs::file_size(run.stats());
  const auto largest = std::max({fs::file_size(run.mesh(1)), fs::file_size(run.level_set(1)),
                                 fs::file_size(run.checkpoint() / "0001.bin"), stats_size});
  // The statistics are the one file that grows: all others fit below the limit, and sooner or later a line of
  // the statistics does not.
  const rlimit limit{largest + 4 * stats_size, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  const Finished full =
      run_duet({"sim", tiny, "--frames", "100000", "--quiet", "--overwrite", "--out", run.root.string()});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(full.status, 4);
  EXPECT_TRUE(contains(full.errors, "stats.jsonl: cannot write: File too large")) << full.errors;
  EXPECT_TRUE(contains(full.last_line(), "--resume")) << full.last_line();
  const std::string stats = io::read_file(run.stats());
  EXPECT_EQ(stats.back(), '\n');
}

TEST(Program, ALogHasALineAFrameAndEndsWithTheOutcome) {
  const ScratchFolder scratch;
  const Finished plain = run_duet({"sim", tiny, "--frames", "3"}, scratch.path());
  ASSERT_EQ(plain.status, 0) << plain.errors;
  ASSERT_EQ(plain.output.size(), 6U) << "start, frames 0 to 3, outcome";
  EXPECT_TRUE(plain.output[4].starts_with("frame 3/3 ")) << plain.output[4];
  EXPECT_TRUE(plain.last_line().starts_with("done: ")) << plain.last_line();
  EXPECT_TRUE(fs::exists(scratch / "out/tiny/mesh/0003.obj"));
  const Finished quiet = run_duet({"sim", tiny, "--frames", "1", "--quiet", "--overwrite"}, scratch.path());
  EXPECT_EQ(quiet.output.size(), 1U);
  const Finished json = run_duet({"sim", tiny, "--frames", "1", "--json", "--overwrite"}, scratch.path());
  ASSERT_EQ(json.output.size(), 4U);
  for (const std::string& line : json.output) EXPECT_TRUE(nlohmann::json::parse(line).is_object()) << line;
  EXPECT_EQ(nlohmann::json::parse(json.last_line())["status"], 0);
}

// In `duet sim ... | head -1` the reader of the log closes the pipe, and the run goes on.
TEST(Program, AReaderThatGoesAwayDoesNotStopTheRun) {
  const ScratchFolder scratch;
  const io::RunDirectory run{scratch / "run"};
  Program program({"sim", tiny, "--out", run.root.string()});
  ASSERT_TRUE(program.line());
  program.close_output();
  EXPECT_EQ(program.wait(), 0);
  EXPECT_EQ(program.errors(), "");
  EXPECT_TRUE(fs::exists(run.mesh(40)));
}

}  // namespace
}  // namespace duet::test::program_test
