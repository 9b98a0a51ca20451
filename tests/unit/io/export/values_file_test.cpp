// Tests that the numbers of a run come back to the last bit, and that files that do not belong to the run are
// refused.
#include "sim/io/values_file.h"

#include <bit>
#include <limits>

#include "tests/support/text.h"
#include "tests/unit/io/export/sample_run.h"
#include <gtest/gtest.h>

namespace duet::io::values_file_test {
namespace {

using test::contains;
using test::SampleRun;

template <class Vectors>
void expect_same(const Vectors& a, const Vectors& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]) << i;
}

// Returns the message of the FileError that `work` throws.
template <class Work>
std::string failure(Work work) {
  try {
    work();
  } catch (const FileError& error) {
    EXPECT_EQ(error.status(), ExitStatus::files);
    return error.what();
  }
  ADD_FAILURE() << "no FileError";
  return {};
}

// Checks that a file of frame 1 with these bytes is refused with a message that contains `said`.
void refuse_frame(const SampleRun& sample, const std::string& bytes, const std::string& said) {
  write_atomically(sample.run.values(1), bytes);
  const std::string text = failure([&] { read_values(sample.run, sample.manifest.bodies, 1); });
  EXPECT_TRUE(contains(text, said)) << text;
  EXPECT_TRUE(contains(text, sample.run.values(1).string())) << text;
}

// Checks that a file of surfaces with these bytes is refused with a message that contains `said`.
void refuse_bodies(const SampleRun& sample, const std::string& bytes, const std::string& said) {
  write_atomically(sample.run.body_values(), bytes);
  const std::string text = failure([&] { read_rest_surfaces(sample.run, sample.manifest.bodies); });
  EXPECT_TRUE(contains(text, said)) << text;
}

TEST(ValuesFile, AFrameComesBackToTheBit) {
  const SampleRun sample;
  FrameValues values = sample.values(3);
  values.points[0] =
      Vec3(-0.0, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max());
  values.strain[1] = -std::numeric_limits<float>::max();
  sample.run.write(sample.run.values(3), npy_text(values));
  const FrameValues read = read_values(sample.run, sample.manifest.bodies, 3);
  EXPECT_EQ(read.frame, 3);
  EXPECT_EQ(std::bit_cast<std::uint64_t>(read.time), std::bit_cast<std::uint64_t>(values.time));
  ASSERT_EQ(read.rigid.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.rigid[i].pose.position, values.rigid[i].pose.position);
    EXPECT_EQ(read.rigid[i].pose.orientation.coeffs(), values.rigid[i].pose.orientation.coeffs());
    EXPECT_EQ(read.rigid[i].velocity, values.rigid[i].velocity);
    EXPECT_EQ(read.rigid[i].angular_velocity, values.rigid[i].angular_velocity);
  }
  expect_same(read.points, values.points);
  EXPECT_TRUE(std::signbit(read.points[0].x()));
  expect_same(read.velocities, values.velocities);
  EXPECT_EQ(read.strain, values.strain);
  EXPECT_EQ(read.stress, values.stress);
  EXPECT_EQ(read.energy_density, values.energy_density);
  expect_same(read.contact.rigid_force, values.contact.rigid_force);
  expect_same(read.contact.rigid_torque, values.contact.rigid_torque);
  expect_same(read.contact.force, values.contact.force);
  EXPECT_EQ(read.contact.pressure, values.contact.pressure);
}

// Files of programs that wrote no stress are read as before.
TEST(ValuesFile, FramesWithoutStressAreRead) {
  const SampleRun sample;
  FrameValues values = sample.values(3);
  values.stress.clear();
  values.energy_density.clear();
  sample.run.write(sample.run.values(3), npy_text(values));
  const FrameValues read = read_values(sample.run, sample.manifest.bodies, 3);
  EXPECT_EQ(read.strain, values.strain);
  EXPECT_TRUE(read.stress.empty());
  EXPECT_TRUE(read.energy_density.empty());
  EXPECT_TRUE(read.contact.force.empty());
}

