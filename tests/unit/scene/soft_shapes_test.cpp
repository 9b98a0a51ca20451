// Tests of deformable shapes from the scene file to the world.
#include <cmath>

#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/files/tet_mesh_file.h"
#include "sim/geometry/meshing/tetrahedralizer.h"
#include "sim/io/run_directory.h"
#include "sim/scene/build/build_world.h"
#include "sim/scene/explain.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"
#include "sim/step/world.h"

namespace duet::scene::soft_shapes_test {
namespace {

const std::string assets = test::source_folder() + "/assets/";

Scene scene_of(const std::vector<std::string>& shapes, const std::string& path = assets + "scene.toml") {
  std::string text = "[materials.rubber]\ndensity = 1000\n";
  for (std::size_t i = 0; i < shapes.size(); ++i)
    text +=
        fmt::format("[[deformable]]\nname = \"soft{}\"\nmaterial = \"rubber\"\nshape = {}\n", i, shapes[i]);
  return read_text(text, path).scene;
}

BuiltWorld built(const Scene& scene) { return build_world(scene, plan_effects(scene).active()); }

double mass_of(const BuiltWorld& world) {
  double mass = 0;
  for (const double m : world.world.bodies.particles.mass) mass += m;
  return mass;
}

TEST(SoftShapes, EveryKindIsFilledAndWeighsWhatItsVolumeSays) {
  struct Case {
    const char* shape;
    LevelSet level_set;
  };
  for (const auto& [shape, level_set] :
       {Case{"{ sphere = 0.5, spacing = 0.08 }", LevelSet::sphere(0.5)},
        {"{ capsule = { radius = 0.3, length = 0.5 }, spacing = 0.06 }", LevelSet::capsule(0.3, 0.5)},
        {"{ cylinder = { radius = 0.4, height = 0.7 }, spacing = 0.06 }", LevelSet::cylinder(0.4, 0.7)},
        {"{ torus = { radius = 0.5, tube = 0.2 }, spacing = 0.05, graded = true }",
         LevelSet::torus(0.5, 0.2)}}) {
    SCOPED_TRACE(shape);
    // Chords and rims cut off less than 4 % at about five cells per radius.
    const double mass = mass_of(built(scene_of({shape}))), exact = 1000 * volume(level_set);
    EXPECT_LT(mass, exact);
    EXPECT_GT(mass, 0.96 * exact);
  }
}

TEST(SoftShapes, AMeshAndAFileOfTetsLieInTheirOwnCoordinates) {
  const ScratchFolder folder;
  const TetMesh mesh = tetrahedralize(LevelSet::sphere(0.5), 0.25);
  io::write_atomically(folder / "ball.mesh", medit_text(mesh));
  Scene scene = scene_of({"{ tets = \"ball.mesh\", scale = 2 }"}, (folder / "scene.toml").string());
  scene.deformable[0].placement.position = Vec3(1, 2, 3);
  const BuiltWorld from_file = built(scene);
  const auto& x = from_file.world.bodies.particles.x;
  ASSERT_EQ(x.size(), mesh.nodes.size());
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(x[i], Vec3(1, 2, 3) + 2 * mesh.nodes[i]);

  // The bracket has its outer edge at the origin, and its legs along x and y are 0.25 m thick.
  const BuiltWorld bracket = built(scene_of({"{ mesh = \"bracket.obj\", spacing = 0.1 }"}));
  ASSERT_GT(bracket.world.bodies.particles.x.size(), 50U);
  for (const Vec3& node : bracket.world.bodies.particles.x) {
    EXPECT_GT(node.minCoeff(), -0.01);
    EXPECT_LT(node.maxCoeff(), 1.01);
    EXPECT_LT(std::min(node.x(), node.y()), 0.26);
  }
}

// A body spins about its center of mass, wherever the origin of its mesh is: the spin adds no linear
// momentum.
TEST(SoftShapes, SpinIsAboutTheCenterOfMass) {
  Scene scene = scene_of({"{ mesh = \"bracket.obj\", spacing = 0.1 }"});
  scene.deformable[0].placement.angular_velocity = Vec3(0, 0, 5);
  scene.deformable[0].placement.velocity = Vec3(1, 0, 0);
  const BuiltWorld world = built(scene);
  const auto& particles = world.world.bodies.particles;
  Vec3 momentum = Vec3::Zero(), center = Vec3::Zero();
  for (std::size_t i = 0; i < particles.x.size(); ++i) {
    momentum += particles.mass[i] * particles.v[i];
    center += particles.mass[i] / mass_of(world) * particles.x[i];
  }
  EXPECT_GT(center.norm(), 0.3) << "the origin must not be the center of mass";
  EXPECT_LT((momentum - mass_of(world) * Vec3(1, 0, 0)).norm(), 1e-10 * mass_of(world));
}

TEST(SoftShapes, LatticePatternsHaveTheirNumberOfTets) {
  for (const auto& [pattern, tets] : {std::pair("five", 5 * 8), {"six", 6 * 8}, {"bcc", 4 * 12 + 2 * 24}}) {
    const BuiltWorld world =
        built(scene_of({fmt::format("{{ box = [1, 1, 1], cells = [2, 2, 2], pattern = \"{}\" }}", pattern)}));
    EXPECT_EQ(world.world.bodies.deformable[0].tet_count, tets) << pattern;
    EXPECT_NEAR(mass_of(world), 1000, 1e-9);
  }
}

TEST(SoftShapes, EqualShapesShareAMeshAndExplainShowsItsQuality) {
  const std::string ball = "{ sphere = 0.5, spacing = 0.2 }";
  Scene scene = scene_of({ball, ball, "{ sphere = 0.5, spacing = 0.1 }", "{ box = [1, 1, 1] }"});
  for (std::size_t i = 0; i < 4; ++i)  // The bodies must not intersect.
    scene.deformable[i].placement.position.x() = 3 * static_cast<double>(i);
  const EffectPlan plan = plan_effects(scene);
  const WorldSizes sizes = Simulation(scene, plan.active()).sizes();
  ASSERT_EQ(sizes.tet_meshes.size(), 3U);
  EXPECT_EQ(sizes.tet_meshes[0].bodies, 2);
  EXPECT_GT(sizes.tet_meshes[0].min_angle, min_dihedral_angle);
  EXPECT_LT(sizes.tet_meshes[0].max_angle, max_dihedral_angle);
  EXPECT_GT(sizes.tet_meshes[0].min_altitude, sizes.tet_meshes[1].min_altitude);
  // The altitude on the slanted face of a cell's cut-off corner, for cells of 0.25 m.
  EXPECT_NEAR(sizes.tet_meshes[2].min_altitude, 0.25 / std::sqrt(3.0), 1e-12);
  const std::string text = explain(scene, plan, sizes);
  EXPECT_NE(text.find("tetrahedra of `soft0` and 1 more body: smallest altitude"), std::string::npos) << text;
  EXPECT_EQ(explain_json(scene, plan, sizes)["sizes"]["tet_meshes"][0]["tets"], sizes.tet_meshes[0].tets);
}

// The default spacing is a quarter of the thickness: these would have a lattice of 1e9 cells and more.
TEST(SoftShapes, TooThinForTheirSizeAreRefused) {
  for (const char* shape :
       {"{ torus = { radius = 1, tube = 1e-4 } }", "{ cylinder = { radius = 1, height = 1e-6 } }",
        "{ capsule = { radius = 1e-9, length = 1e3 } }"}) {
    try {
      built(scene_of({shape}));
      ADD_FAILURE() << shape << " was accepted";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("deformable.soft0.shape: is so thin for its size"),
                std::string::npos)
          << error.what();
    }
  }
  EXPECT_GT(mass_of(built(scene_of({"{ cylinder = { radius = 0.01, height = 2 } }"}))), 0)
      << "long, not too thin";
}

TEST(SoftShapes, TooWideASpacingForAMeshNamesTheBody) {
  const Scene scene = scene_of({"{ mesh = \"knot.obj\", spacing = 0.15 }"});
  try {
    built(scene);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    const std::string message = error.what();
    EXPECT_NE(message.find("deformable.soft0.shape"), std::string::npos) << message;
    EXPECT_NE(message.find("lower `spacing`"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace duet::scene::soft_shapes_test
