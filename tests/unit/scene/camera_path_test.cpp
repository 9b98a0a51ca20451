#include "sim/scene/camera_path.h"

#include <string>

#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"

namespace duet::scene::camera_path_test {
namespace {

Camera camera_of(const std::string& keys) {
  const std::string text = "[[rigid]]\nname = \"ball\"\nshape = { sphere = 1 }\nmass = 5\n[camera]\n" + keys;
  return read_text(text, "camera.toml").scene.camera;
}

void expect_view(const Camera& camera, const Vec3& position, const Vec3& target, double fov) {
  EXPECT_LT((camera.position - position).norm(), 1e-12) << camera.position.transpose();
  EXPECT_LT((camera.target - target).norm(), 1e-12) << camera.target.transpose();
  EXPECT_NEAR(camera.vertical_fov, fov, 1e-12);
}

TEST(CameraPath, StaysWithoutKeyframes) {
  const CameraPath path(camera_of("position = [1, 2, 3]\ntarget = [0, 1, 0]\nvertical_fov = 40"));
  for (const double time : {-1.0, 0.0, 7.0}) expect_view(path.at(time), {1, 2, 3}, {0, 1, 0}, 40);
}

TEST(CameraPath, GoesThroughItsKeyframesAndRestsAtBothEnds) {
  const CameraPath path(camera_of(R"(
position = [0, 2, 10]
target = [0, 1, 0]
up = [0, 1, 0.1]
keyframes = [
  { time = 1 },
  { time = 3, position = [4, 2, 10], target = [4, 1, 0] },
  { time = 5, position = [8, 2, 10], vertical_fov = 20 },
])"));
  expect_view(path.at(0), {0, 2, 10}, {0, 1, 0}, 30);
  expect_view(path.at(1), {0, 2, 10}, {0, 1, 0}, 30);
  expect_view(path.at(3), {4, 2, 10}, {4, 1, 0}, 30);  // A keyframe leaves out what the camera itself gives.
  expect_view(path.at(5), {8, 2, 10}, {0, 1, 0}, 20);
  expect_view(path.at(9), {8, 2, 10}, {0, 1, 0}, 20);
  EXPECT_EQ(path.at(4).up, Vec3(0, 1, 0.1));
  EXPECT_TRUE(path.at(4).keyframes.empty());
}

// The path is a cubic with the velocities 0, 2, 0 m/s at the keys at 0, 4 and 8 m. Between the first two, the
// Hermite form gives x(1/2) = 4 / 2 - 2 s * 2 m/s / 8 = 1.5 m. The field of view reverses at its middle key
// without overshooting.
TEST(CameraPath, MovesSmoothlyWithoutOvershooting) {
  const CameraPath path(camera_of(R"(
vertical_fov = 30
keyframes = [
  { time = 1, position = [0, 2, 10] },
  { time = 3, position = [4, 2, 10], vertical_fov = 20 },
  { time = 5, position = [8, 2, 10] },
])"));
  EXPECT_NEAR(path.at(2).position.x(), 1.5, 1e-12);
  EXPECT_NEAR(path.at(4).position.x(), 6.5, 1e-12);
  EXPECT_NEAR((path.at(3 + 1e-6).position.x() - path.at(3 - 1e-6).position.x()) / 2e-6, 2, 1e-6);
  EXPECT_NEAR(path.at(2).vertical_fov, 25, 1e-12);
  for (double time = 0; time < 6; time += 0.01) EXPECT_GE(path.at(time).vertical_fov, 20 - 1e-12);
}

// An empty list of keyframes holds the view still, for another picture with --set camera.keyframes=[].
TEST(CameraPath, AnEmptyListMovesNothing) {
  expect_view(CameraPath(camera_of("position = [1, 2, 3]\nkeyframes = []")).at(4), {1, 2, 3}, {0, 0, 0}, 30);
}

}  // namespace
}  // namespace duet::scene::camera_path_test
