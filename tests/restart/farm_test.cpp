// Tests of commands that several programs carry out on one run at the same time, and of the scripts of `duet
// farm`. tools/farm-test tries the engines Slurm and GNU parallel.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <map>
#include <sstream>

#include "tests/restart/program.h"
#include "tests/restart/simulated_run.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/types.h"
#include "sim/io/run_check.h"
#include "sim/io/run_claim.h"
#include "sim/io/run_journal.h"

namespace duet::test::farm_test {
namespace {

// Returns the bytes of all pictures of a run, by their names.
std::map<std::string, std::string> pictures(const fs::path& run) {
  std::map<std::string, std::string> found;
  for (const fs::path& file : io::files_in(run / "image"))
    found[file.filename().string()] = io::read_file(file);
  return found;
}

// Carries out a script of a farm.
Finished run_script(const fs::path& script, const std::vector<std::string>& words = {}) {
  std::vector<std::string> arguments = {script.string()};
  arguments.insert(arguments.end(), words.begin(), words.end());
  Program program(arguments, source_folder(), "/bin/bash");
  return finish(program);
}

// Returns a row of a table without quoted line ends; row 0 is its head.
std::string row(const std::string& table, int number) {
  std::size_t begin = 0;
  for (int i = 0; i < number; ++i) begin = table.find('\n', begin) + 1;
  return table.substr(begin, table.find('\n', begin) - begin);
}

class Farm : public SimulatedRun {
 protected:
  // The folder of a run, whose name needs quotes, and that of its farm.
  const fs::path out = scratch / "it's \"a\" $HOME of 100% & more";
  const fs::path folder = out.string() + ".farm";

  // Calls duet farm for the small scene and `out`.
  Finished farm(std::vector<std::string> more, const std::string& scene = tiny) const {
    std::vector<std::string> words = {"farm", scene, "--out", out.string(), "--threads", "1"};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words);
  }
  Finished status() const { return run_duet({"farm", "--status", out.string()}); }
};

TEST_F(Farm, MissingPicturesAreDrawnAndNoOthers) {
  simulate(tiny, {"--frames", "3"});
  ASSERT_EQ(run_duet({"render", run.root.string(), "--missing", "--quiet"}).status, 0);
  const auto whole = pictures(run.root);
  ASSERT_EQ(whole.size(), 4U);
  EXPECT_FALSE(fs::exists(run.root / "tiny.mp4"));
  io::write_atomically(run.image(1), whole.at("0001.png").substr(0, 100));
  io::remove_file(run.image(2));
  const Finished again = run_duet({"render", run.root.string(), "--frames", "0:2", "--missing", "--quiet"});
  EXPECT_TRUE(contains(again.last_line(), "2 pictures in ")) << again.last_line();
  EXPECT_TRUE(contains(again.last_line(), "(1 were there)")) << again.last_line();
  EXPECT_EQ(pictures(run.root), whole);
  EXPECT_EQ(run_duet({"verify", run.root.string()}).status, 0);
}

// Frames 4 and later are not there: that is no fault, but with --wait unfinished work.
TEST_F(Farm, FramesThatAreNotThereYetAreLeft) {
  simulate(tiny, {"--frames", "3"});
  const std::vector<std::string> words = {"render",  run.root.string(), "--missing",
                                          "--quiet", "--frames",        "2:3"};
  EXPECT_EQ(run_duet(words).status, 0);
  ASSERT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "6", "--resume", "--stop-after",
                      "1e-6", "--quiet"})
                .status,
            75);
  const Finished late =
      run_duet({"render", run.root.string(), "--missing", "--frames", "4:6", "--wait", "0.1", "--quiet"});
  EXPECT_EQ(late.status, 75);
  EXPECT_TRUE(contains(late.last_line(), "1 picture in ")) << late.last_line();
  EXPECT_EQ(run_duet({"render", run.root.string(), "--wait", "5"}).status, 2) << "--wait needs --missing";
}

