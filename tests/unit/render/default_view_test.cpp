#include "render/default_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace duet::render::default_view_test {
namespace {

// Returns a run with a moving box of edge `size` (m) and a static floor that is a hundred times as wide.
io::Manifest manifest_of(double size, const Vec3& place) {
  io::Manifest manifest;
  manifest.bodies.resize(2);
  manifest.bodies[0].kind = "rigid";
  manifest.bodies[0].box =
      Eigen::AlignedBox3d(Vec3(place - Vec3::Constant(size / 2)), Vec3(place + Vec3::Constant(size / 2)));
  manifest.bodies[1].kind = "static";
  manifest.bodies[1].box =
      Eigen::AlignedBox3d(Vec3(place - Vec3::Constant(100 * size)), Vec3(place - Vec3::Constant(size)));
  return manifest;
}

// Every corner of the moving bodies is in the picture, and they fill at least 0.4 of its height, whatever
// their size and place are.
TEST(DefaultView, ShowsWhatMoves) {
  for (const double size : {1e-3, 1.0, 1e3})
    for (const Vec3& place : {Vec3(0, 0, 0), Vec3(50, -3, 1e4)})
      for (const double fov : {10.0, 30.0, 90.0}) {
        scene::Scene scene;
        scene.camera.vertical_fov = fov;
        const io::Manifest manifest = manifest_of(size, place);
        const scene::Scene seen = with_default_view(scene, manifest);
        EXPECT_EQ(seen.camera.target, place);
        const Vec3 forward = (seen.camera.target - seen.camera.position).normalized();
        const Vec3 right = forward.cross(seen.camera.up).normalized(), up = right.cross(forward);
        const double half = std::tan(fov / 2 * std::numbers::pi / 180);
        double highest = 0;
        for (int corner = 0; corner < 8; ++corner) {
          const Vec3 x = manifest.bodies[0].box->corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
          const Vec3 from = x - seen.camera.position;
          EXPECT_GT(from.dot(forward), 0);
          EXPECT_LT(std::abs(from.dot(right)), from.dot(forward) * half);
          highest = std::max(highest, std::abs(from.dot(up)) / (from.dot(forward) * half));
        }
        EXPECT_LT(highest, 1);
        EXPECT_GT(highest, 0.4);
      }
}

// A ball of 2 cm that rolls at 3 m/s does not leave the picture at once: 2 s of its path are in view, or as
// much as the scene lasts.
TEST(DefaultView, ShowsThePathOfBodiesThatStartWithAVelocity) {
  for (const double seconds : {0.5, 10.0}) {
    scene::Scene scene;
    scene.rigid.resize(2);
    scene.rigid[0].placement.velocity = Vec3(3, 0, 0);
    scene.fps = 24;
    scene.frames = static_cast<int>(24 * seconds);
    const scene::Scene seen = with_default_view(scene, manifest_of(0.02, Vec3(1, 0, 0)));
    EXPECT_NEAR(seen.camera.target.x(), 1 + 3 * std::min(seconds, 2.0) / 2, 1e-12);
    EXPECT_GT((seen.camera.position - seen.camera.target).norm(), 3 * std::min(seconds, 2.0));
  }
}

TEST(DefaultView, ShowsTheGroundBelow) {
  scene::Scene scene;
  scene.ground.emplace().height = -4;
  const scene::Scene seen = with_default_view(scene, manifest_of(1, Vec3(0, 0, 0)));
  EXPECT_DOUBLE_EQ(seen.camera.target.y(), (0.5 - 4) / 2);
  EXPECT_GT(seen.camera.position.y(), -4);
}

// The lamp is above, on the side of the camera, and gives the same irradiance in scenes of all sizes.
TEST(DefaultView, LightsWhatMovesAlike) {
  double before = 0;
  for (const double size : {1e-3, 1.0, 1e3}) {
    const scene::Scene seen = with_default_view({}, manifest_of(size, Vec3(1, 2, 3)));
    ASSERT_EQ(seen.lights.size(), 1u);
    const scene::Light& lamp = seen.lights[0];
    const Vec3 to_lamp = lamp.position - Vec3(1, 2, 3);
    EXPECT_GT(to_lamp.y(), 0.5 * to_lamp.norm());
    EXPECT_GT(to_lamp.dot(seen.camera.position - seen.camera.target), 0);
    const double irradiance = lamp.power / (4 * std::numbers::pi * to_lamp.squaredNorm());
    if (before > 0) {
      EXPECT_NEAR(irradiance, before, 1e-9 * before);
    }
    before = irradiance;
  }
}

TEST(DefaultView, LeavesWhatTheSceneGives) {
  scene::Scene scene;
  scene.camera.position = Vec3(7, 8, 9);
  scene.has_camera = scene.has_sky = true;
  scene::Scene seen = with_default_view(scene, manifest_of(1, Vec3(0, 0, 0)));
  EXPECT_EQ(seen.camera.position, Vec3(7, 8, 9));
  EXPECT_TRUE(seen.lights.empty()) << "the sky alone is meant to light it";
  scene.has_sky = false;
  scene.lights.resize(2);
  EXPECT_EQ(with_default_view(scene, manifest_of(1, Vec3(0, 0, 0))).lights.size(), 2u);
}

TEST(DefaultView, LeavesRunsWithoutBoxes) {
  io::Manifest manifest;
  manifest.bodies.resize(2);
  const scene::Scene seen = with_default_view({}, manifest);
  EXPECT_EQ(seen.camera.position, scene::Camera{}.position);
  EXPECT_TRUE(seen.lights.empty());
}

}  // namespace
}  // namespace duet::render::default_view_test
