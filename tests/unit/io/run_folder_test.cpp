#include "sim/io/run_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/run_journal.h"

namespace duet::io::run_folder_test {
namespace {

Manifest manifest() {
  Manifest result;
  result.title = "Stack \"2\"";
  result.scene = "scenes/stack.toml";
  result.command = "duet run stack --set 'looks.silver.color=[1, 1, 1]'";
  result.origin = {"0.1.0", "abc", "g++ 12.2.0", "x86-64-v3", 7, "a machine"};
  result.earlier = {{2, {"0.0.9", "def", "clang++ 14.0.6", "x86-64", 6, "another machine"}}};
  result.fps = 23.976;
  result.frames = 7;
  const Eigen::AlignedBox3d box(Vec3(0.1, -1.0 / 3, 1e-9), Vec3(0.2, 1e5, 2));
  result.bodies = {{"ball", "rigid", "silver", "", 100, 196, box},
                   {"soft", "deformable", "orange", "rubber", 8, 12}};
  return result;
}

TEST(RunFolder, ManifestRoundTrip) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  write_manifest(run, manifest());
  const Manifest read = read_manifest(run), expected = manifest();
  EXPECT_EQ(read.title, expected.title);
  EXPECT_EQ(read.scene, expected.scene);
  EXPECT_EQ(read.command, expected.command);
  EXPECT_EQ(read.origin, expected.origin);
  EXPECT_EQ(read.earlier, expected.earlier);
  EXPECT_EQ(read.fps, expected.fps);
  EXPECT_EQ(read.frames, expected.frames);
  EXPECT_EQ(read.units, expected.units);
  ASSERT_EQ(read.bodies.size(), 2U);
  EXPECT_EQ(read.bodies[0].name, "ball");
  EXPECT_EQ(read.bodies[1].kind, "deformable");
  EXPECT_EQ(read.bodies[1].material, "rubber");
  EXPECT_EQ(read.bodies[0].vertices, 100);
  EXPECT_EQ(read.bodies[0].triangles, 196);
  ASSERT_TRUE(read.bodies[0].box.has_value());
  EXPECT_EQ(read.bodies[0].box->min(), expected.bodies[0].box->min());
  EXPECT_EQ(read.bodies[0].box->max(), expected.bodies[0].box->max());
  EXPECT_FALSE(read.bodies[1].box.has_value());
}

// Runs of programs that did not yet write compiler, variant and numerics can still be drawn, resumed and
// replaced.
TEST(RunFolder, AManifestWithoutVariantIsRead) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  write_atomically(run.manifest(), R"({"title": "t", "scene": "s", "command": "c", "version": "0.1.0",
      "git_commit": "abc", "machine": "m", "fps": 24, "frames": 3, "units": "u", "bodies": []})");
  const Manifest read = read_manifest(run);
  EXPECT_EQ(read.origin, (Origin{"0.1.0", "abc", "", "", 0, "m"}));
  EXPECT_TRUE(read.earlier.empty());
  EXPECT_EQ(program_text(read.origin), "duet 0.1.0 (abc)");
  EXPECT_EQ(program_text(manifest().origin), "duet 0.1.0 (abc), g++ 12.2.0, x86-64-v3");
}

TEST(RunFolder, EarlierFramesKeepTheirOrigin) {
  const Origin a{"1", "a", "g++", "v4", 1, "m"}, b{"1", "a", "g++", "v3", 1, "n"};
  Manifest run;
  run.origin = a;
  EXPECT_TRUE(earlier_frames(run, 9, a).empty()) << "one program and machine";
  run.earlier = earlier_frames(run, 9, b);
  EXPECT_EQ(run.earlier, (std::vector<EarlierFrames>{{9, a}}));
  run.origin = b;
  EXPECT_EQ(earlier_frames(run, 12, b), run.earlier);
  EXPECT_EQ(earlier_frames(run, 12, a), (std::vector<EarlierFrames>{{9, a}, {12, b}}));
  // Checkpoints were lost, so that frames of b, and some of a, are computed again by the program of the last
  // argument.
  EXPECT_EQ(earlier_frames(run, 8, b), (std::vector<EarlierFrames>{{8, a}}));
  EXPECT_TRUE(earlier_frames(run, 8, a).empty());
}

