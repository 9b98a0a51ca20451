// Parameters stand for values anywhere in a scene, and faulty values of them are reported where they are
// used.
#include "sim/scene/reader/parameters.h"

#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::parameters_test {
namespace {

const std::string body = "[[rigid]]\nname = \"a\"\nshape = { sphere = 1 }\ndensity = 800\n";
const std::string ball = "[[rigid]]\nname = \"ball\"\nshape = { sphere = \"$size\" }\ndensity = 800\n";

// Returns the text of the first problem of the scene, without its remedy.
std::string start_of_problem(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    read_text(text, "s.toml", overrides);
  } catch (const SceneError& error) {
    const std::string problem = error.problems().front().text();
    return problem.substr(0, problem.rfind(" ("));
  }
  return {};
}

TEST(Parameters, FaultyValuesAreReportedWhereTheyAreUsed) {
  EXPECT_EQ(
      start_of_problem("[parameters]\nsize = -1\n" + ball),
      "s.toml:5:20: rigid.ball.shape.sphere: must be > 0 m, is -1, from the parameter `size` in line 2");
  EXPECT_EQ(
      start_of_problem("[parameters]\nsize = 1\n" + ball, {"parameters.size=-2"}),
      "s.toml:5:20: rigid.ball.shape.sphere: must be > 0 m, is -2, from the parameter `size` set by --set");
  EXPECT_EQ(
      start_of_problem("[parameters]\nsize = 1\nlow = [0, \"x\", 0]\n" + ball + "position = \"$low\"\n"),
      "s.toml:8:12: rigid.ball.position[1]: must be a number, is the text \"x\", from the parameter `low` "
      "in line 3");
}

TEST(Parameters, FaultyValuesAreFoundInAllKindsOfTables) {
  const std::string start = "[parameters]\nsize = 1\nbad = -1\n" + ball;
  EXPECT_EQ(start_of_problem(start + "[solver]\ncfl = \"$bad\"\n").substr(0, 23), "s.toml:9:7: solver.cfl:");
  EXPECT_EQ(
      start_of_problem(start + "[camera]\nkeyframes = [{ time = 0 }, { time = \"$bad\" }]\n").substr(0, 12),
      "s.toml:9:37:");
  EXPECT_EQ(
      start_of_problem(start + "[looks.red]\nroughness = \"$bad\"\n[ground]\nlook = \"red\"\n").substr(0, 31),
      "s.toml:9:13: looks.red.roughnes");
  EXPECT_EQ(start_of_problem(start + "repeat = { count = \"$bad\" }\n").substr(0, 38),
            "s.toml:8:20: rigid.ball.repeat.count: ");
}

TEST(Parameters, FaultyValuesOfCopiesAreFoundToo) {
  const std::string start =
      "[parameters]\nbad = -1\n[[prefabs.p.rigid]]\nname = \"b\"\nshape = { sphere = 1 }\n";
  const std::string end = "[[instances]]\nname = \"i\"\nprefab = \"p\"\n";
  EXPECT_EQ(start_of_problem(start + "density = \"$bad\"\n" + end).substr(0, 30),
            "s.toml:6:11: rigid.i-b.density");
  EXPECT_EQ(start_of_problem(start + "density = \"$bed\"\n" + end).substr(0, 65),
            "s.toml:6:11: prefabs.p.rigid.b.density: there is no parameter `be");
  EXPECT_EQ(
      start_of_problem(start + "density = 1\n" + body + end + "grid = [1, 1, \"$bad\"]\n").substr(0, 34),
      "s.toml:14:15: instances.i.grid[2]:");
}

TEST(Parameters, StandForKeysOutsideOfAllTables) {
  EXPECT_EQ(read_text("frames = \"$n\"\n[parameters]\nn = 7\nsize = 1\n" + ball, "s.toml").scene.frames, 7);
}

}  // namespace
}  // namespace duet::scene::parameters_test