// Files of programs that wrote stress, and no forces of contact, are read as before.
TEST(ValuesFile, FramesWithoutContactAreRead) {
  const SampleRun sample;
  FrameValues values = sample.values(3);
  values.contact = {};
  sample.run.write(sample.run.values(3), npy_text(values));
  const FrameValues read = read_values(sample.run, sample.manifest.bodies, 3);
  EXPECT_EQ(read.stress, values.stress);
  EXPECT_EQ(read.energy_density, values.energy_density);
  EXPECT_TRUE(read.contact.rigid_force.empty());
  EXPECT_TRUE(read.contact.force.empty());
  EXPECT_TRUE(read.contact.pressure.empty());
}

// Pictures show what they are asked for, and nothing if a frame lacks it.
TEST(ValuesFile, ColorsAreThoseOfTheQuantity) {
  const SampleRun sample;
  FrameValues values = sample.values(3);
  std::vector<BodySurface> bodies = sample.bodies;
  const auto second = [](const std::vector<float>& all) { return std::vector(all.begin() + 8, all.end()); };
  take_color(values, sample.manifest.bodies, scene::ColorBy::look, bodies);
  EXPECT_TRUE(bodies[3].surface.shown.empty());
  take_color(values, sample.manifest.bodies, scene::ColorBy::strain, bodies);
  EXPECT_EQ(bodies[3].surface.strain, second(values.strain));
  EXPECT_TRUE(bodies[3].surface.shown.empty());
  take_color(values, sample.manifest.bodies, scene::ColorBy::stress, bodies);
  EXPECT_EQ(bodies[3].surface.shown, second(values.stress));
  take_color(values, sample.manifest.bodies, scene::ColorBy::contact, bodies);
  EXPECT_EQ(bodies[3].surface.shown, second(values.contact.pressure));
  EXPECT_TRUE(bodies[0].surface.shown.empty());
  bodies = sample.bodies;
  values.contact = {};
  take_color(values, sample.manifest.bodies, scene::ColorBy::contact, bodies);
  EXPECT_TRUE(bodies[3].surface.shown.empty());
}

TEST(ValuesFile, SurfacesAtRestComeBackToTheBit) {
  const SampleRun sample;
  const std::vector<BodySurface> read = read_rest_surfaces(sample.run, sample.manifest.bodies);
  ASSERT_EQ(read.size(), sample.bodies.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Surface &a = read[i].surface, &b = sample.bodies[i].surface;
    EXPECT_EQ(read[i].name, sample.bodies[i].name);
    expect_same(a.positions, b.positions);
    expect_same(a.normals, b.normals);
    expect_same(a.uvs, b.uvs);
    ASSERT_EQ(a.triangles.size(), b.triangles.size());
    for (std::size_t t = 0; t < a.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(a.triangles[t][k].position, b.triangles[t][k].position);
        EXPECT_EQ(a.triangles[t][k].uv, b.triangles[t][k].uv);
        EXPECT_EQ(a.triangles[t][k].normal, b.triangles[t][k].normal);
      }
  }
}

// The format of NumPy requires that the length of the head is a multiple of 64. Here it is followed by the
// frame and its time, 2 rigid bodies of 19 doubles, and 16 points.
TEST(ValuesFile, HeadsAreThoseOfNumPy) {
  const SampleRun sample;
  const std::string frame = npy_text(sample.values(0));
  EXPECT_TRUE(frame.starts_with("\x93NUMPY"));
  const std::size_t head =
      10 + static_cast<unsigned char>(frame[8]) + 256 * static_cast<unsigned char>(frame[9]);
  EXPECT_EQ(head % 64, 0U);
  EXPECT_EQ(frame[head - 1], '\n');
  EXPECT_EQ(frame.size() - head, 16 + 2 * 19 * 8 + 16 * (3 * 8 + 10 * 4));
}