// Two programs draw while a third one simulates, all from the start.
TEST_F(Farm, DrawsWhileTheSimulationGoesOn) {
  Program first({"render", out.string(), "--missing", "--wait", "60", "--frames", "0:7", "--quiet"});
  Program second({"render", out.string(), "--missing", "--wait", "60", "--frames", "5:12", "--quiet"});
  ASSERT_EQ(run_duet({"sim", tiny, "--out", out.string(), "--frames", "12", "--quiet"}).status, 0);
  for (Program* program : {&first, &second}) {
    const Finished finished = finish(*program);
    EXPECT_EQ(finished.status, 0) << finished.errors;
  }
  ASSERT_EQ(run_duet({"run", tiny, "--out", run.root.string(), "--frames", "12", "--quiet"}).status, 0);
  EXPECT_EQ(pictures(out), pictures(run.root));
  EXPECT_EQ(run_duet({"encode", out.string()}).status, 0);
  const io::RunCheck check = io::check_run({out});
  EXPECT_TRUE(check.faults.empty() && check.notes.empty());
  EXPECT_FALSE(fs::exists(out / "journal")) << "parts of the journal are merged";
  EXPECT_FALSE(fs::exists(out / "claim"));
}

TEST_F(Farm, TheVideoIsEncodedOnceForItsPictures) {
  ASSERT_EQ(run_duet({"run", tiny, "--out", run.root.string(), "--frames", "2", "--quiet"}).status, 0);
  const auto encode = [&] { return run_duet({"encode", run.root.string()}).last_line(); };
  EXPECT_TRUE(contains(encode(), "is there, of the present pictures"));
  io::write_atomically(run.root / "tiny.mp4", "no video");
  EXPECT_FALSE(contains(encode(), "is there"));
  EXPECT_TRUE(contains(encode(), "is there"));
  run_duet({"render", run.root.string(), "--frames", "1", "--set", "render.exposure=2", "--quiet"});
  EXPECT_FALSE(contains(encode(), "is there")) << "a picture is another one";
  EXPECT_EQ(run_duet({"verify", run.root.string()}).status, 0);
}

TEST_F(Farm, ASecondSimulationNamesTheFirstAndWaits) {
  Program first({"sim", tiny, "--out", run.root.string(), "--json"});
  while (const auto line = first.line())
    if (contains(*line, "\"frame\"")) break;
  const Finished second = run_duet({"sim", tiny, "--out", run.root.string(), "--resume"});
  EXPECT_EQ(second.status, 4);
  EXPECT_TRUE(contains(second.errors, "another program writes to this folder: duet sim, process "))
      << second.errors;
  first.signal(SIGKILL);
  first.wait();
  EXPECT_TRUE(fs::exists(run.root / "claim"));
  EXPECT_EQ(
      run_duet({"sim", tiny, "--out", run.root.string(), "--resume", "--frames", "9", "--quiet"}).status, 0)
      << "the claim of a killed program is known to be stale";
  EXPECT_FALSE(fs::exists(run.root / "claim"));
}

TEST_F(Farm, LocalTasksMakeThePicturesOfOneRunAndNothingTwice) {
  ASSERT_EQ(run_duet({"run", tiny, "--out", run.root.string(), "--frames", "6", "--quiet"}).status, 0);
  const Finished farmed = farm({"--engine", "local", "--tasks", "3", "--frames", "6", "--submit"});
  EXPECT_EQ(farmed.status, 0) << farmed.errors << farmed.last_line();
  EXPECT_EQ(pictures(out), pictures(run.root));
  EXPECT_TRUE(fs::exists(out / "tiny.mp4"));
  EXPECT_TRUE(fs::exists(out / "report/report.html"));
  const auto drawn = fs::last_write_time(out / "image/0003.png"),
             mesh = fs::last_write_time(out / "mesh/0003.obj");
  EXPECT_EQ(run_script(folder / "draw.sh", {"2"}).status, 0);
  EXPECT_EQ(run_script(folder / "simulate.sh", {"1"}).status, 0);
  EXPECT_EQ(fs::last_write_time(out / "image/0003.png"), drawn);
  EXPECT_EQ(fs::last_write_time(out / "mesh/0003.obj"), mesh);
  EXPECT_TRUE(contains(status().last_line(), "1 of 1 runs are simulated and drawn")) << status().last_line();
}

