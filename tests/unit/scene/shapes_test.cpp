// Tests of rigid shapes from the scene file to the world.
#include <cmath>

#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/io/run_directory.h"
#include "sim/scene/build/build_world.h"
#include "sim/scene/explain.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::scene::shapes_test {
namespace {

const std::string assets = test::source_folder() + "/assets/";

Scene scene_of(const std::string& text) { return read_text(text, assets + "scene.toml").scene; }

BuiltWorld built(const Scene& scene) { return build_world(scene, plan_effects(scene).active()); }

TEST(RigidShapes, EveryKindBecomesItsLevelSet) {
  const auto level_set = [](const std::string& shape) {
    return built(scene_of("[[rigid]]\nname = \"a\"\nmass = 2\nshape = " + shape))
        .world.bodies.rigid.properties[0]
        .shape;
  };
  EXPECT_DOUBLE_EQ(level_set("{ capsule = { radius = 1, length = 4 } }").distance(Vec3(0, 5, 0)), 2);
  EXPECT_DOUBLE_EQ(level_set("{ cylinder = { radius = 1, height = 4 } }").distance(Vec3(0, 5, 0)), 3);
  EXPECT_DOUBLE_EQ(level_set("{ torus = { radius = 3, tube = 1 } }").distance(Vec3(3, 5, 0)), 4);
  // The largest inscribed ball lies in the bend, between the outer faces and the inner edge: its radius is (2
  // - sqrt(2)) / 2 for walls of 0.5. The principal axes are turned by 45 degrees, so that the longest extent
  // is sqrt(2).
  EXPECT_NEAR(level_set("{ mesh = \"bracket.obj\", scale = 2 }").min_size(), (2 - std::sqrt(2.0)), 0.05);
  EXPECT_NEAR(level_set("{ mesh = \"bracket.obj\", cells = 20 }").grid->grid().spacing, std::sqrt(2.0) / 20,
              1e-6);
}

// A mesh lies where its file, `position` and `rotation` say, wherever its center of mass is.
TEST(RigidShapes, AMeshLiesWhereTheSceneSays) {
  const Scene scene = scene_of(R"(
[[rigid]]
name = "bracket"
shape = { mesh = "bracket.obj", scale = 2 }
position = [10, 20, 30]
rotation = { axis = [0, 0, 1], degrees = 90 }
angular_velocity = [0, 0, 3]
velocity = [1, 0, 0]
density = 100
)");
  const Simulation simulation(scene, plan_effects(scene).active());
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  const std::vector<Vec3>& file = scene.rigid[0].shape.mesh->positions;
  ASSERT_EQ(surfaces[0].surface.positions.size(), file.size());
  for (std::size_t i = 0; i < file.size(); ++i) {
    const Vec3 expected = Vec3(10, 20, 30) + 2 * Vec3(-file[i].y(), file[i].x(), file[i].z());
    EXPECT_LT((surfaces[0].surface.positions[i] - expected).norm(), 1e-12);
  }
  // The legs are 2 long, 0.5 thick and 1 wide, so that the volume is 1.75. A leg of volume 1 is centered at 1
  // along and 0.25 across.
  const RigidBodies& rigid = simulation.world().bodies.rigid;
  EXPECT_NEAR(rigid.properties[0].mass, 175, 1e-4);  // The file holds floats.
  const double along = (1 * 1 + 0.75 * 0.25) / 1.75, across = (1 * 0.25 + 0.75 * 1.25) / 1.75;
  EXPECT_LT((rigid.state[0].pose.position - (Vec3(10, 20, 30) + Vec3(-across, along, 0.5))).norm(), 1e-5);
  EXPECT_EQ(rigid.state[0].velocity, Vec3(1, 0, 0)) << "of the center of mass";
  EXPECT_LT((rigid.state[0].angular_velocity - Vec3(0, 0, 3)).norm(), 1e-12);
  // Exported level sets have the same placement.
  const BodyLevelSet exported = simulation.level_sets()[0];
  EXPECT_LT(exported.distance(exported.pose.to_body(Vec3(10 - 0.25, 20 + 1.5, 30.5))), -0.2);
  EXPECT_GT(exported.distance(exported.pose.to_body(Vec3(10 - 1.5, 20 + 1.5, 30.5))), 0.9);
}

TEST(RigidShapes, BodiesOfOneMeshShareItsGrid) {
  const Scene scene = scene_of(R"(
[[rigid]]
name = "a"
shape = { mesh = "bracket.obj" }
mass = 1
[[rigid]]
name = "b"
shape = { mesh = "../assets/bracket.obj" }
mass = 2
[[rigid]]
name = "c"
shape = { mesh = "bracket.obj", scale = 2 }
mass = 2
)");
  EXPECT_EQ(scene.rigid[0].shape.mesh, scene.rigid[1].shape.mesh);
  const BuiltWorld world = built(scene);
  const auto& properties = world.world.bodies.rigid.properties;
  EXPECT_EQ(properties[0].shape.grid, properties[1].shape.grid);
  EXPECT_NE(properties[0].shape.grid, properties[2].shape.grid);
}

TEST(RigidShapes, ExplainNamesTheGrids) {
  const ScratchFolder scratch;
  io::write_atomically(
      scratch / "strip.obj",
      "v 0 0 0\nv 1 0 0\nv 1 0.1 0\nv 0 0.1 0\nv 0 0 0.1\nv 1 0 0.1\nv 1 0.1 0.1\nv 0 0.1 0.1\n"
      "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const Scene scene = read_text(R"(
[[rigid]]
name = "a"
shape = { mesh = "strip.obj" }
mass = 1
[[rigid]]
name = "b"
shape = { mesh = "strip.obj" }
position = [0, 1, 0]
mass = 2
[[rigid]]
name = "c"
shape = { mesh = "strip.obj", cells = 8 }
position = [0, 2, 0]
mass = 2
)",
                                (scratch / "scene.toml").string())
                          .scene;
  const EffectPlan plan = plan_effects(scene);
  const WorldSizes sizes = Simulation(scene, plan.active()).sizes();
  ASSERT_EQ(sizes.grids.size(), 2U);
  EXPECT_EQ(sizes.grids[0].bodies, 2);
  EXPECT_NEAR(sizes.grids[0].thickness, 0.1, 0.02);  // to a cell
  EXPECT_NE(explain(scene, plan, sizes).find("level set of `a` and 1 more body: "), std::string::npos);
  const std::vector<std::string> found = warnings(scene, plan, sizes);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].find("the mesh of `c`"), std::string::npos) << "walls thinner than a cell";
}

