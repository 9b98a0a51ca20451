// Tests that a deformable body made of a mesh is drawn by that mesh, vertex by vertex, and that its distance
// from the tetrahedra, which touch other bodies, is reported.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/scene/explain.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::drawn_surface_test {
namespace {

// A double cone of n sides. The tetrahedra fall short of the mesh at its tips.
constexpr int sides = 24;
std::string double_cone() {
  std::string text = "v 0 1 0\nv 0 -1 0\n";
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    text += fmt::format("v {} 0 {}\n", 0.5 * std::cos(angle), 0.5 * std::sin(angle));
  }
  for (int i = 0; i < sides; ++i) {
    const int a = 3 + i, b = 3 + (i + 1) % sides;
    text += fmt::format("f 1 {} {}\nf 2 {} {}\n", b, a, a, b);
  }
  return text;
}

Scene read_cone(const std::string& keys) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "cone.obj", double_cone());
  return read_text(
             "[materials.jelly]\ndensity = 1000\nyoungs_modulus = 1e5\npoisson_ratio = 0.4\n[[deformable]]\n"
             "name = \"cone" +
                 std::string(keys.find("repeat") == std::string::npos ? "" : "{}") +
                 "\"\nmaterial = \"jelly\"\n" + keys + "\n",
             scratch / "cone.toml")
      .scene;
}

struct Drawn {
  explicit Drawn(const std::string& keys) : scene(read_cone(keys)), simulation(scene, test::plan(scene)) {
    simulation.surfaces(bodies);
  }
  const Surface& surface() const { return bodies.at(0).surface; }

  Scene scene;
  Simulation simulation;
  std::vector<BodySurface> bodies;
};

TEST(DrawnSurface, IsTheMeshUnlessAskedOtherwise) {
  for (const char* scale : {"", ", scale = 0.01", ", scale = 100"}) {
    const double factor = std::string(scale).empty() ? 1 : std::stod(std::string(scale).substr(10));
    const Drawn mesh(fmt::format("shape = {{ mesh = \"cone.obj\", spacing = {}{} }}\nposition = [0, 3, 0]",
                                 0.2 * factor, scale));
    EXPECT_EQ(mesh.surface().triangles.size(), 2U * sides) << scale;
    EXPECT_EQ(mesh.surface().positions.size(), 2U + sides) << scale;
    for (const double y : {1.0, -1.0})
      EXPECT_TRUE(std::any_of(
          mesh.surface().positions.begin(), mesh.surface().positions.end(),
          [&](const Vec3& x) { return (x - Vec3(0, 3 + factor * y, 0)).norm() < 1e-12 * (3 + factor); }))
          << "the tip at " << y << scale;
  }
  const Drawn tets("shape = { mesh = \"cone.obj\", spacing = 0.2 }\ndrawn = \"tetrahedra\"");
  EXPECT_NE(tets.surface().triangles.size(), 2U * sides);
  EXPECT_TRUE(tets.simulation.sizes().skins.empty());
}

TEST(DrawnSurface, ItsDistanceFromTheTetrahedraIsTold) {
  for (const double spacing : {0.25, 0.1}) {
    const Drawn cone(fmt::format("shape = {{ mesh = \"cone.obj\", spacing = {} }}", spacing));
    const WorldSizes sizes = cone.simulation.sizes();
    ASSERT_EQ(sizes.skins.size(), 1U);
    // The tips are farthest from the tetrahedra, whose boundary is the surface that drawn = "tetrahedra"
    // shows.
    const Drawn tets(
        fmt::format("shape = {{ mesh = \"cone.obj\", spacing = {} }}\ndrawn = \"tetrahedra\"", spacing));
    double top = -1;
    for (const Vec3& x : tets.surface().positions) top = std::max(top, x.y());
    EXPECT_GT(sizes.skins[0].outside, 0);
    EXPECT_GE(sizes.skins[0].outside, 0.9 * (1 - top)) << spacing;
    EXPECT_LT(sizes.skins[0].outside, spacing) << spacing;
    EXPECT_DOUBLE_EQ(sizes.skins[0].extent, 2);
    EXPECT_EQ(skin_warnings(sizes).empty(), sizes.skins[0].outside <= 0.02 && sizes.skins[0].inside <= 0.02);
  }
}

TEST(DrawnSurface, BodiesAlikeAreToldOnce) {
  const Drawn cones(
      "shape = { mesh = \"cone.obj\", spacing = 0.25 }\nrepeat = { count = 3, step = [4, 0, 0] }");
  const std::vector<SkinSize> skins = cones.simulation.sizes().skins;
  ASSERT_EQ(skins.size(), 1U);
  EXPECT_EQ(skins[0].bodies, 3);
}

TEST(DrawnSurface, TheKeyIsRefusedWhereItHasNoEffect) {
  EXPECT_THROW(read_cone("shape = { sphere = 1 }\ndrawn = \"mesh\""), SceneError);
  EXPECT_THROW(read_cone("shape = { mesh = \"cone.obj\" }\nskin = { mesh = \"cone.obj\" }\ndrawn = \"mesh\""),
               SceneError);
}

}  // namespace
}  // namespace duet::scene::drawn_surface_test
