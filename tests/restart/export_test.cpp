// Tests of `duet export` through the program: what it writes of real runs, what it refuses, and what a
// failure leaves behind.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/restart/program.h"
#include "tests/restart/simulated_run.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "sim/base/files.h"
#include "sim/io/export/exported_run.h"

namespace duet::test::export_test {
namespace {

const std::vector<std::string> formats = {"transforms", "obj", "ply", "pc2", "mdd", "vtk", "vdb"};

class Export : public SimulatedRun {
 protected:
  Finished duet_export(const std::string& format, const std::vector<std::string>& more = {},
                       const char* how = "--quiet") const {
    std::vector<std::string> words = {"export", "run", "--to", format, how};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words, scratch.path());
  }
  // Checks that the export is refused with this status and message, and that it leaves no file behind.
  void refuse(int status, const std::string& format, const std::vector<std::string>& more,
              const std::string& said) const {
    const std::set<fs::path> before = files();
    const Finished refused = duet_export(format, more);
    EXPECT_EQ(refused.status, status) << format << " " << said << ": " << refused.last_line();
    EXPECT_TRUE(contains(refused.errors, said)) << said << ": " << refused.errors;
    EXPECT_TRUE(refused.last_line().starts_with("failed: ")) << refused.last_line();
    EXPECT_EQ(files(), before) << "nothing is left behind";
  }
  std::set<fs::path> files() const {
    std::set<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(scratch.path()))
      if (entry.is_regular_file()) found.insert(entry.path());
    return found;
  }
};

// Returns the rounding of positions in the OBJ files of a run: half of the last place of six decimals, or of
// 2^-24 of the extent, whichever is less (m).
double rounding_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  return 0.5 * std::min(1e-6, box.sizes().maxCoeff() * 0x1p-24) + 1e-12;
}

// The values of a run place bodies of every kind where its meshes have them.
TEST_F(Export, ValuesPlaceBodiesWhereTheirMeshesAre) {
  for (const char* scene : {tiny.c_str(), "hard/cloth", "hard/skin", "hard/soft_shapes", "hard/ropes",
                            "hard/shapes", "hard/kinematic", "maggot"}) {
    simulate(scene, {"--frames", "1", "--accuracy", "draft", "--set", "fps=48"});
    const io::ExportedRun exported(run, {});
    ASSERT_EQ(exported.frames().size(), 2U) << scene;
    for (const int frame : exported.frames()) {
      const std::vector<BodySurface> meshes = io::read_mesh(run, frame);
      const io::FrameValues values = exported.read(frame);
      ASSERT_EQ(meshes.size(), exported.bodies().size()) << scene;
      for (std::size_t i = 0; i < meshes.size(); ++i) {
        const io::ExportedBody& body = exported.bodies()[i];
        const Surface& mesh = meshes[i].surface;
        Surface placed = body.rest;
        io::place(body, values, placed);
        EXPECT_EQ(body.name, meshes[i].name);
        ASSERT_EQ(placed.positions.size(), mesh.positions.size());
        ASSERT_EQ(placed.normals.size(), mesh.normals.size());
        ASSERT_EQ(placed.triangles.size(), mesh.triangles.size());
        double farthest = 0;
        float normals = 0;
        for (std::size_t k = 0; k < mesh.positions.size(); ++k)
          farthest = std::max(farthest, (placed.positions[k] - mesh.positions[k]).cwiseAbs().maxCoeff());
        for (std::size_t k = 0; k < mesh.normals.size(); ++k)
          normals = std::max(normals, (placed.normals[k] - mesh.normals[k]).norm());
        EXPECT_LE(farthest, rounding_of(placed)) << scene << ", frame " << frame << ": " << body.name;
        EXPECT_LE(normals, 1e-4F) << scene << ", frame " << frame << ": " << body.name;
      }
    }
  }
}

