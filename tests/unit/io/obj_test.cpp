#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/run_directory.h"

namespace duet::io::obj_test {
namespace {

std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

// Returns a finite float with random bits, so that all exponents are equally likely.
float any_float(std::mt19937& random) {
  while (true) {
    const float value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (std::isfinite(value)) return value;
  }
}

// Returns a body about 6 m wide around the origin, with random positions, normals and texture coordinates.
BodySurface body(const std::string& name, int triangles, std::mt19937& random) {
  BodySurface result{name, {}};
  Surface& surface = result.surface;
  std::uniform_real_distribution<double> place(-3, 3);
  for (int i = 0; i < 2 * triangles + 1; ++i)
    surface.positions.emplace_back(place(random), place(random), place(random));
  for (int i = 0; i < triangles; ++i) {
    surface.normals.emplace_back(any_float(random), any_float(random), any_float(random));
    surface.uvs.emplace_back(any_float(random), any_float(random));
    surface.triangles.push_back(
        {Corner{2 * i, i, i / 2}, Corner{2 * i + 1, i / 3, i}, Corner{2 * i + 2, 0, 0}});
  }
  return result;
}

template <class Vector>
void expect_same_bits(const std::vector<Vector>& a, const std::vector<Vector>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int k = 0; k < a[i].size(); ++k) EXPECT_EQ(bits(a[i][k]), bits(b[i][k])) << "element " << i;
}

// Normals, texture coordinates and indices come back to the last bit. Positions come back up to half of the
// last place of a float for a body 6 m wide: 6 * 2^-25 m.
TEST(Obj, RoundTripKeepsAllButTheLastDigitsOfPositions) {
  const ScratchFolder scratch;
  std::mt19937 random(7);
  std::vector<BodySurface> bodies = {body("ball", 300, random), body("soft box, 2", 50, random)};
  bodies[0].surface.normals[0] = Vec3f(-0.0F, std::numeric_limits<float>::denorm_min(), 0.1F);
  bodies[0].surface.normals[1] = Vec3f::Constant(std::numeric_limits<float>::lowest());
  write_obj(scratch / "0000.obj", bodies);
  const std::vector<BodySurface> read = read_obj(scratch / "0000.obj");
  ASSERT_EQ(read.size(), bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    EXPECT_EQ(read[i].name, bodies[i].name);
    const Surface &a = read[i].surface, &b = bodies[i].surface;
    ASSERT_EQ(a.positions.size(), b.positions.size());
    for (std::size_t k = 0; k < a.positions.size(); ++k)
      EXPECT_LT((a.positions[k] - b.positions[k]).cwiseAbs().maxCoeff(), 6 * 0x1p-25);
    expect_same_bits(a.normals, b.normals);
    expect_same_bits(a.uvs, b.uvs);
    ASSERT_EQ(a.triangles.size(), b.triangles.size());
    for (std::size_t t = 0; t < a.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(a.triangles[t][k].position, b.triangles[t][k].position);
        EXPECT_EQ(a.triangles[t][k].uv, b.triangles[t][k].uv);
        EXPECT_EQ(a.triangles[t][k].normal, b.triangles[t][k].normal);
      }
  }
}

TEST(Obj, WhatWasReadIsWrittenAgainAsItWas) {
  const ScratchFolder scratch;
  std::mt19937 random(8);
  write_obj(scratch / "0000.obj", {body("ball", 30, random)});
  write_obj(scratch / "0001.obj", read_obj(scratch / "0000.obj"));
  EXPECT_EQ(read_file(scratch / "0001.obj"), read_file(scratch / "0000.obj"));
}

// Positions are rounded to the precision of a float relative to the size of the body, and to 1e-6 m at most,
// wherever the body is. Doubles at 10 km add 2e-12 m.
TEST(Obj, PositionsAreAsPreciseFarFromTheOrigin) {
  const ScratchFolder scratch;
  std::mt19937 random(9);
  for (const double size : {1e-4, 1.0, 30.0, 1e4})
    for (const Vec3& center : {Vec3(0, 0, 0), Vec3(1e4, -1e4, 3e3)}) {
      std::vector<BodySurface> bodies = {body("ball", 20, random)};
      for (Vec3& x : bodies[0].surface.positions) x = center + size / 6 * x;
      write_obj(scratch / "0000.obj", bodies);
      const std::vector<Vec3> read = read_obj(scratch / "0000.obj")[0].surface.positions;
      const double most = std::min(1e-6, size * 0x1p-24) / 2 + 2e-12;
      for (std::size_t k = 0; k < read.size(); ++k)
        EXPECT_LT((read[k] - bodies[0].surface.positions[k]).cwiseAbs().maxCoeff(), most) << size;
    }
}

TEST(Obj, PositionsHaveNoMoreDigitsThanTheySay) {
  const ScratchFolder scratch;
  const double third = 1.0 / 3;
  const Surface triangle{{{10000 + third, third, -1e-12}, {10001, third, 0}, {10000, 0.1, third}},
                         {{0, 0, 1}},
                         {{0, 0}},
                         {{Corner{}, Corner{1}, Corner{2}}}};
  write_obj(scratch / "0000.obj", {{"a", triangle}});
  const std::string text = read_file(scratch / "0000.obj");
  EXPECT_NE(text.find("\nv 10000.33333333 0.33333333 0\nv 10001 0.33333333 0\nv 10000 0.1 0.33333333\n"),
            std::string::npos)
      << text;
}

// Runs of earlier versions hold floats in their shortest form, and other programs write more digits.
TEST(Obj, ReadsFilesWithAnyNumberOfDigits) {
  const ScratchFolder scratch;
  write_atomically(scratch / "0000.obj", "o a\nv 0.1 -1e-07 12345.679\nv 0.12345678901234567 1e+30 -0\n");
  const std::vector<Vec3> read = read_obj(scratch / "0000.obj")[0].surface.positions;
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0], Vec3(0.1, -1e-7, 12345.679));
  EXPECT_EQ(read[1], Vec3(0.12345678901234567, 1e30, 0));
}