TEST(ValuesFile, DamagedFramesAreRefused) {
  const SampleRun sample;
  const std::string whole = read_file(sample.run.values(1));
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, whole.size() / 2, whole.size() - 1})
    refuse_frame(sample, whole.substr(0, size), "manifest.json lists");
  refuse_frame(sample, whole + "x", "manifest.json lists");
  std::string other = whole;
  other[whole.find("'position'") + 1] = 'P';
  refuse_frame(sample, other, "manifest.json lists");
  refuse_frame(sample, read_file(sample.run.values(2)), "holds the values of frame 2");
  fs::remove(sample.run.values(1));
  EXPECT_TRUE(contains(failure([&] { read_values(sample.run, sample.manifest.bodies, 1); }), "is missing"));
}

TEST(ValuesFile, ForgedFramesAreRefused) {
  const SampleRun sample;
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  const auto refuse = [&](const auto& forge) {
    FrameValues values = sample.values(1);
    forge(values);
    refuse_frame(sample, npy_text(values), "not finite");
  };
  refuse([&](FrameValues& v) { v.time = nan; });
  refuse([&](FrameValues& v) { v.rigid[1].pose.position.z() = infinite; });
  refuse([&](FrameValues& v) { v.rigid[0].pose.orientation.coeffs().setZero(); });
  refuse([&](FrameValues& v) { v.rigid[0].pose.orientation.coeffs() *= 2; });
  refuse([&](FrameValues& v) { v.rigid[0].pose.orientation.x() = nan; });
  refuse([&](FrameValues& v) { v.rigid[0].velocity.x() = nan; });
  refuse([&](FrameValues& v) { v.rigid[1].angular_velocity.y() = -infinite; });
  refuse([&](FrameValues& v) { v.points.back().z() = nan; });
  refuse([&](FrameValues& v) { v.velocities[3].x() = static_cast<float>(nan); });
  refuse([&](FrameValues& v) { v.strain[0] = static_cast<float>(infinite); });
  refuse([&](FrameValues& v) { v.stress[1] = static_cast<float>(nan); });
  refuse([&](FrameValues& v) { v.energy_density[2] = static_cast<float>(infinite); });
  refuse([&](FrameValues& v) { v.contact.rigid_force[1].x() = nan; });
  refuse([&](FrameValues& v) { v.contact.rigid_torque[0].y() = infinite; });
  refuse([&](FrameValues& v) { v.contact.force[3].z() = static_cast<float>(nan); });
  refuse([&](FrameValues& v) { v.contact.pressure[4] = static_cast<float>(infinite); });
  FrameValues fewer = sample.values(1);
  fewer.points.pop_back();
  fewer.velocities.pop_back();
  fewer.strain.pop_back();
  fewer.stress.pop_back();
  fewer.energy_density.pop_back();
  fewer.contact.force.pop_back();
  fewer.contact.pressure.pop_back();
  refuse_frame(sample, npy_text(fewer), "manifest.json lists");
}

TEST(ValuesFile, ForgedSurfacesAreRefused) {
  const SampleRun sample;
  const auto refuse = [&](const auto& forge, const std::string& said) {
    std::vector<BodySurface> bodies = sample.bodies;
    forge(bodies);
    refuse_bodies(sample, npy_text(bodies), said);
  };
  for (const int index : {-1, 8, std::numeric_limits<int>::max()}) {
    refuse([&](auto& bodies) { bodies[0].surface.triangles[3][1].position = index; },
           "`block` does not have");
    refuse([&](auto& bodies) { bodies[2].surface.triangles[0][2].normal = index; }, "`jelly` does not have");
    refuse([&](auto& bodies) { bodies[1].surface.triangles[0][0].uv = index; }, "`wall` does not have");
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refuse([&](auto& bodies) { bodies[1].surface.positions[2].y() = nan; }, "`wall` that are not finite");
  refuse([&](auto& bodies) { bodies[1].surface.normals[2].y() = nan; }, "`wall` that are not finite");
  refuse([&](auto& bodies) { bodies[3].surface.uvs[2].y() = nan; }, "`jelly.2` that are not finite");
  refuse([&](auto& bodies) { bodies[0].surface.triangles.pop_back(); }, "manifest.json lists");
  refuse([&](auto& bodies) { bodies.pop_back(); }, "manifest.json lists");
}

}  // namespace
}  // namespace duet::io::values_file_test