// Before anything touches, the velocity at a frame equals the central difference of positions. The bound is
// 0.1 m/s at frames of 1/24 s, where bodies move at more than 0.3 m/s.
TEST_F(Export, VelocitiesAreThoseOfTheMotion) {
  for (const char* scene : {tiny.c_str(), "hard/cloth"}) {
    simulate(scene, {"--frames", "2"});
    const io::ExportedRun exported(run, {});
    const io::FrameValues before = exported.read(0), now = exported.read(1), after = exported.read(2);
    double fastest = 0;
    for (const io::ExportedBody& body : exported.bodies()) {
      Surface a = body.rest, b = body.rest;
      io::place(body, before, a);
      io::place(body, after, b);
      std::vector<Vec3f> v;
      io::velocities(body, now, v);
      for (std::size_t i = 0; i < v.size(); ++i) {
        const Vec3 difference = (b.positions[i] - a.positions[i]) / (after.time - before.time);
        EXPECT_LT((v[i].cast<double>() - difference).norm(), 0.1) << scene << " " << body.name << " " << i;
        fastest = std::max(fastest, difference.norm());
      }
    }
    EXPECT_GT(fastest, 0.3) << scene;
  }
}

TEST_F(Export, WritesEveryFormatAndSaysWhatAndWhere) {
  simulate(tiny, {"--frames", "3"});
  for (const std::string& format : formats) {
    const Finished done = duet_export(format);
    ASSERT_EQ(done.status, 0) << format << done.errors;
    EXPECT_TRUE(done.last_line().starts_with("done: 4 frames of 2 bodies, ")) << done.last_line();
    EXPECT_TRUE(contains(done.last_line(), "B, in run/export/" + format + ", ")) << done.last_line();
    const auto description =
        nlohmann::json::parse(io::read_file(run.root / "export" / format / "export.json"));
    EXPECT_EQ(description.at("format"), format);
    EXPECT_EQ(description.at("fps"), 24);
    EXPECT_EQ(description.at("last_frame"), 3);
    EXPECT_EQ(description.at("bodies").size(), 2U);
    EXPECT_EQ(description.at("looks").at(0).at("name"), "palette-1")
        << "the bodies have no look of their own";
    EXPECT_EQ(description.at("lights").at(0).at("name"), "key");
    EXPECT_EQ(description.at("camera").at("width"), 64);
  }
  const Finished said = duet_export("transforms", {"--overwrite"}, "--json");
  std::set<std::string> events;
  for (const std::string& line : said.output) events.insert(nlohmann::json::parse(line).at("event"));
  EXPECT_EQ(events, (std::set<std::string>{"start", "exported", "note", "outcome"}));
  EXPECT_EQ(run_duet({"verify", "run", "--quiet"}, scratch.path()).status, 0) << "an export is no damage";
}

TEST_F(Export, ChoosesBodiesAndFrames) {
  simulate(tiny, {"--frames", "6"});
  const auto description = [&](const char* folder) {
    return nlohmann::json::parse(io::read_file(scratch / folder / "export.json"));
  };
  const Finished some = duet_export("obj", {"--bodies", "b*", "--frames", "2:4", "--out", "some"});
  EXPECT_TRUE(some.last_line().starts_with("done: 3 frames of 1 body, ")) << some.last_line() << some.errors;
  EXPECT_EQ(description("some").at("bodies").at(0).at("name"), "ball");
  EXPECT_EQ(duet_export("obj", {"--frames", "5", "--out", "one"}).status, 0);
  EXPECT_EQ(description("one").at("first_frame"), 5);
  EXPECT_FALSE(fs::exists(scratch / "one/0004.obj"));
  const Finished scaled = duet_export("pc2", {"--up", "z", "--scale", "100", "--out", "scaled"});
  EXPECT_EQ(scaled.status, 0) << scaled.errors;
  EXPECT_EQ(description("scaled").at("units_per_meter"), 100);
  EXPECT_EQ(description("scaled").at("camera").at("position").at(1), -400);
  refuse(2, "obj", {"--bodies", "bal", "--out", "none"}, "did you mean `ball`?");
  refuse(2, "obj", {"--bodies", "q*", "--out", "none"}, "no body of the run has such a name");
  refuse(2, "obj", {"--frames", "7:9", "--out", "none"}, "it has frames 0 to 6");
  refuse(2, "transforms", {"--bodies", "cube", "--out", "none"}, "none of the bodies is rigid");
}