// Of two variations one fails: it is named with the node and the reason, and the other one goes on.
TEST_F(Farm, VariationsAreCollectedAndFailuresNamed) {
  const Finished farmed = farm({"--engine", "local", "--frames", "2", "--submit", "--vary",
                                "rigid.ball.position=[0, 1.5, 0]", "--vary", "solver.max_substeps=1,100000"});
  EXPECT_EQ(farmed.status, 3) << farmed.errors;
  EXPECT_TRUE(contains(farmed.last_line(), "1 of 2 runs are simulated and drawn, 1 task failed; results in " +
                                               (folder / "results.html").string()))
      << farmed.last_line();
  const auto named = std::count_if(farmed.output.begin(), farmed.output.end(), [](const std::string& line) {
    return line.starts_with("failed: simulate-") && contains(line, "status 3: ") &&
           contains(line, "max_substeps");
  });
  EXPECT_EQ(named, 1);
  const std::string table = io::read_file(folder / "results.csv");
  EXPECT_TRUE(table.starts_with("run,folder,rigid.ball.position,solver.max_substeps,state,error,frames,"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
  EXPECT_TRUE(contains(table, "\"[0, 1.5, 0]\",100000,done,,2,")) << table;
  EXPECT_TRUE(contains(table, "\"[0, 1.5, 0]\",1,failed,")) << table;
  EXPECT_TRUE(io::holds_bytes(folder / "sheet.png"));
  EXPECT_TRUE(contains(io::read_file(folder / "results.html"), "kinetic energy at the end (J)"));
}

// Returns the numbers of a body in a row of bodies.csv; NaN where a field is empty.
std::vector<double> numbers_of(const std::string& line, const std::string& body) {
  std::vector<double> numbers;
  const std::size_t at = line.find("," + body + ",");
  if (at == std::string::npos) return numbers;
  std::istringstream fields(line.substr(at + body.size() + 2) + ",");
  for (std::string field; std::getline(fields, field, ',');)
    numbers.push_back(field.empty() ? std::numeric_limits<double>::quiet_NaN() : std::stod(field));
  return numbers;
}

// The ball of the first run is thrown up and falls back, that of the second one is thrown sideways: both move
// as the formulas of a throw say. The cube stands on the ground.
TEST_F(Farm, TheTableOfBodiesSaysWhereTheyCame) {
  const std::vector<Vec3> thrown = {{0, 0.8, 0}, {3, 0, 0}};
  const Finished farmed = farm({"--engine", "local", "--frames", "4", "--submit", "--vary",
                                "rigid.ball.velocity=[0, 0.8, 0],[3, 0, 0]"});
  ASSERT_EQ(farmed.status, 0) << farmed.errors;
  const std::string table = io::read_file(folder / "bodies.csv");
  EXPECT_EQ(row(table, 0),
            "run,rigid.ball.velocity,frames,body,kind,x,y,z,moved,travelled,speed,top_speed,spin");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5) << table;
  for (int number = 0; number < 2; ++number) {
    const auto place = [&](int frame) -> Vec3 {
      const double t = frame / 24.0;
      return Vec3(0.05, 1, 0) + t * thrown[static_cast<std::size_t>(number)] -
             9.8 * t * t / 2 * Vec3::UnitY();
    };
    const auto velocity = [&](int frame) -> Vec3 {
      return thrown[static_cast<std::size_t>(number)] - 9.8 * frame / 24.0 * Vec3::UnitY();
    };
    double path = 0, fastest = 0;
    for (int frame = 1; frame <= 4; ++frame) path += (place(frame) - place(frame - 1)).norm();
    for (int frame = 0; frame <= 4; ++frame) fastest = std::max(fastest, velocity(frame).norm());
    const std::vector<double> expected = {
        place(4).x(), place(4).y(),       place(4).z(), (place(4) - place(0)).norm(),
        path,         velocity(4).norm(), fastest,      0};
    const std::vector<double> ball = numbers_of(row(table, 2 * number + 1), "ball,rigid"),
                              cube = numbers_of(row(table, 2 * number + 2), "cube,deformable");
    ASSERT_EQ(ball.size(), expected.size()) << table;
    for (std::size_t i = 0; i < ball.size(); ++i)
      EXPECT_NEAR(ball[i], expected[i], 1e-6) << number << " " << i;
    ASSERT_EQ(cube.size(), expected.size()) << table;
    EXPECT_NEAR(cube[1], 0.25, 0.01);
    EXPECT_LT(cube[4], 0.03) << "its path";
    EXPECT_TRUE(std::isnan(cube[7])) << "a deformable body has no spin";
  }
  const std::string page = io::read_file(folder / "results.html");
  for (const char* text : {"ball: path (m)", "cube: place at the end (m)", "largest speed (m/s)"})
    EXPECT_TRUE(contains(page, text)) << text;
  io::remove_file(folder / "runs/0002/values/0003.npy");
  ASSERT_EQ(run_duet({"farm", "--collect", out.string()}).status, 0);
  EXPECT_EQ(row(io::read_file(folder / "bodies.csv"), 3), "") << "the motion of the second run is not whole";
  EXPECT_TRUE(contains(io::read_file(folder / "results.html"), "Run 2: ")) << "the page says why";
}

// The second run has another value than before: its frames are removed, and start.sh simulates it anew.
TEST_F(Farm, RunsOfOtherValuesAreReplaced) {
  const auto vary = [&](const char* word, const std::string& heights) {
    return farm({"--engine", "local", "--frames", "2", word, "--vary", "rigid.ball.position=" + heights});
  };
  ASSERT_EQ(vary("--submit", "[0, 1.5, 0],[0, 1.6, 0]").status, 0);
  const auto first = fs::last_write_time(folder / "runs/0001/mesh/0002.obj");
  const std::string before = io::read_file(folder / "results.csv");
  EXPECT_EQ(vary("--quiet", "[0, 1.5, 0],[0, 1.7, 0]").status, 2) << "scripts are replaced by --overwrite";
  const Finished replaced = vary("--overwrite", "[0, 1.5, 0],[0, 1.7, 0]");
  EXPECT_EQ(replaced.status, 0) << replaced.errors;
  EXPECT_FALSE(fs::exists(folder / "runs/0002/mesh/0002.obj"));
  const Finished half = status();
  EXPECT_EQ(half.status, 75);
  EXPECT_TRUE(contains(half.last_line(), "1 of 2 runs are simulated and drawn")) << half.last_line();
  ASSERT_EQ(run_duet({"farm", "--collect", out.string()}).status, 0);
  EXPECT_TRUE(contains(row(io::read_file(folder / "results.csv"), 2), "\"[0, 1.7, 0]\",unfinished,,-1,"));
  const Finished all = run_script(folder / "start.sh");
  EXPECT_EQ(all.status, 0) << all.errors;
  EXPECT_EQ(fs::last_write_time(folder / "runs/0001/mesh/0002.obj"), first);
  const std::string after = io::read_file(folder / "results.csv");
  const auto hash = [&](const std::string& text) { return text.substr(text.rfind(',')); };
  EXPECT_EQ(row(after, 1), row(before, 1));
  EXPECT_TRUE(contains(row(after, 2), "[0, 1.7, 0]")) << after;
  EXPECT_NE(hash(row(after, 2)), hash(row(before, 2)));
}

TEST_F(Farm, RunsOfOtherSettingsAreRefusedAndNotCounted) {
  const auto simulate_other = [&](const char* word) {
    return run_duet({"sim", tiny, "--out", out.string(), "--frames", "2", "--set",
                     "rigid.ball.position=[0, 1.7, 0]", word, "--quiet"});
  };
  ASSERT_EQ(simulate_other("--overwrite").status, 0);
  const Finished refused = farm({"--engine", "local", "--frames", "2"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_TRUE(contains(refused.errors, "another scene or other settings")) << refused.errors;
  EXPECT_TRUE(contains(refused.errors, "give --overwrite")) << refused.errors;
  EXPECT_FALSE(fs::exists(folder));
  EXPECT_TRUE(fs::exists(out / "mesh/0002.obj"));
  ASSERT_EQ(farm({"--engine", "local", "--frames", "2", "--overwrite", "--submit"}).status, 0);
  EXPECT_EQ(status().status, 0);
  ASSERT_EQ(simulate_other("--overwrite").status, 0);
  const Finished other = status();
  EXPECT_EQ(other.status, 75);
  EXPECT_TRUE(contains(other.output.front(), "another scene or other settings")) << other.output.front();
  EXPECT_TRUE(contains(other.last_line(), "0 of 1 runs")) << other.last_line();
}

// A run that is done to frame 2 is not done when the farm asks for frame 4.
TEST_F(Farm, ALaterLastFrameIsLeft) {
  ASSERT_EQ(farm({"--engine", "local", "--frames", "2", "--submit"}).status, 0);
  ASSERT_EQ(farm({"--engine", "local", "--frames", "4", "--overwrite"}).status, 0);
  const Finished half = status();
  EXPECT_EQ(half.status, 75) << half.last_line();
  EXPECT_TRUE(contains(half.output.front(), "frame 2 of 4 simulated, 3 of 5")) << half.output.front();
  EXPECT_EQ(run_script(folder / "start.sh").status, 0);
  EXPECT_EQ(status().status, 0);
}

TEST_F(Farm, StatusSaysHowFarARunIs) {
  ASSERT_EQ(farm({"--engine", "slurm", "--frames", "5"}).status, 0);
  EXPECT_EQ(status().status, 75);
  ASSERT_EQ(run_duet({"run", tiny, "--out", out.string(), "--frames", "5", "--stop-after", "1e-6", "--quiet"})
                .status,
            75);
  const Finished half = status();
  EXPECT_EQ(half.status, 75);
  EXPECT_TRUE(contains(half.output.front(), ": frame 1 of 5 simulated, ")) << half.output.front();
  EXPECT_TRUE(contains(half.output.front(), " left")) << half.output.front();
  const auto object =
      nlohmann::json::parse(run_duet({"farm", "--status", folder.string(), "--json"}).output.front());
  EXPECT_EQ(object["runs"][0]["simulated"], 1);
  EXPECT_EQ(object["runs"][0]["last_frame"], 5);
}

// The farm of a scene file is found by the file, by the name in out/, and by its folders.
TEST_F(Farm, IsFoundByAllNamesOfItsScene) {
  const fs::path mine = scratch / "mine";
  io::create_folder(mine / "shots");
  io::write_atomically(mine / "shots/ball.toml", io::read_file(tiny));
  const auto call = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "farm");
    return run_duet(words, mine);
  };
  ASSERT_EQ(call({"shots/ball.toml", "--engine", "local", "--frames", "2", "--quiet"}).status, 0);
  ASSERT_EQ(call({"shots/ball.toml", "--engine", "local", "--frames", "3", "--out", "elsewhere/"}).status, 0);
  for (const std::string name : {"shots/ball.toml", "ball", "out/ball", "out/ball.farm", "out/ball/"}) {
    const Finished found = call({"--status", name});
    EXPECT_EQ(found.status, 75) << name << found.errors;
    EXPECT_TRUE(contains(found.output.front(), "frame 0 of 2 simulated")) << found.output.front();
  }
  const Finished other = call({"--status", "shots/ball.toml", "--out", "elsewhere"});
  EXPECT_TRUE(contains(other.output.front(), "frame 0 of 3 simulated")) << other.errors;
}

// A task that is killed leaves "running"; on the same machine it is known to be lost.
TEST_F(Farm, TasksThatWereKilledAreNamed) {
  ASSERT_EQ(farm({"--engine", "local", "--frames", "5"}).status, 0);
  Program script({(folder / "simulate.sh").string(), "1"}, source_folder(), "/bin/bash");
  for (int i = 0; i < 1000 && !fs::exists(folder / "logs/simulate-1.state"); ++i) ::usleep(10'000);
  script.signal(SIGKILL);
  script.wait();
  const Finished lost = status();
  EXPECT_EQ(lost.status, 3);
  EXPECT_TRUE(contains(lost.output[1], "failed: simulate-1 on ")) << lost.output[1];
  EXPECT_TRUE(contains(lost.output[1], "status lost: it was killed")) << lost.output[1];
}

TEST_F(Farm, AStudyRunsItsPointsAsTasks) {
  io::write_atomically(
      scratch / "study.toml",
      "title = \"Substeps\"\nabout = \"Cost\"\nscene = \"" + tiny +
          "\"\nframes = 2\n[[measures]]\nname = \"penetration\"\nkind = \"penetration\"\n[[knobs]]\n"
          "name = \"cfl\"\nkey = \"solver.cfl\"\nvalues = [0.4, 0.2]\n");
  const Finished farmed = farm({"--engine", "local", "--submit"}, (scratch / "study.toml").string());
  EXPECT_EQ(farmed.status, 0) << farmed.errors;
  EXPECT_TRUE(contains(farmed.last_line(), "3 of 3 runs have a result")) << farmed.last_line();
  EXPECT_TRUE(fs::exists(out / "report.html"));
  EXPECT_TRUE(contains(io::read_file(folder / "point.sh"), "--point"));
  std::string other = io::read_file(scratch / "study.toml");
  other.replace(other.find("0.2]"), 4, "0.1]");
  io::write_atomically(scratch / "study.toml", other);
  EXPECT_EQ(farm({"--engine", "local", "--overwrite"}, (scratch / "study.toml").string()).status, 0);
  EXPECT_EQ(status().last_line(), "unfinished: 2 of 3 runs have a result") << "results of other values";
  EXPECT_EQ(run_duet({"study", (scratch / "study.toml").string(), "--out", out.string(), "--untimed",
                      "--point", "4"})
                .status,
            2);
}

// Scripts of every engine are bash, also with values that need quotes. tools/farm-test has ShellCheck look at
// them.
TEST_F(Farm, ScriptsOfAllEnginesAreBash) {
  for (const char* engine : {"slurm", "parallel", "local"}) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{},
          {"--vary", "title=\"it's, and $\",'b'", "--vary", "rigid.ball.position=[0, 1, 0],[0, 1.5, 0]"}}) {
      std::vector<std::string> words = {"--engine", engine, "--overwrite", "--sbatch=--comment=it's"};
      words.insert(words.end(), more.begin(), more.end());
      ASSERT_EQ(farm(words).status, 0) << engine;
      const auto runs = nlohmann::json::parse(io::read_file(folder / "farm.json"))["runs"];
      EXPECT_EQ(runs.size(), more.empty() ? 1U : 4U) << "commas in brackets and quotes belong to values";
      for (const fs::path& file : io::files_in(folder)) {
        if (file.extension() != ".sh") continue;
        Program program({"-n", file.string()}, source_folder(), "/bin/bash");
        const Finished checked = finish(program);
        EXPECT_TRUE(checked.status == 0 && checked.errors.empty()) << engine << file << checked.errors;
      }
    }
  }
}

