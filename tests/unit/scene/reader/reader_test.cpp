#include "sim/scene/reader/reader.h"

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/places.h"
#include "tests/unit/scene/same_scene.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/error.h"

namespace duet::scene::reader_test {
namespace {

const std::string stack_path = test::source_folder() + "/scenes/stack.toml";
const std::string ball = "[[rigid]]\nname = \"ball\"\nshape = { sphere = 1 }\nmass = 5\n";

std::vector<SceneProblem> problems_of(const std::string& text,
                                      const std::vector<std::string>& overrides = {}) {
  try {
    read_text(text, "scene.toml", overrides);
  } catch (const SceneError& error) {
    return error.problems();
  }
  ADD_FAILURE() << "the scene was accepted:\n" << text;
  return {};
}

// Returns the text of the only problem of the scene.
std::string problem_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const auto problems = problems_of(text, overrides);
  EXPECT_EQ(problems.size(), 1u) << (problems.size() > 1 ? problems[1].text() : "");
  return problems.empty() ? "" : problems.front().text();
}

Scene scene_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    return read_text(text, "scene.toml", overrides).scene;
  } catch (const SceneError& error) {
    ADD_FAILURE() << error.what();
    return {};
  }
}

const RigidBody& rigid(const Scene& scene, std::string_view name) {
  for (const RigidBody& body : scene.rigid)
    if (body.name == name) return body;
  throw std::runtime_error(fmt::format("no rigid body {}", name));
}

TEST(SceneReader, ReadsTheStack) {
  const ReadResult result = read(stack_path);
  const Scene& scene = result.scene;
  EXPECT_EQ(scene.path, stack_path);
  EXPECT_EQ(scene.figure, "2");
  ASSERT_EQ(scene.rigid.size(), 4u);
  ASSERT_EQ(scene.deformable.size(), 3u);
  const RigidBody& body = rigid(scene, "ball");
  EXPECT_EQ(body.shape.kind, ShapeKind::sphere);
  EXPECT_EQ(body.shape.radius, 1);
  EXPECT_EQ(body.placement.velocity, Vec3(0, 0, -25));
  EXPECT_EQ(body.mass, 6000);
  EXPECT_FALSE(body.density.has_value());
  EXPECT_GT(body.at.line, rigid(scene, "box6").at.line);
  EXPECT_EQ(rigid(scene, "box2").shape.size, Vec3(2, 2, 2));
  EXPECT_EQ(scene.deformable[0].material, "rubber");
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].youngs_modulus, 2e6);
  ASSERT_TRUE(scene.ground.has_value());
  EXPECT_EQ(scene.ground->look, "floor");
  EXPECT_TRUE(scene.lights[0].shadow);
  EXPECT_FALSE(scene.lights[1].shadow) << "point lights cast none";

  std::ifstream file(stack_path, std::ios::binary);
  EXPECT_EQ(result.source, std::string(std::istreambuf_iterator<char>(file), {})) << "the file's own bytes";
}

TEST(SceneReader, DefaultsAreThoseOfTheSceneStructures) {
  const Scene scene = scene_of(ball);
  Scene expected;
  RigidBody& body = expected.rigid.emplace_back();
  body.name = "ball";
  body.shape = {.kind = ShapeKind::sphere, .radius = 1};
  body.mass = 5;
  expect_same_scene(scene, expected);
}

TEST(SceneReader, PresetsSetTheDefaultsOfTheSolver) {
  for (const auto& [name, accuracy] :
       {std::pair{"draft", Accuracy::draft}, {"standard", Accuracy::standard}, {"fine", Accuracy::fine}}) {
    SCOPED_TRACE(name);
    const Scene scene = scene_of(ball + "[solver]\naccuracy = \"" + name + "\"\n");
    expect_same_keys(scene.solver, preset(accuracy));
  }
  EXPECT_GT(preset(Accuracy::draft).cg_tolerance, preset(Accuracy::standard).cg_tolerance);
  EXPECT_GT(preset(Accuracy::standard).cg_tolerance, preset(Accuracy::fine).cg_tolerance);
  expect_same_keys(preset(Accuracy::standard), Solver{});
}

TEST(SceneReader, KeysWinOverThePresetWhereverTheyStand) {
  const Scene scene = scene_of(ball + "[solver]\ncfl = 0.3\naccuracy = \"draft\"\nface_samples = 7\n");
  EXPECT_EQ(scene.solver.cfl, 0.3);
  EXPECT_EQ(scene.solver.face_samples, 7);
  EXPECT_EQ(scene.solver.contact_iterations, preset(Accuracy::draft).contact_iterations);
}