TEST_F(Export, NamesFramesThatAreNotThere) {
  simulate(tiny, {"--frames", "6"});
  for (const int frame : {2, 3, 5}) io::remove_file(run.values(frame));
  const Finished lacking = duet_export("vtk");
  EXPECT_EQ(lacking.status, 0) << lacking.errors;
  EXPECT_TRUE(lacking.last_line().starts_with("done: 4 frames of 2 bodies, ")) << lacking.last_line();
  EXPECT_TRUE(lacking.last_line().ends_with("; frames 2 to 3, 5 are not there")) << lacking.last_line();
  const Finished beyond = duet_export("vtk", {"--frames", "6:7", "--out", "beyond"});
  EXPECT_TRUE(beyond.last_line().ends_with("; frame 7 is not there")) << beyond.last_line();
}

TEST_F(Export, RefusesWhatItCannotDo) {
  simulate(tiny, {"--frames", "1"});
  refuse(2, "abc", {}, "Debian has no Alembic library");
  refuse(2, "obj", {"--voxel", "0.1"}, "only vdb has voxels");
  refuse(2, "vdb", {"--voxel", "1e-6"}, "or wider");
  refuse(2, "objj", {}, "did you mean `obj`?");
  for (const char* scale : {"0", "-1", "nan", "inf", "1e300", "x"})
    refuse(2, "obj", {"--scale", scale}, "--scale");
  refuse(2, "obj", {"--up", "x"}, "--up");
  refuse(2, "obj", {"--frames", "3:1"}, "A <= B");
  for (const std::string& format : formats)
    if (format != "vtk") refuse(2, format, {"--compress"}, format + " files are not compressed");
  for (const char* format : {"vtk", "usd"})
    EXPECT_EQ(duet_export(format, {"--compress"}).status, 0) << format;
  refuse(4, "vtk", {"--out", "/proc/duet-test"}, "cannot");
  const Finished nowhere = run_duet({"export", "nowhere", "--to", "obj"}, scratch.path());
  EXPECT_EQ(nowhere.status, 4);
  EXPECT_TRUE(contains(nowhere.errors, "nowhere: is no run directory")) << nowhere.errors;
}

TEST_F(Export, ReplacesOnlyExportsAndOnlyIfAsked) {
  simulate(tiny, {"--frames", "1"});
  ASSERT_EQ(duet_export("obj").status, 0);
  refuse(2, "obj", {}, "run/export/obj: is there already");
  io::write_atomically(run.root / "export/obj/0009.obj", "of before");
  EXPECT_EQ(duet_export("obj", {"--overwrite"}).status, 0);
  EXPECT_FALSE(fs::exists(run.root / "export/obj/0009.obj"));
  for (const char* folder : {"run", ".", "run/mesh", "run/values", "run/export"})
    refuse(2, "obj", {"--overwrite", "--out", folder}, "files that no export wrote");
  refuse(2, "obj", {"--overwrite", "--out", "run/scene.toml"}, "writes a folder, and there is a file");
  io::create_folder(scratch / "empty");
  EXPECT_EQ(duet_export("obj", {"--overwrite", "--out", "empty"}).status, 0);
}

TEST_F(Export, DamagedRunsAreRefused) {
  simulate(tiny, {"--frames", "2"});
  const std::string values = io::read_file(run.values(1));
  std::string other = values;
  other.back() ^= 1;
  io::write_atomically(run.values(1), other);
  for (const std::string& format : formats)
    refuse(4, format, {"--out", "none"}, "run/values/0001.npy: is damaged");
  io::write_atomically(run.values(1), values);
  io::write_atomically(run.scene(), io::read_file(run.scene()) + "\n# more\n");
  refuse(4, "obj", {"--out", "none"}, "run/scene.toml: is damaged");
  fs::remove(run.body_values());
  refuse(4, "obj", {"--out", "none"}, "run/values/bodies.npy: is missing");
}

// The limit on file sizes is reported like a full disk.
TEST_F(Export, AFullDiskLeavesNothing) {
  simulate(tiny, {"--frames", "40"});
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const std::string& format : formats) {
    const rlimit limit{format == "transforms" || format == "vdb" ? 4000U : 150'000U, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
    refuse(4, format, {}, "cannot write: File too large");
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_FALSE(fs::exists(run.root / "export" / format));
  }
}