// The text is what other programs expect: indices count from one through the whole file, and numbers are in
// their shortest form.
TEST(Obj, TextIsPlainObj) {
  const ScratchFolder scratch;
  const Surface triangle{{{0, 0, 0}, {0.1, 0, 0}, {0, 1e-7, 0}},
                         {{0, 0, 1}},
                         {{0, 0.5F}},
                         {{Corner{0, 0, 0}, Corner{1, 0, 0}, Corner{2, 0, 0}}}};
  write_obj(scratch / "0000.obj", {{"a", triangle}, {"b", triangle}});
  const std::string vertices = "v 0 0 0\nv 0.1 0 0\nv 0 1e-07 0\nvt 0 0.5\nvn 0 0 1\n";
  EXPECT_EQ(read_file(scratch / "0000.obj"),
            "# Duet frame: metres; y up, right-handed; one object a body, constant vertex order\n"
            "o a\n" +
                vertices + "f 1/1/1 2/1/1 3/1/1\n" + "o b\n" + vertices + "f 4/2/2 5/2/2 6/2/2\n");
}

TEST(Obj, HoldsNoStrain) {
  const ScratchFolder scratch;
  Surface triangle{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}}, {{0, 0}}, {{Corner{}, Corner{1}, Corner{2}}}};
  const std::string text = obj_text({{"a", triangle}});
  triangle.strain = {0.25F, -1, 0};
  EXPECT_EQ(obj_text({{"a", triangle}}), text);
}

// Earlier versions of Duet wrote the strain into OBJ files, in lines of any length. It is still read.
TEST(Obj, ReadsStrainOfEarlierVersions) {
  const ScratchFolder scratch;
  std::vector<float> strain;
  std::string positions, line = "# strain", lines;
  for (int i = 0; i < 20000; ++i) {
    strain.push_back(-1.1754945e-38F - 1e-20F * static_cast<float>(i));
    positions += "v 0 0 0\n";
    line += fmt::format(" {}", strain.back());
    lines += fmt::format("# strain {}\n", strain.back());
  }
  write_atomically(scratch / "0000.obj", "o a\n" + positions + line + "\n");
  EXPECT_EQ(read_obj(scratch / "0000.obj")[0].surface.strain, strain);
  write_atomically(scratch / "0000.obj", "o a\n" + positions + lines);
  EXPECT_EQ(read_obj(scratch / "0000.obj")[0].surface.strain, strain);
}

// Blender's importer gives up on lines of more than 65,536 characters.
TEST(Obj, NoLineIsLongerThanAThousandCharacters) {
  Surface surface{{}, {{0, 0, 1}}, {{0, 0}}, {{Corner{}, Corner{1}, Corner{2}}}};
  for (int i = 0; i < 20000; ++i) {
    surface.positions.push_back(Vec3(i, -1e30, 1e-30));
    surface.strain.push_back(-1.1754945e-38F);
  }
  const std::string text = obj_text({{"a", surface}, {"b", surface}});
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end + 1) {
    end = text.find('\n', begin);
    ASSERT_LT(end - begin, 1000U);
  }
}

