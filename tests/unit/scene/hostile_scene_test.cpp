// Tests that scenes that ask for more than any machine has are refused quickly, with the place, the bound and
// a remedy.
#include <ctime>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::hostile_scene_test {
namespace {

// Returns the text of all problems of the scene, and checks that finding them took less than 1.5 s.
std::string refusal_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const std::clock_t start = std::clock();  // processor time, which other programs do not lengthen
  std::string refusal;
  try {
    read_text(text, "hostile.toml", overrides, Meshes::leave);
    ADD_FAILURE() << "the scene was accepted: " << text.substr(0, 200);
  } catch (const SceneError& error) {
    refusal = error.what();
  }
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 1.5) << text.substr(0, 200);
  return refusal;
}

void expect_refused(const std::string& text, const std::string& words) {
  const std::string refusal = refusal_of(text);
  EXPECT_NE(refusal.find(words), std::string::npos) << refusal.substr(0, 1000);
  EXPECT_NE(refusal.find("hostile.toml:"), std::string::npos) << refusal.substr(0, 1000);
}

std::string ball(const std::string& keys) { return "[[rigid]]\nname = \"ball\"\n" + keys + "\n"; }

const std::string prefab = "[[prefabs.p.rigid]]\nname = \"b\"\nshape = { sphere = 1 }\nmass = 1\n";

TEST(HostileScenes, MagnitudesBeyondAllBodiesAreRefused) {
  for (const char* size : {"1e300", "1e-300", "1e10", "1e-12"}) {
    expect_refused(ball(std::string("mass = 1\nshape = { sphere = ") + size + " }"),
                   "rigid.ball.shape.sphere: must be between 1e-09 and 1e+09");
    expect_refused(ball(std::string("mass = 1\nshape = { box = [1, ") + size + ", 1] }"),
                   "must be between 1e-09 and 1e+09");
  }
  for (const char* amount : {"1e300", "1e-300"}) {
    expect_refused(ball(std::string("shape = { sphere = 1 }\ndensity = ") + amount), "rigid.ball.density");
    expect_refused(ball(std::string("shape = { sphere = 1 }\nmass = ") + amount), "rigid.ball.mass");
  }
  expect_refused(ball("shape = { sphere = 1 }\nmass = 1\nposition = [0, -1e300, 0]"), "rigid.ball.position");
}

// A time step of 1e-20 s never fills a frame, and neither does one that such numbers make as short.
TEST(HostileScenes, NumbersThatAllowNoTimeStepAreRefused) {
  const std::string material = "[materials.m]\n";
  const std::string spin =
      ball("shape = { sphere = 1 }\nmotion = { spin = [{ axis = [0, 1, 0], rate = 1e30 }] }");
  for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
           {"fps = 1e-9\n", "fps: must be in [0.001, 10000] 1/s, is 1e-09"},
           {"fps = 0\n", "fps: must be in [0.001, 10000]"},
           {material + "youngs_modulus = 1e30\n", "youngs_modulus: must be between 1e-30 and 1e+15"},
           {"[solver]\ncfl = 1e-20\n", "solver.cfl: must be in [1e-06, 1]"},
           {"[solver]\nmax_travel = 1e-20\n", "solver.max_travel: must be in [1e-06, 1]"},
           {"[solver]\nmax_rotation = 1e-20\n", "solver.max_rotation: must be in [1e-06, "},
           {"[solver]\nmax_time_step = 1e-25\n", "max_time_step: must be between 1e-12 and 1e+12"},
           {"gravity = [0, -1e30, 0]\n", "gravity[1]: must be between 1e-30 and 1e+09"},
           {ball("shape = { sphere = 1 }\nmass = 1\nvelocity = [0, 1e29, 0]"),
            "velocity[1]: must be between"},
           {ball("shape = { sphere = 1 }\nmass = 1\nangular_velocity = [0, 1e29, 0]"), "angular_velocity[1]"},
           {spin, "motion.spin[0].rate: must be between 1e-30 and 1e+09"}})
    expect_refused(text, words);
}

// An integer beyond the range of `int` would silently become another one.
TEST(HostileScenes, EveryIntegerKeyHasBoundsWithinThoseOfInt) {
  int integers = 0;
  std::istringstream lines(reference());
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" integer") == std::string::npos || line.find("an integer will do") != std::string::npos)
      continue;
    ++integers;
    const std::size_t begin = line.rfind("in ["), comma = line.rfind(", ");
    ASSERT_NE(begin, std::string::npos) << line;
    EXPECT_GE(std::stod(line.substr(begin + 4)), -2147483648.0) << line;
    EXPECT_LE(std::stod(line.substr(comma + 2)), 2147483647.0) << line;
  }
  EXPECT_GE(integers, 20);
  const std::string instance = "[[instances]]\nname = \"i\"\nprefab = \"p\"\n";
  expect_refused(prefab + instance + "scatter = { count = 1, size = [1, 1, 1] }\nseed = 4294967296\n",
                 "seed");
}

TEST(HostileScenes, GridsAndRepetitionsOfBillionsAreRefused) {
  const std::string instance = "[[instances]]\nname = \"i\"\nprefab = \"p\"\n";
  expect_refused(prefab + instance + "grid = [1300, 1300, 1300]\n", "makes 2.197e+09 copies");
  expect_refused(prefab + "repeat = { count = 100000 }\n" + instance + "grid = [100, 100, 10]\n",
                 "makes 100000 copies of 100000 bodies and joints");
}

TEST(HostileScenes, ParametersThatMultiplyAreRefused) {
  std::string uses, numbers;
  for (int i = 0; i < 9000; ++i) {
    uses += "\"$a\",";
    numbers += "1,";
  }
  expect_refused("[parameters]\na = [" + numbers + "]\n[solver]\ncfl = [" + uses + "]\n",
                 "the parameters fill in more than 1e+06 values");
}

TEST(HostileScenes, KeysOfThousandsOfPartsAreRefused) {
  std::string key = "a";
  for (int i = 0; i < 40000; ++i) key += ".a";
  expect_refused("title = \"x\"\n" + key + " = 1\n",
                 "hostile.toml:2:1: TOML syntax: a key has more than 100");
  expect_refused('[' + key + "]\n", "a key has more than 100 parts");
  expect_refused("camera = { " + key + " = 1 }\n", "a key has more than 100 parts");
  EXPECT_NE(refusal_of("title = \"x\"\n", {key + "=1"}).find("has more than 100 parts"), std::string::npos);
}

}  // namespace
}  // namespace duet::scene::hostile_scene_test