// The program prints a line per frame into a pipe that nobody reads, so that the signal meets it at work.
TEST_F(Export, AnInterruptLeavesNothing) {
  simulate(tiny, {"--set", "frames=150"});
  for (const std::string& format : formats) {
    const std::set<fs::path> before = files();
    Program program({"export", run.root.string(), "--to", format, "--json"});
    program.line();
    program.line();
    program.signal(SIGINT);
    const Finished stopped = finish(program);
    EXPECT_EQ(stopped.status, 130) << format << stopped.last_line();
    EXPECT_TRUE(contains(stopped.last_line(), "nothing was written to")) << stopped.last_line();
    EXPECT_EQ(files(), before) << format;
  }
}

// The scene asks for exports, and the command line for others in their place.
TEST_F(Export, ScenesSayInWhichFormats) {
  const std::string formats_of_scene = R"(output.formats=["ply", "glb"])";
  const auto has = [&](const char* name) { return fs::exists(run.root / "export" / name); };
  simulate(tiny, {"--frames", "2", "--set", formats_of_scene});
  EXPECT_TRUE(has("ply/0002.ply") && has("tiny.glb") && !has("vtk"));
  simulate(tiny, {"--frames", "2", "--set", formats_of_scene, "--formats", "vtk"});
  EXPECT_TRUE(has("vtk/0002.vtp"));
  fs::remove_all(run.root / "export");
  simulate(tiny, {"--frames", "2", "--set", formats_of_scene, "--stats-only"});
  EXPECT_FALSE(has("ply"));
}

// A run that a program still writes is exported as far as it has come.
TEST_F(Export, ARunThatGrowsIsExportedAsItIs) {
  Program simulation({"sim", tiny, "--set", "frames=4000", "--out", run.root.string()});
  while (const auto line = simulation.line())
    if (line->starts_with("frame 3/")) break;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 20; ++k) simulation.line();
    const Finished done = duet_export("pc2", {"--overwrite"}, "--json");
    EXPECT_EQ(done.status, 0) << done.errors;
    const bool is_said = std::any_of(done.output.begin(), done.output.end(), [](const std::string& line) {
      return contains(line, "the run has come to frame") && contains(line, " of 4000");
    });
    EXPECT_TRUE(is_said);
  }
  simulation.signal(SIGKILL);
  finish(simulation);
}

// A killed program leaves its unfinished files under a temporary name. The next export of that name removes
// them.
TEST_F(Export, AKilledExportIsClearedAwayByTheNext) {
  simulate(tiny, {"--set", "frames=150"});
  const std::set<fs::path> before = files();
  Program program({"export", run.root.string(), "--to", "obj", "--json"});
  program.line();
  program.line();
  program.signal(SIGKILL);
  finish(program);
  EXPECT_NE(files(), before);
  EXPECT_FALSE(fs::exists(run.root / "export/obj"));
  refuse(2, "obj", {"--frames", "500"}, "it has frames");
  fs::remove_all(scratch / "out");
  ASSERT_EQ(duet_export("obj", {"--frames", "0"}).status, 0);
  EXPECT_EQ(files().size(), before.size() + 3);
}

// The commands of the documentation run, with fewer frames: the test takes the words after `build/duet` on
// the lines of the section.
TEST_F(Export, CommandsOfThePageRun) {
  const std::string page = io::read_file(source_folder() + "/tools/README.md");
  const std::size_t begin = page.find("\n## Take it to Blender"), end = page.find("\n## ", begin + 1);
  ASSERT_NE(begin, std::string::npos);
  std::istringstream lines(page.substr(begin, end - begin));
  int commands = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("build/duet ")) continue;
    line = duet_program() + line.substr(line.find(' ')).substr(0, line.find('#') - line.find(' '));
    if (contains(line, " sim ")) line += " --frames 2 --accuracy draft";
    Program program({"-c", line + " --quiet"}, scratch.path(), "/bin/sh");
    const Finished finished = finish(program);
    EXPECT_EQ(finished.status, 0) << line << finished.errors;
    ++commands;
  }
  EXPECT_EQ(commands, 9);
}

bool shell_says(const std::string& command) {
  Program program({"-c", command}, source_folder(), "/bin/sh");
  return finish(program).status == 0;
}