TEST_F(Farm, BadInputIsOneSentenceWithARemedy) {
  const auto expect = [&](const Finished& finished, int status, const std::string& said) {
    EXPECT_EQ(finished.status, status) << said;
    EXPECT_TRUE(contains(finished.errors, said)) << finished.errors;
    EXPECT_FALSE(fs::exists(folder));
  };
  expect(farm({}), 2, "--engine is required");
  expect(farm({"--engine", "pbs"}), 2, "--engine");
  expect(farm({"--engine", "local", "--vary", "rigid.ball.masss=1,2"}), 2, "masss");
  expect(farm({"--engine", "local", "--vary", "rigid.ball.mass"}), 2, "write --vary key=a,b,c");
  expect(farm({"--engine", "local", "--vary", "rigid.ball.mass=1,,2"}), 2, "a value is missing");
  expect(farm({"--engine", "local", "--seeds", "3"}), 2, "vary another key");
  expect(farm({"--engine", "local"}, "no_such_scene"), 2, "no such scene");
  expect(run_duet({"farm", "--status", out.string()}), 4, "`duet farm SCENE --engine ENGINE` writes one");
  io::create_folder(folder);
  io::write_atomically(folder / "thesis.txt", "years of work");
  const Finished refused = farm({"--engine", "local"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_TRUE(contains(refused.errors, "holds other files")) << refused.errors;
  EXPECT_EQ(io::files_in(folder).size(), 1U);
}

TEST_F(Farm, EarlierScriptsAreReplacedOnlyWhenAsked) {
  ASSERT_EQ(farm({"--engine", "local"}).status, 0);
  const Finished again = farm({"--engine", "slurm"});
  EXPECT_EQ(again.status, 2);
  EXPECT_TRUE(contains(again.errors, "give --overwrite")) << again.errors;
  EXPECT_FALSE(contains(io::read_file(folder / "start.sh"), "sbatch"));
  EXPECT_EQ(farm({"--engine", "slurm", "--overwrite"}).status, 0);
  EXPECT_TRUE(contains(io::read_file(folder / "start.sh"), "sbatch"));
}

}  // namespace
}  // namespace duet::test::farm_test
