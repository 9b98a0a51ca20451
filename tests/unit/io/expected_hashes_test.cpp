#include "sim/io/expected_hashes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::io::expected_hashes_test {
namespace {

BodyHashes rigid(const std::string& name, std::uint64_t hash) {
  return {Owner::rigid, name, {{"position", hash}, {"velocity", hash + 1}}};
}

std::vector<BodyHashes> few() {
  return {rigid("box", 10),
          rigid("ball", 20),
          {Owner::deformable, "scene", {{"positions", 30}}},
          {Owner::scene, {}, {{"contact cache", 40}}}};
}

// Returns hashes of 30 pairs of jointed links, a floor, and the scene.
std::vector<BodyHashes> many() {
  std::vector<BodyHashes> bodies;
  for (std::uint64_t i = 1; i <= 30; ++i) {
    bodies.push_back(rigid(fmt::format("loop{}-link1", i), 1000 * i));
    bodies.push_back(rigid(fmt::format("loop{}-link2", i), 1000 * i + 500));
  }
  bodies.push_back(rigid("floor", 7));
  bodies.push_back({Owner::scene, {}, {{"contact cache", 40}}});
  return bodies;
}

FrameHashes frame(int number, std::uint64_t whole, const std::vector<BodyHashes>& bodies,
                  std::size_t max_lines = 100) {
  return {number, whole_hash(whole), hash_lines(bodies, max_lines)};
}

// Returns the hashes of a frame after they were written to a file and read again.
FrameHashes committed(const FrameHashes& frame) {
  const ScratchFolder scratch;
  write_atomically(scratch / "a.txt", expected_text("about", {frame}));
  return read_expected(scratch / "a.txt").at(0);
}

TEST(ExpectedHashes, AreReadAsTheyWereWritten) {
  const FrameHashes first{0, whole_hash(1), {}}, second = frame(3, 0xabc, few());
  const ScratchFolder scratch;
  write_atomically(scratch / "a.txt", expected_text("two\nlines", {first, second}));
  EXPECT_TRUE(read_file(scratch / "a.txt")
                  .starts_with("# two\n# lines\nframe 0 0000000000000001\nframe 3 0000000000000abc\n  rigid "
                               "box 0000000a 0000000b\n"))
      << read_file(scratch / "a.txt");
  const std::vector<FrameHashes> read = read_expected(scratch / "a.txt");
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].whole, first.whole);
  EXPECT_TRUE(read[0].lines.empty());
  EXPECT_EQ(read[1].frame, 3);
  ASSERT_EQ(read[1].lines.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read[1].lines[i].label, second.lines[i].label);
    EXPECT_EQ(read[1].lines[i].hashes, second.lines[i].hashes);
  }
  EXPECT_FALSE(compare_hashes(read[1], second));
}

TEST(ExpectedHashes, NamesMayHoldBlanksQuotesAndControlCharacters) {
  const std::vector<std::string> names = {"my ball", "",      " x ",      "a\tb\nc", "\"",         "a\\",
                                          "\\x1b",   "\x1b[", "deadbeef", "a\" b",   "two  blanks"};
  std::vector<BodyHashes> bodies;
  for (const std::string& name : names) bodies.push_back(rigid(name, 10));
  const FrameHashes expected = committed(frame(3, 1, bodies));
  ASSERT_EQ(expected.lines.size(), names.size());
  EXPECT_EQ(expected.lines[0].label, "rigid \"my ball\"");
  EXPECT_EQ(expected.lines[8].label, "rigid deadbeef") << "plain words stand as they are";
  for (const HashLine& line : expected.lines) EXPECT_EQ(line.hashes.size(), 2U) << line.label;
  EXPECT_FALSE(compare_hashes(expected, frame(3, 1, bodies)));
  bodies[0].quantities[1].hash = 99;
  EXPECT_EQ(compare_hashes(expected, frame(3, 2, bodies))->text(), "frame 3: velocity of `my ball`");
  bodies[0].quantities[1].hash = 11;
  bodies[9].quantities[0].hash = 99;
  EXPECT_EQ(compare_hashes(expected, frame(3, 2, bodies))->text(), "frame 3: position of `a\" b`");

  std::vector<BodyHashes> alike;
  for (std::uint64_t i = 0; i < 20; ++i) alike.push_back(rigid(fmt::format("my ball {}", i), i));
  const FrameHashes grouped = committed(frame(1, 1, alike, 10));
  EXPECT_EQ(grouped.lines.at(0).label, "group rigid \"my ball *\" 20");
  EXPECT_FALSE(compare_hashes(grouped, frame(1, 1, alike, 10)));
  alike[13].quantities[0].hash = 99;
  EXPECT_EQ(compare_hashes(grouped, frame(1, 2, alike, 10))->text(), "frame 1: position of `my ball 13`");
}

