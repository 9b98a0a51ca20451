// Tests of a run as exporters see it: with the bodies and frames that were asked for, in the axes and the
// unit of length that were asked for.
#include "sim/io/export/exported_run.h"

#include <numbers>

#include "tests/support/text.h"
#include "tests/unit/io/export/sample_run.h"
#include <gtest/gtest.h>

namespace duet::io::exported_run_test {
namespace {

using test::contains;
using test::SampleRun;

std::vector<std::string> names_of(const ExportedRun& run) {
  std::vector<std::string> names;
  for (const ExportedBody& body : run.bodies()) names.push_back(body.name);
  return names;
}

// Returns the message of the Error that `work` throws, and checks that its status is `usage`.
template <class Work>
std::string usage_error(Work work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    return error.what();
  }
  ADD_FAILURE() << "no Error";
  return {};
}

TEST(ExportedRun, PatternsMatchNames) {
  for (const auto& [pattern, name] : std::vector<std::pair<const char*, const char*>>{{"ball", "ball"},
                                                                                      {"*", ""},
                                                                                      {"*", "ball"},
                                                                                      {"b*", "ball"},
                                                                                      {"*l", "ball"},
                                                                                      {"b*l", "ball"},
                                                                                      {"*a*", "ball"},
                                                                                      {"**b**", "ball"},
                                                                                      {"a*b*c", "a.b.b.c"},
                                                                                      {"*aab", "aaab"},
                                                                                      {"", ""}})
    EXPECT_TRUE(matches(pattern, name)) << pattern << " " << name;
  for (const auto& [pattern, name] : std::vector<std::pair<const char*, const char*>>{{"", "ball"},
                                                                                      {"ball", ""},
                                                                                      {"ball", "ball2"},
                                                                                      {"ball2", "ball"},
                                                                                      {"b*a", "ball"},
                                                                                      {"Ball", "ball"},
                                                                                      {"?all", "ball"},
                                                                                      {"*aab", "aaba"},
                                                                                      {"a*b*c", "acb"}})
    EXPECT_FALSE(matches(pattern, name)) << pattern << " " << name;
  const std::string many(5000, 'a'), stars = "*a*a*a*a*a*a*a*a*a*a*a*b";
  EXPECT_FALSE(matches(stars, many)) << "and in no time";
}

TEST(ExportedRun, HasTheBodiesAskedFor) {
  const SampleRun sample;
  using Names = std::vector<std::string>;
  EXPECT_EQ(names_of(sample.exported()), (Names{"block", "wall", "jelly", "jelly.2"}));
  EXPECT_EQ(names_of(sample.exported({{"jelly*"}, {}, {}})), (Names{"jelly", "jelly.2"}));
  EXPECT_EQ(names_of(sample.exported({{"*.2", "wall"}, {}, {}})), (Names{"wall", "jelly.2"}));
  EXPECT_TRUE(contains(usage_error([&] {
                         sample.exported({{"wall", "blok"}, {}, {}});
                       }),
                       "did you mean `block`?"));
  EXPECT_TRUE(contains(usage_error([&] { sample.exported({{"q*"}, {}, {}}); }), "--bodies q*: no body"));
  // The values of a body do not depend on which other bodies are chosen.
  const ExportedRun all = sample.exported(), one = sample.exported({{"jelly.2"}, {}, {}});
  Surface a = all.bodies()[3].rest, b = one.bodies()[0].rest;
  place(all.bodies()[3], all.read(2), a);
  place(one.bodies()[0], one.read(2), b);
  for (std::size_t i = 0; i < a.positions.size(); ++i) EXPECT_EQ(a.positions[i], b.positions[i]);
}

TEST(ExportedRun, NamesFramesThatAreMissing) {
  const SampleRun sample;
  using Frames = std::vector<int>;
  EXPECT_EQ(sample.exported().frames(), (Frames{0, 1, 2, 3, 4, 5}));
  EXPECT_TRUE(sample.exported().missing().empty());
  for (int frame : {0, 2, 3}) fs::remove(sample.run.values(frame));
  write_atomically(sample.run.root / "values" / "0007.npy.tmp42", "in hand");
  EXPECT_EQ(sample.exported().frames(), (Frames{1, 4, 5}));
  EXPECT_EQ(sample.exported().missing(), (Frames{2, 3})) << "a run may begin later";
  EXPECT_EQ(sample.exported({{}, 0, 4}).frames(), (Frames{1, 4}));
  EXPECT_EQ(sample.exported({{}, 0, 4}).missing(), (Frames{0, 2, 3}));
  EXPECT_EQ(sample.exported({{}, 4, 7}).missing(), (Frames{6, 7}));
  const std::string none = usage_error([&] { sample.exported({{}, 2, 3}); });
  EXPECT_TRUE(contains(none, "it has frames 1 to 5")) << none;
  for (int frame : {1, 4, 5}) fs::remove(sample.run.values(frame));
  EXPECT_TRUE(contains(usage_error([&] { sample.exported(); }), "it has no frame at all"));
  fs::remove(sample.run.body_values());
  EXPECT_THROW(sample.exported(), FileError);
}

TEST(ExportedRun, PlacesBodiesByTheirPoses) {
  const SampleRun sample;
  const ExportedRun run = sample.exported();
  const FrameValues values = sample.values(4), read = run.read(4);
  for (std::size_t b = 0; b < 2; ++b) {
    Surface surface = run.bodies()[b].rest;
    place(run.bodies()[b], read, surface);
    const Surface& rest = sample.bodies[b].surface;
    for (std::size_t i = 0; i < rest.positions.size(); ++i)
      EXPECT_LT((surface.positions[i] - values.rigid[b].pose.to_world(rest.positions[i])).norm(), 1e-15);
    for (std::size_t i = 0; i < rest.normals.size(); ++i)
      EXPECT_LT((surface.normals[i].cast<double>() -
                 values.rigid[b].pose.orientation * rest.normals[i].cast<double>())
                    .norm(),
                1e-6);
  }
  Surface jelly = run.bodies()[3].rest;
  place(run.bodies()[3], read, jelly);
  Surface expected = jelly;
  update_normals(expected);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(jelly.positions[i], values.points[8 + i]);
    EXPECT_EQ(jelly.normals[i], expected.normals[i]);
  }
}