TEST(RunFolder, AManifestThatIsNoneIsAFileError) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  EXPECT_THROW(read_manifest(run), FileError);
  for (const char* text : {"", "{", "[]", "3", "{}", R"({"title": 3})"}) {
    write_atomically(run.manifest(), text);
    EXPECT_THROW(read_manifest(run), FileError) << text;
  }
}

// Counts that no run can have are refused. The reader would loop over them, or they would become negative
// when narrowed.
TEST(RunFolder, AManifestOfImpossibleNumbersIsAFileError) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  write_manifest(run, manifest());
  const nlohmann::json whole = nlohmann::json::parse(read_file(run.manifest()));
  const std::vector<std::string> frames = {
      "2147483647", "4294967296", "18446744073709551615", "1e300", "-1", "7.5", R"("7")", "null"};
  const std::vector<std::string> elements = {"4294967296", "18446744073709551615", "1e300", "-1", "7.5"};
  for (const auto& [place, impossible] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"/frames", frames},
           {"/earlier/0/last_frame", frames},
           {"/bodies/0/vertices", elements},
           {"/bodies/1/triangles", elements},
           {"/numerics", {"4294967296", "-1", "7.5", R"("7")"}},
           {"/earlier/0/numerics", {"4294967296", "-1"}},
           {"/fps", {"0", "-24", "1e-9", "1e300", R"("24")", "null"}}})
    for (const std::string& value : impossible) {
      nlohmann::json forged = whole;
      const nlohmann::json::json_pointer pointer(place);
      forged[pointer] = nlohmann::json::parse(value);
      write_atomically(run.manifest(), forged.dump());
      try {
        read_manifest(run);
        ADD_FAILURE() << place << " = " << value << " was accepted";
      } catch (const FileError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("manifest.json"), std::string::npos) << text;
        EXPECT_NE(text.find('`' + pointer.back() + '`'), std::string::npos) << text;
      }
    }
}

TEST(RunFolder, FileNamesHaveFourDigitsAndGrow) {
  const RunDirectory run{"out/stack"};
  EXPECT_EQ(run.mesh(7), fs::path("out/stack/mesh/0007.obj"));
  EXPECT_EQ(run.level_set(123), fs::path("out/stack/levelset/0123.vdb"));
  EXPECT_EQ(run.image(12345), fs::path("out/stack/image/12345.png"));
}

// A folder with files that are not of a run is refused, so that a mistyped --out loses nobody's files.
TEST(RunFolder, AFolderWithOtherFilesIsRefused) {
  const ScratchFolder scratch;
  write_atomically(scratch / "thesis.txt", "years of work");
  EXPECT_THROW(RunLock{RunDirectory{scratch.path()}}, FileError);
  write_atomically(scratch / "manifest.json", R"({"name": "somebody else's manifest"})");
  EXPECT_THROW(RunLock{RunDirectory{scratch.path()}}, FileError);
  EXPECT_EQ(read_file(scratch / "thesis.txt"), "years of work");
  EXPECT_THROW(RunLock{RunDirectory{scratch / "thesis.txt"}}, FileError);
}

// A program writes the first line of the journal before the manifest. A folder with a journal alone is thus
// what a program killed early left, and may be used again.
TEST(RunFolder, AFolderWithAJournalAloneIsOfAKilledRun) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch / "run"};
  create_folder(run.root);
  write_atomically(journal_path(run.root), "{\"journal\":1,\"first_frame\":0}\n");
  EXPECT_NO_THROW(RunLock{run});
  write_atomically(run.root / "manifest.json.tmp4711-0", "half a man");
  EXPECT_NO_THROW(RunLock{run});
  for (const char* name : {"mine.txt", "mine.tmpl", "mine.tmp"}) {
    write_atomically(run.root / name, "");
    EXPECT_THROW(RunLock{run}, FileError) << name;
    remove_file(run.root / name);
  }
}