TEST(ExpectedHashes, NameTheBodyAndItsFirstQuantityThatDiffer) {
  const FrameHashes expected = committed(frame(3, 1, few()));
  std::vector<BodyHashes> bodies = few();
  bodies[1].quantities[1].hash = 99;
  bodies[2].quantities[0].hash = 99;
  bodies[3].quantities[0].hash = 99;
  const auto difference = compare_hashes(expected, frame(3, 2, bodies));
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->body, "ball");
  EXPECT_EQ(difference->quantity, "velocity");
  EXPECT_EQ(difference->bodies, 2);
  EXPECT_EQ(difference->text(), "frame 3: velocity of `ball` (and 1 more bodies)");
}

TEST(ExpectedHashes, TellTheSceneFromABodyOfThatName) {
  const FrameHashes expected = committed(frame(3, 1, few()));
  std::vector<BodyHashes> bodies = few();
  bodies[3].quantities[0].hash = 99;
  EXPECT_EQ(compare_hashes(expected, frame(3, 2, bodies))->text(), "frame 3: contact cache");
  bodies = few();
  bodies[2].quantities[0].hash = 99;
  EXPECT_EQ(compare_hashes(expected, frame(3, 2, bodies))->text(), "frame 3: positions of `scene`");
}

TEST(ExpectedHashes, DifferWithTheWholeStateAlone) {
  const FrameHashes expected{3, whole_hash(1), {}}, found{3, whole_hash(2), {}};
  EXPECT_FALSE(compare_hashes(expected, expected));
  EXPECT_EQ(compare_hashes(expected, found)->text(), "frame 3: the state");
}

TEST(ExpectedHashes, OfManyBodiesAreGroupedAndStillNameOne) {
  const std::vector<HashLine> lines = hash_lines(many(), 20);
  EXPECT_EQ(lines.size(), 8U) << "a group, its five rows of bodies, floor, scene";
  EXPECT_EQ(lines[0].label, "group rigid loop*-link* 60");
  const FrameHashes expected = committed(frame(1, 1, many(), 20));
  EXPECT_FALSE(compare_hashes(expected, frame(1, 1, many(), 20)));
  std::vector<BodyHashes> bodies = many();
  bodies[25].quantities[1].hash = 99;
  const auto difference = compare_hashes(expected, frame(1, 2, bodies, 20));
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->body, "loop13-link2");
  EXPECT_EQ(difference->quantity, "velocity");
  EXPECT_EQ(difference->bodies, 1);
}

// If there are more than 100 bodies, those whose names differ only in digits are grouped. The bound of 100 kB
// keeps files of expected hashes small enough for the repository.
TEST(ExpectedHashes, OfFortyHundredBodiesFitIntoHundredKilobytes) {
  std::vector<BodyHashes> bodies;
  for (std::uint64_t i = 0; i < 4000; ++i) bodies.push_back(rigid(fmt::format("ball{}", i), i));
  EXPECT_LT(expected_text("about", {frame(1, 1, bodies), frame(9, 1, bodies)}).size(), 100000U);
}

TEST(ExpectedHashes, DifferWhereBodiesCameOrWent) {
  const FrameHashes expected = committed(frame(3, 1, few()));
  std::vector<BodyHashes> bodies = few();
  bodies.erase(bodies.begin() + 1);
  const auto difference = compare_hashes(expected, frame(3, 1, bodies));
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->text(), "frame 3: the list of bodies (`deformable scene` where `rigid ball` was)");
  EXPECT_TRUE(compare_hashes(committed(frame(3, 1, bodies)), frame(3, 1, few())));
}

TEST(ExpectedHashes, OfADamagedFileAreErrors) {
  const ScratchFolder scratch;
  EXPECT_THROW(read_expected(scratch / "missing.txt"), FileError);
  for (const char* text :
       {"", "# nothing\n", "frame 1\n", "frame x 0000000000000001\n", "frame 1 12\n",
        "  rigid box 0000000a\n", "frame 1 0000000000000001\n  rigid box\n",
        "frame 1 0000000000000001\n  rigid box 0000\n",
        "frame 1 0000000000000001\n  rigid \"my box 0000000a\n",
        "frame 1 0000000000000001\n  rigid my box 0000000a\n", "frame 1 0000000000000001\n  group\n"}) {
    write_atomically(scratch / "a.txt", text);
    EXPECT_THROW(read_expected(scratch / "a.txt"), FileError) << text;
  }
}

}  // namespace
}  // namespace duet::io::expected_hashes_test