TEST(RigidShapes, SampleSpacingSetsTheNumberOfSamples) {
  const auto samples = [](const std::string& keys) {
    return built(scene_of("[[rigid]]\nname = \"a\"\nmass = 2\n" + keys))
        .world.bodies.rigid.properties[0]
        .samples.size();
  };
  EXPECT_EQ(samples("shape = { box = [1, 1, 1] }"), 9U * 9 * 9 - 7 * 7 * 7);
  EXPECT_EQ(samples("shape = { box = [1, 1, 1] }\nsample_spacing = 0.5"), 26U);
  EXPECT_GT(samples("shape = { mesh = \"bracket.obj\" }\nsample_spacing = 0.05"),
            2 * samples("shape = { mesh = \"bracket.obj\" }"));
}

// A plate that is too thin for the default spacing is accepted with the one that the message offers.
TEST(RigidShapes, ThinShapesTakeTheSpacingThatIsOffered) {
  for (const char* shape :
       {"box = [1, 1e-9, 1]", "box = [1e-6, 1e5, 1e-6]", "cylinder = { radius = 1, height = 1e-9 }",
        "torus = { radius = 1, tube = 1e-8 }"}) {
    const std::string body = fmt::format("[[rigid]]\nname = \"a\"\nmass = 2\nshape = {{ {} }}\n", shape);
    try {
      scene_of(body);
      ADD_FAILURE() << shape << " was accepted";
    } catch (const Error& error) {
      const std::string message = error.what(), key = "give `";
      const std::size_t start = message.find(key) + key.size();
      const std::string offered = message.substr(start, message.find('`', start) - start);
      EXPECT_EQ(scene_of(body + offered + "\n").rigid.size(), 1U) << shape << ": " << message;
    }
  }
}

TEST(RigidShapes, RepairsAreNoted) {
  const ScratchFolder scratch;
  // This is the corner tetrahedron of the unit cube, inside out.
  io::write_atomically(scratch / "t.obj",
                       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  const std::string text = "[[rigid]]\nname = \"a\"\nmass = 2\nshape = { mesh = \"t.obj\" }\n";
  const ReadResult result = read_text(text, (scratch / "scene.toml").string());
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_EQ(result.notes[0],
            fmt::format("rigid.a.shape.mesh: {}: all 4 triangles faced inward and were turned around",
                        (scratch / "t.obj").string()));
}

// A run that is continued after its mesh has changed would mix two scenes. The fingerprint of the meshes
// tells them apart.
TEST(RigidShapes, TheFingerprintFollowsTheMesh) {
  const ScratchFolder scratch;
  const std::string text = "[[rigid]]\nname = \"a\"\nmass = 2\nshape = { mesh = \"t.obj\" }\n";
  const auto fingerprint = [&](const std::string& x) {
    io::write_atomically(scratch / "t.obj",
                         "v 0 0 0\nv " + x + " 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    return read_text(text, (scratch / "scene.toml").string()).meshes;
  };
  EXPECT_EQ(fingerprint("1"), fingerprint("1"));
  EXPECT_NE(fingerprint("1"), fingerprint("1.01"));
  EXPECT_EQ(read_text("[[rigid]]\nname = \"a\"\nmass = 2\nshape = { sphere = 1 }\n", "s.toml").meshes, 0U);
}

TEST(RigidShapes, PicturesNeedNoMesh) {
  const std::string text = "[[rigid]]\nname = \"a\"\nmass = 2\nshape = { mesh = \"gone.obj\" }\n";
  EXPECT_THROW(read_text(text, "scene.toml"), SceneError);
  const Scene scene = read_text(text, "scene.toml", {}, Meshes::leave).scene;
  EXPECT_EQ(scene.rigid[0].shape.kind, ShapeKind::mesh);
  EXPECT_THROW(built(scene), Error) << "it cannot be simulated";
}

}  // namespace
}  // namespace duet::scene::shapes_test
