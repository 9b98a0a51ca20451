// Tests that a damaged scene file gives a scene or a SceneError with places, and never anything else.
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "tests/support/places.h"
#include "tests/unit/scene/same_scene.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::mutation_test {
namespace {

std::string stack_text() {
  std::ifstream file(test::source_folder() + "/scenes/stack.toml", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Reads the text and returns whether it was accepted. A scene that is accepted must also survive being
// written and read again.
bool read_damaged(const std::string& text) {
  try {
    read_text(text, "damaged.toml");
  } catch (const SceneError& error) {
    EXPECT_FALSE(error.problems().empty());
    for (const SceneProblem& problem : error.problems()) {
      EXPECT_GE(problem.line, 0);
      EXPECT_FALSE(problem.message.empty());
    }
    return false;
  }
  const ReadResult changed = read_text(text, "damaged.toml", {"render.width=641"});
  expect_same_scene(changed.scene, read_text(changed.source, "again.toml").scene);
  return true;
}

TEST(DamagedScene, TruncatedTextIsASceneOrAnError) {
  const std::string text = stack_text();
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) read_damaged(text.substr(0, random() % text.size()));
}

TEST(DamagedScene, MutatedTextIsASceneOrAnError) {
  const std::string text = stack_text();
  std::mt19937 random(2);
  // Bytes that mean something to TOML reach more branches of the reader than arbitrary ones.
  const std::string telling = "[]{}=.,\"'#-+e0123456789 \n\t\\_azAZ";
  int accepted = 0;
  for (int i = 0; i < 600; ++i) {
    std::string damaged = text;
    for (unsigned n = 1 + random() % 3; n > 0; --n) {
      const std::size_t at = random() % damaged.size();
      const char byte =
          random() % 4 == 0 ? static_cast<char>(random() % 256) : telling[random() % telling.size()];
      switch (random() % 3) {
        case 0:
          damaged[at] = byte;
          break;
        case 1:
          damaged.insert(at, 1, byte);
          break;
        default:
          damaged.erase(at, 1 + random() % 4);
      }
    }
    SCOPED_TRACE(i);
    accepted += read_damaged(damaged) ? 1 : 0;
  }
  // A changed digit leaves a valid scene. If nothing were accepted, the mutations would only test the TOML
  // parser.
  EXPECT_GT(accepted, 30);
  EXPECT_LT(accepted, 570);
}

TEST(DamagedScene, AnyTypeForAnyKeyIsASceneOrAnError) {
  const std::string text = stack_text();
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    const std::size_t equals = text.find(" = ", begin);
    if (equals < end)
      for (const char* value : {"1", "-1", "0.5", "nan", "\"\"", "\"word\"", "true", "[]", "[1, 2, 3]", "{}",
                                "[{}]", "2024-01-01", "{ box = 3 }", "1e300", "9223372036854775807"})
        read_damaged(text.substr(0, equals + 3) + value + text.substr(end));
    begin = end + 1;
  }
}

}  // namespace
}  // namespace duet::scene::mutation_test