// The velocity at a frame equals the central difference of positions, (x(t + h) - x(t - h)) / (2 h), up to
// terms of order h^2. With h = 1 ms and motions at a few rad/s these are about 1e-6 m/s, far below the bound
// of 2e-4 m/s. Positions are scaled by 100.
TEST(ExportedRun, VelocitiesAreThoseOfThePositions) {
  const SampleRun sample;
  for (const char up : {'y', 'z'}) {
    const ExportedRun run = sample.exported({{}, {}, {}, up, 100});
    const FrameValues before = run.read(1), now = run.read(2), after = run.read(3);
    for (const ExportedBody& body : run.bodies()) {
      Surface a = body.rest, b = body.rest;
      place(body, before, a);
      place(body, after, b);
      std::vector<Vec3f> v;
      velocities(body, now, v);
      ASSERT_EQ(v.size(), a.positions.size());
      for (std::size_t i = 0; i < v.size(); ++i) {
        const Vec3 difference = (b.positions[i] - a.positions[i]) * SampleRun::fps / 2;
        EXPECT_LT((v[i].cast<double>() - difference).norm(), 100 * 2e-4) << body.name << " " << i;
      }
    }
  }
}

// Placing a body and then turning and scaling it gives the same as turning and scaling it and then placing
// it. This holds for positions, normals, velocities, and the axes that the quaternion turns.
TEST(ExportedRun, AxesAndScaleActOnAllAlike) {
  const SampleRun sample;
  const ExportedRun plain = sample.exported();
  for (const double scale : {1.0, 0.01, 39.37}) {
    const ExportedRun turned = sample.exported({{}, {}, {}, 'z', scale});
    EXPECT_LT((turned.axes() * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-15);
    EXPECT_LT((turned.axes() * Vec3::UnitX() - Vec3::UnitX()).norm(), 1e-15);
    EXPECT_EQ(turned.turned(Vec3(1, 2, 3)), Vec3(1, -3, 2));
    const Quat& axes = turned.axes();
    const FrameValues a = plain.read(4), b = turned.read(4);
    for (std::size_t i = 0; i < plain.bodies().size(); ++i) {
      const ExportedBody &p = plain.bodies()[i], &t = turned.bodies()[i];
      Surface placed = p.rest, also = t.rest;
      place(p, a, placed);
      place(t, b, also);
      std::vector<Vec3f> v, w;
      velocities(p, a, v);
      velocities(t, b, w);
      for (std::size_t k = 0; k < placed.positions.size(); ++k) {
        EXPECT_LT((also.positions[k] - scale * (axes * placed.positions[k])).norm(), 1e-14 * scale);
        EXPECT_LT((w[k] - (scale * (axes * v[k].cast<double>())).cast<float>()).norm(), 1e-5 * scale);
      }
      for (std::size_t k = 0; k < placed.normals.size(); ++k)
        EXPECT_LT((also.normals[k] - axes.cast<float>() * placed.normals[k]).norm(), 1e-6F);
    }
    for (std::size_t i = 0; i < a.rigid.size(); ++i) {
      EXPECT_LT((b.rigid[i].angular_velocity - axes * a.rigid[i].angular_velocity).norm(), 1e-15);
      EXPECT_NEAR(b.rigid[i].pose.orientation.norm(), 1, 1e-15);
      // The axes of a body are the same material directions in both exports.
      for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)})
        EXPECT_LT((b.rigid[i].pose.orientation * axis - axes * (a.rigid[i].pose.orientation * axis)).norm(),
                  1e-15);
    }
    EXPECT_EQ(b.time, a.time);
    EXPECT_EQ(b.strain, a.strain);
    EXPECT_EQ(b.contact.pressure, a.contact.pressure);
    for (std::size_t i = 0; i < a.contact.force.size(); ++i)  // forces turn and keep their unit
      EXPECT_LT((b.contact.force[i] - axes.cast<float>() * a.contact.force[i]).norm(), 1e-5F);
    for (std::size_t i = 0; i < a.rigid.size(); ++i) {
      EXPECT_LT((b.contact.rigid_force[i] - axes * a.contact.rigid_force[i]).norm(), 1e-14);
      EXPECT_LT((b.contact.rigid_torque[i] - axes * a.contact.rigid_torque[i]).norm(), 1e-14);
    }
  }
}

TEST(ExportedRun, GivesChosenBodiesTheirOwnLooks) {
  const SampleRun sample;
  ExportedRun run = sample.exported({{"wall", "jelly"}, {}, {}});
  EXPECT_EQ(run.bodies()[0].look, 0);
  ExportedLooks looks = test::sample_looks();
  run.set_looks(looks);
  EXPECT_EQ(run.bodies()[0].look, 1);
  EXPECT_EQ(run.bodies()[1].look, 0);
}

TEST(ExportedRun, TellsItsWatchOfEveryFrame) {
  const SampleRun sample;
  ExportedRun run = sample.exported();
  std::vector<int> seen;
  run.set_watch([&](int frame) {
    seen.push_back(frame);
    if (frame == 2) throw Error(ExitStatus::interrupted, "enough");
  });
  run.read(0);
  run.read(1);
  EXPECT_THROW(run.read(2), Error);
  EXPECT_EQ(seen, (std::vector<int>{0, 1, 2}));
}

}  // namespace
}  // namespace duet::io::exported_run_test