TEST(SceneReader, RotationIsCounterClockwiseAboutItsAxis) {
  const Scene scene = scene_of(ball + "rotation = { axis = [0, 2, 0], degrees = 90 }\n");
  const Vec3 turned = scene.rigid[0].placement.orientation * Vec3::UnitX();
  // The result is exact up to the rounding of sin and cos.
  EXPECT_LT((turned - Vec3(0, 0, -1)).norm(), 1e-15);
}

TEST(SceneReader, IntegersAreNumbersButNumbersAreNoIntegers) {
  EXPECT_EQ(scene_of("fps = 30\n" + ball).fps, 30);
  const std::string problem = problem_of("frames = 30.0\n" + ball);
  EXPECT_TRUE(problem.starts_with("scene.toml:1:10: frames: must be an integer, is the number 30.0 ("))
      << problem;
}

TEST(SceneReader, StaticBodiesNeedNoMass) {
  const Scene scene =
      scene_of(ball + "[[rigid]]\nname = \"wall\"\nshape = { box = [1, 2, 3] }\nstatic = true\n");
  EXPECT_TRUE(rigid(scene, "wall").is_static);
  EXPECT_FALSE(rigid(scene, "wall").mass.has_value());
}

TEST(SceneReader, AnEmptyLookIsTheDefaultLookAnEmptyMaterialIsNone) {
  EXPECT_EQ(scene_of(ball + "look = \"\"\n").rigid[0].look, "");
  EXPECT_EQ(problem_of("[[deformable]]\nname = \"a\"\nshape = { box = [1, 1, 1] }\nmaterial = \"\"\n"),
            "scene.toml:4:12: deformable.a.material: must not be empty (what the body is made of)");
}

TEST(SceneReader, EveryProblemComesInOneGoSortedByLine) {
  const auto problems =
      problems_of("fps = 0\nframs = 4\n" + ball + "friction = -1\n[camera]\nup = [0, 0, 0]\n");
  ASSERT_EQ(problems.size(), 4u);
  const std::vector<std::string> keys = {"fps", "frams", "rigid.ball.friction", "camera.up"};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    EXPECT_EQ(problems[i].key, keys[i]);
    EXPECT_FALSE(problems[i].hint.empty()) << problems[i].text();
    EXPECT_GT(problems[i].line, i > 0 ? problems[i - 1].line : 0);
  }
}

TEST(SceneReader, HintsNameTheNearestKeyTheTableOrAllKnownKeys) {
  EXPECT_NE(problem_of(ball + "postion = [0, 1, 0]\n").find("did you mean `position`?"), std::string::npos);
  EXPECT_NE(problem_of(ball + "poisson_ratio = 0.3\n").find("`poisson_ratio` belongs to [materials.NAME]"),
            std::string::npos);
  EXPECT_NE(problem_of(ball + "[sky]\ncloudiness = 3\n").find("known: zenith, horizon, intensity"),
            std::string::npos);
}

TEST(SceneReader, MissingFileNamesTheNearestScene) {
  try {
    read(test::source_folder() + "/scenes/stakc.toml");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_EQ(error.status(), ExitStatus::files);
    EXPECT_NE(std::string(error.what()).find("scenes/stack.toml`?"), std::string::npos) << error.what();
  }
  EXPECT_THROW(read(test::source_folder() + "/scenes"), FileError) << "a folder";
}

TEST(SceneOverrides, ReplaceAndAddKeys) {
  const Scene scene =
      read(stack_path,
           {"solver.cfl=0.5", "rigid.ball.velocity=[0, 0, -9]", "render.width = 640",
            "materials.rubber.youngs_modulus=1e6", "rigid.ball.shape.sphere=1.5", "title=Tall stack",
            "looks.red.color=[1, 0, 0]", "rigid.box2.look=red", "solver.accuracy=fine", "lights.key.power=5"})
          .scene;
  EXPECT_EQ(scene.solver.cfl, 0.5) << "wins over the preset that comes after it";
  EXPECT_EQ(scene.solver.contact_iterations, preset(Accuracy::fine).contact_iterations);
  EXPECT_EQ(rigid(scene, "ball").placement.velocity, Vec3(0, 0, -9));
  EXPECT_EQ(rigid(scene, "ball").shape.radius, 1.5);
  EXPECT_EQ(rigid(scene, "box2").look, "red");
  EXPECT_EQ(rigid(scene, "box4").look, "silver");
  EXPECT_EQ(scene.materials[0].youngs_modulus, 1e6);
  EXPECT_EQ(scene.render.width, 640);
  EXPECT_EQ(scene.title, "Tall stack") << "a bare word is a text";
  EXPECT_EQ(scene.lights[0].power, 5);
  EXPECT_EQ(scene.looks.size(), 5u);
}