TEST(RunFolder, OneSimulationAtATime) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch / "a/b"};
  {
    const RunLock lock(run);
    EXPECT_THROW(RunLock{run}, FileError);
  }
  EXPECT_FALSE(fs::exists(run.root)) << "a folder in which nothing was written goes away again";
  const RunLock again(run);
}

TEST(RunFolder, AFreshRunRemovesTheOldFramesAndNothingElse) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  continue_run(run, manifest(), "frames = 1\n");
  for (const fs::path& path :
       {run.mesh(0), run.level_set(1), run.static_level_sets(), run.image(2), run.checkpoint() / "0003.bin",
        run.stats(), run.root / "stack.mp4", run.mesh(4).concat(".tmp77-0")})
    write_atomically(path, "old");
  for (const fs::path& path : {run.root / "notes.txt", run.root / "best.mp4", run.root / "image/best.png"})
    write_atomically(path, "the user's");
  clear_run(run);
  continue_run(run, manifest(), "frames = 2\n");
  for (const fs::path& path :
       {run.mesh(0), run.level_set(1), run.static_level_sets(), run.image(2), run.checkpoint() / "0003.bin",
        run.stats(), run.root / "stack.mp4", run.mesh(4).concat(".tmp77-0")})
    EXPECT_FALSE(fs::exists(path)) << path;
  for (const fs::path& path : {run.root / "notes.txt", run.root / "best.mp4", run.root / "image/best.png"})
    EXPECT_TRUE(fs::exists(path)) << path;
  EXPECT_EQ(read_file(run.scene()), "frames = 2\n");
}

TEST(RunFolder, HoldsTheFramesOfWhateverFileIsLeft) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  EXPECT_TRUE(held_run(run).is_empty());
  EXPECT_TRUE(held_run({scratch / "none"}).is_empty());
  continue_run(run, manifest(), "frames = 1\n");
  write_atomically(run.image(0).replace_filename("best.png"), "no frame");
  EXPECT_TRUE(held_run(run).is_empty());
  write_atomically(run.mesh(0), "frame");
  write_atomically(run.level_set(1), "frame");
  write_atomically(run.image(2), "frame");
  write_atomically(run.checkpoint() / "0003.bin", "frame");
  write_atomically(run.stats(), "{\"frame\": 3}\n{\"frame\": 4}\nno object\n{\"frame\": 5");
  EXPECT_EQ(held_run(run).frames, (std::set<int>{0, 1, 2, 3, 4}));
  EXPECT_FALSE(held_run(run).has_video);
  write_atomically(run.root / "stack.mp4", "video");
  EXPECT_TRUE(held_run(run).has_video);
  fs::remove_all(run.checkpoint());
  write_atomically(run.checkpoint(), "no folder");
  EXPECT_THROW(held_run(run), FileError);
}

TEST(RunFolder, AContinuedRunKeepsItsFrames) {
  const ScratchFolder scratch;
  const RunDirectory run{scratch.path()};
  continue_run(run, manifest(), "frames = 1\n");
  write_atomically(run.mesh(0), "frame");
  write_atomically(run.static_level_sets(), "what never moves");
  write_atomically(run.mesh(1).concat(".tmp77-0"), "half a fr");
  write_atomically(run.root / "stack.mp4.tmp77-0", "half a vid");
  const fs::path notes = run.root / "notes.tmpl", mesh = run.root / "mesh" / "mine.tmp";
  for (const fs::path& path : {notes, mesh}) write_atomically(path, "the user's");
  continue_run(run, manifest(), "frames = 1\n");
  EXPECT_FALSE(fs::exists(run.root / "stack.mp4.tmp77-0"));
  for (const fs::path& path : {notes, mesh}) EXPECT_EQ(read_file(path), "the user's") << path;
  EXPECT_TRUE(fs::exists(run.mesh(0)));
  EXPECT_TRUE(fs::exists(run.static_level_sets()));
  EXPECT_FALSE(fs::exists(run.mesh(1).concat(".tmp77-0")));
}

}  // namespace
}  // namespace duet::io::run_folder_test
