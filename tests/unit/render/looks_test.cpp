#include "render/looks.h"

#include <string>

#include <gtest/gtest.h>

#include "sim/base/error.h"

namespace duet::render::looks_test {
namespace {

scene::Scene two_looks() {
  scene::Scene scene;
  scene.path = "scene.toml";
  scene.looks.resize(2);
  scene.looks[0].name = "silver";
  scene.looks[1].name = "orange";
  scene.ground.emplace().look = "silver";
  return scene;
}

io::Manifest wearing(const std::string& look) {
  io::Manifest manifest;
  manifest.bodies.resize(2);
  manifest.bodies[0].name = "first";
  manifest.bodies[0].look = "silver";
  manifest.bodies[1].name = "second";
  manifest.bodies[1].look = look;
  return manifest;
}

const scene::Look& look_of(const LookTable& table, const std::string& body) {
  return table.looks[static_cast<std::size_t>(table.of_body.at(body))];
}

TEST(Looks, EveryBodyWearsItsOwn) {
  const LookTable table = assign_looks(two_looks(), wearing("orange"));
  EXPECT_EQ(look_of(table, "first").name, "silver");
  EXPECT_EQ(look_of(table, "second").name, "orange");
  EXPECT_EQ(table.looks[LookTable::ground].name, "silver");
}

TEST(Looks, NoNameMeansTheDefaultLookForStaticBodies) {
  io::Manifest manifest = wearing("");
  manifest.bodies[1].kind = "static";
  const LookTable table = assign_looks(two_looks(), manifest);
  EXPECT_EQ(table.of_body.at("second"), LookTable::plain);
  EXPECT_EQ(look_of(table, "second").color, scene::Look{}.color);
}

// Consecutive bodies have colors that can be told apart, named looks stay, and a thousand bodies need no more
// looks than the palette has.
TEST(Looks, MovingBodiesWithoutALookTakePaletteColors) {
  io::Manifest manifest = wearing("");
  for (int i = 2; i < 1000; ++i) {
    manifest.bodies.emplace_back().name = std::to_string(i);
    manifest.bodies.back().kind = i % 2 == 0 ? "rigid" : "deformable";
  }
  const LookTable table = assign_looks(two_looks(), manifest);
  EXPECT_EQ(look_of(table, "first").name, "silver");
  EXPECT_LT(table.looks.size(), 20u);
  for (std::size_t i = 2; i < manifest.bodies.size(); ++i) {
    const Vec3 color = look_of(table, manifest.bodies[i].name).color;
    EXPECT_GT((color - look_of(table, manifest.bodies[i - 1].name).color).norm(), 0.2) << i;
    EXPECT_GT((color - scene::Look{}.color).norm(), 0.2) << i;
  }
}

TEST(Looks, AnUnknownNameIsAnErrorWithTheNearMiss) {
  try {
    assign_looks(two_looks(), wearing("ornage"));
    FAIL() << "accepted";
  } catch (const FileError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("body `second`"), std::string::npos) << message;
    EXPECT_NE(message.find("did you mean `orange`"), std::string::npos) << message;
  }
}

TEST(Looks, DeformableBodiesWearTheirStrain) {
  io::Manifest manifest = wearing("orange");
  manifest.bodies[1].kind = "deformable";
  scene::Scene scene = two_looks();
  EXPECT_EQ(assign_looks(scene, manifest).of_values, -1);
  scene.render.color = scene::ColorBy::strain;
  const LookTable table = assign_looks(scene, manifest);
  EXPECT_EQ(look_of(table, "first").name, "silver");
  EXPECT_EQ(table.of_body.at("second"), table.of_values);
  EXPECT_EQ(table.looks.size(), static_cast<std::size_t>(table.of_values) + 2);
  EXPECT_EQ(table.looks.back().color, inverted_color);
}

// Thin bodies have no stress, and contact.
TEST(Looks, ThinBodiesWearContactAlone) {
  io::Manifest manifest = wearing("orange");
  manifest.bodies[1].kind = "deformable";
  manifest.bodies[1].has_strain = false;
  scene::Scene scene = two_looks();
  scene.render.color_range = 1e4;
  scene.render.color = scene::ColorBy::stress;
  EXPECT_EQ(look_of(assign_looks(scene, manifest), "second").name, "orange");
  scene.render.color = scene::ColorBy::contact;
  const LookTable table = assign_looks(scene, manifest);
  EXPECT_EQ(table.of_body.at("second"), table.of_values);
}

}  // namespace
}  // namespace duet::render::looks_test