std::string failure_of(const ScratchFolder& scratch, const std::string& text) {
  write_atomically(scratch / "0000.obj", text);
  try {
    read_obj(scratch / "0000.obj");
  } catch (const FileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Obj, MalformedLinesAreErrorsWithTheirLine) {
  const ScratchFolder scratch;
  const std::string head = "o a\nv 0 0 0\nvt 0 0\nvn 0 0 1\n";  // The head has 4 lines.
  for (const char* line : {"v 1 2",
                           "v 1 2 x",
                           "v 1 2 nan",
                           "v 1 2 inf",
                           "v 1 2 1e99",
                           "v 1 2 3 4",
                           "v",
                           "vt 1",
                           "vn 0 0",
                           "f 1/1/1 1/1/1",
                           "f 1/1/1 1/1/1 1/1",
                           "f 1 1 1",
                           "f 1//1 1//1 1//1",
                           "f 1/1/1 1/1/1 2/1/1",
                           "f 0/1/1 1/1/1 1/1/1",
                           "f -1/1/1 1/1/1 1/1/1",
                           "f 1/1/1 1/2/1 1/1/1",
                           "f 1/1/1 1/1/1 1/1/1 1/1/1",
                           "f 1/1/1 1/1/1 99999999999/1/1",
                           "usemtl red",
                           "o",
                           "o ",
                           "xyz"}) {
    const std::string text = failure_of(scratch, head + line + "\n");
    EXPECT_NE(text.find("0000.obj: line 5: "), std::string::npos) << line << " -> " << text;
  }
  EXPECT_NE(failure_of(scratch, "v 0 0 0\n").find("line 1: "), std::string::npos);
}

// The strain in a file of an earlier version has one number for each vertex of its own body. Anything else is
// an error that names the line.
TEST(Obj, StrainOfOldFilesCoversAllVertices) {
  const ScratchFolder scratch;
  EXPECT_NE(failure_of(scratch, "o a\nv 0 0 0\nv 0 0 0\n# strain 1\n")
                .find("line 4: object `a` has 2 vertices and the strain of 1"),
            std::string::npos);
  EXPECT_NE(failure_of(scratch, "o a\nv 0 0 0\nv 0 0 0\n# strain 1\no b\n")
                .find("line 5: object `a` has 2 vertices and the strain of 1"),
            std::string::npos);
  EXPECT_NE(failure_of(scratch, "o a\nv 0 0 0\n# strain x\n").find("line 3: expected a number"),
            std::string::npos);
  EXPECT_NE(failure_of(scratch, "o a\nv 0 0 0\n# strain 1 2\n").find("line 3: unexpected `2`"),
            std::string::npos);
  EXPECT_NE(failure_of(scratch, "# strain 1\n").find("line 1: no object yet"), std::string::npos);
}

TEST(Obj, IndicesOfAnotherBodyAreErrors) {
  const ScratchFolder scratch;
  const std::string vertices = "v 0 0 0\nvt 0 0\nvn 0 0 1\n";
  const std::string text =
      failure_of(scratch, "o a\n" + vertices + "o b\n" + vertices + "f 1/1/1 2/2/2 2/2/2\n");
  EXPECT_NE(text.find("line 9: "), std::string::npos) << text;
}

TEST(Obj, AFileThatEndsWithinALineIsAnError) {
  const ScratchFolder scratch;
  std::mt19937 random(3);
  write_obj(scratch / "whole.obj", {body("a", 2, random)});
  const std::string whole = read_file(scratch / "whole.obj");
  for (std::size_t size = 1; size < whole.size(); ++size) {
    if (whole[size - 1] == '\n') continue;
    EXPECT_NE(failure_of(scratch, whole.substr(0, size)).find("ends within a line"), std::string::npos)
        << size;
  }
}

// Whatever bytes are damaged, the reader returns or throws a FileError. The sanitizers watch for reads out of
// range.
TEST(Obj, DamagedBytesNeverBreakTheReader) {
  const ScratchFolder scratch;
  std::mt19937 random(11);
  write_obj(scratch / "whole.obj", {body("a", 4, random), body("b", 4, random)});
  const std::string whole = read_file(scratch / "whole.obj");
  int errors = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 3; ++k) damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    if (failure_of(scratch, damaged) != "no error") ++errors;
  }
  EXPECT_GT(errors, 1000);
}

}  // namespace
}  // namespace duet::io::obj_test