TEST_F(Export, NumPyReadsValuesInALine) {
  if (!shell_says("python3 -c 'import numpy'")) GTEST_SKIP() << "python3 has no numpy";
  simulate(tiny, {"--frames", "3"});
  const io::FrameValues values = io::ExportedRun(run, {}).read(3);
  Program program(
      {"-c", fmt::format("python3 -c 'import numpy\nf = numpy.load(\"{0}\")\nr = numpy.load(\"{1}\")\n"
                         "print(int(f[\"frame\"]), f[\"position\"][0, 1].hex(), "
                         "f[\"point\"].shape, r[\"corner\"].shape[1:])'",
                         run.values(3).string(), run.body_values().string())},
      source_folder(), "/bin/sh");
  const Finished read = finish(program);
  EXPECT_EQ(read.status, 0) << read.errors;
  std::istringstream words(read.last_line());
  std::string frame, height, rest;
  words >> frame >> height;
  std::getline(words, rest);
  EXPECT_EQ(frame, "3");
  EXPECT_EQ(std::strtod(height.c_str(), nullptr), values.rigid[0].pose.position.y());
  EXPECT_EQ(rest, " (26, 3) (3, 3)");
}

// `--to blend` runs the program `blender` of PATH with the script, the run and a file to save. One that fails
// or saves no Blender file leaves nothing behind, and what the format cannot carry is refused.
TEST_F(Export, ABlenderSceneIsMadeByBlender) {
  simulate(tiny, {"--frames", "2"});
  const fs::path folder = scratch / "programs";
  fs::create_directory(folder);
  const auto export_by = [&](const std::string& script) {
    std::ofstream(folder / "blender") << "#!/bin/sh\n" << script << '\n';
    fs::permissions(folder / "blender", fs::perms::owner_all);
    Program program({"-c", fmt::format("PATH='{}':$PATH '{}' export run --to blend --overwrite",
                                       folder.string(), duet_program())},
                    scratch.path(), "/bin/sh");
    return finish(program);
  };
  const fs::path made = run.root / "export" / "tiny.blend";
  for (const auto& [script, said] :
       {std::pair("echo no memory >&2; exit 3", "blender: failed with status 3: no memory"),
        std::pair("exit 0", "blender: failed with status 0")}) {
    const Finished failed = export_by(script);
    EXPECT_EQ(failed.status, 4);
    EXPECT_TRUE(contains(failed.errors, said)) << failed.errors;
    EXPECT_FALSE(fs::exists(made));
  }
  const Finished done = export_by(
      "for word; do case $before in --save) file=$word;; --python) script=$word;; --) run=$word;; esac; "
      "before=$word; done\n"
      "grep -q bl_info \"$script\" && test -e \"$run/manifest.json\" && test -e "
      "\"$run/export/blender/export.json\" && "
      "printf 'BLENDER-v304 %s' \"$run\" > \"$file\"");
  EXPECT_EQ(done.status, 0) << done.errors;
  EXPECT_EQ(io::read_file(made), "BLENDER-v304 " + fs::absolute(run.root).string());
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--frames", "1:2"}, {"--scale", "2"}, {"--up", "z"}, {"--bodies", "b*"}}) {
    const Finished refused = duet_export("blend", more);
    EXPECT_EQ(refused.status, 2) << more[0];
    EXPECT_TRUE(contains(refused.errors, "takes the whole run")) << refused.errors;
  }
}

// At every frame, the bodies that the Blender add-on imports are where the meshes of the run are.
TEST_F(Export, BlenderPlacesBodiesWhereTheirMeshesAre) {
  if (!shell_says("command -v blender")) GTEST_SKIP() << "blender is not installed";
  simulate(tiny, {"--frames", "10"});
  ASSERT_EQ(duet_export("vdb", {"--voxel", "0.03", "--up", "z", "--scale", "10"}).status, 0);
  Program program(
      {"-c", "blender -b --factory-startup --python-exit-code 1 --python tests/restart/blender_check.py -- " +
                 run.root.string()},
      source_folder(), "/bin/sh");
  const Finished imported = finish(program);
  EXPECT_EQ(imported.status, 0) << imported.errors;
  const bool compared =
      std::any_of(imported.output.begin(), imported.output.end(),
                  [](const std::string& line) { return line.starts_with("compared 11 frames of 2 bodies"); });
  EXPECT_TRUE(compared);
}

}  // namespace
}  // namespace duet::test::export_test