TEST(SceneOverrides, ElementsWhoseNamesHoldDotsAreFound) {
  const std::string text = ball +
                           "[[rigid]]\nname = \"ball.2\"\nshape = { sphere = 1 }\nmass = 5\nlook = \"r.1\"\n"
                           "[looks.\"r.1\"]\nroughness = 0.1\n";
  const Scene scene = scene_of(text, {"rigid.ball.2.mass=7", "rigid.ball.mass=6", "looks.r.1.roughness=0.2"});
  EXPECT_EQ(rigid(scene, "ball.2").mass, 7);
  EXPECT_EQ(rigid(scene, "ball").mass, 6);
  ASSERT_EQ(scene.looks.size(), 1u);
  EXPECT_EQ(scene.looks[0].roughness, 0.2);
}

TEST(SceneOverrides, AreCheckedLikeTheFile) {
  EXPECT_EQ(problem_of(ball, {"solver.clf=1"}), "--set: solver.clf: unknown key (did you mean `cfl`?)");
  EXPECT_EQ(problem_of(ball, {"sovler.cfl=1"}), "--set: sovler: unknown key (did you mean `solver`?)");
  EXPECT_EQ(problem_of(ball, {"rigid.ball.mass=-3"}).substr(0, 54),
            "--set: rigid.ball.mass: must be > 0 kg, is -3 (of the ");
  EXPECT_EQ(problem_of(ball, {"rigid.bal.mass=3"}),
            "--set: rigid.bal.mass: no [[rigid]] is named `bal` (did you mean `ball`?)");
  EXPECT_EQ(problem_of(ball, {"lights.key.power=3"}),
            "--set: lights.key.power: no [[lights]] is named `key`");
  EXPECT_EQ(problem_of(ball, {"rigid.ball=3"}),
            "--set: rigid.ball: names an element, not one of its keys (rigid.ball.velocity=[0,0,1])");
  EXPECT_EQ(problem_of("fps = 24\n" + ball, {"fps.x=3"}),
            "--set: fps.x: `fps` is no table, it has no keys of its own");
  EXPECT_EQ(problem_of(ball, {"solver.cfl=fast"}).substr(0, 59),
            "--set: solver.cfl: must be a number, is the text \"fast\" (ti");
  EXPECT_EQ(problem_of(ball, {"solver..cfl=1"}), "--set: solver..cfl: has an empty part between its dots");
  EXPECT_EQ(problem_of(ball, {"solver.cfl"}),
            "--set: solver.cfl: is no assignment (write key=value, for example solver.cfl=0.5)");
  EXPECT_NE(problem_of(ball, {"gravity=[0,-9.8"}).find("`[0,-9.8` is no TOML value"), std::string::npos);
  EXPECT_NE(problem_of(ball, {"fps="}).find("has no value"), std::string::npos);
}

TEST(SceneOverrides, CannotSmuggleInASecondKey) { EXPECT_EQ(scene_of(ball, {"title=1\nfps = 3"}).fps, 24); }

TEST(SceneOverrides, SourceReadsBackToTheSameScene) {
  // 0.1 + 0.2 needs all 17 digits, and the title needs escapes.
  const ReadResult result = read(
      stack_path, {"rigid.ball.friction=0.30000000000000004", "title=\"a 'b' \\\"c\\\" \\u0007 \\\\ d\"",
                   "rigid.ball.rotation={axis=[1,2,3],degrees=33.3}", "sky.intensity=1e-7", "fps=23.976"});
  EXPECT_EQ(result.scene.title, "a 'b' \"c\" \a \\ d");
  const ReadResult again = read_text(result.source, "again.toml");
  expect_same_scene(result.scene, again.scene);
  EXPECT_EQ(rigid(again.scene, "ball").friction, 0.1 + 0.2);
}

}  // namespace
}  // namespace duet::scene::reader_test
