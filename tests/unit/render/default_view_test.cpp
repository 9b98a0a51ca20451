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

// A ball that flies at a row of bodies is stopped by them: the picture is as near as without its velocity.
TEST(DefaultView, EndsThePathBehindTheBodiesThatAreHit) {
  io::Manifest manifest = manifest_of(0.2, Vec3(0, 0, 0));
  manifest.bodies[1].kind = "rigid";
  manifest.bodies[1].box = manifest.bodies[0].box->translated(Vec3(1, 0.05, 0));
  scene::Scene scene;
  scene.rigid.resize(2);
  const scene::Scene still = with_default_view(scene, manifest);
  const Vec3 way = manifest.bodies[1].box->center() - manifest.bodies[0].box->center();
  scene.rigid[0].placement.velocity = 50 * way;
  const scene::Scene hit = with_default_view(scene, manifest);
  scene.rigid[0].placement.velocity = -50 * way;
  const scene::Scene missed = with_default_view(scene, manifest);
  const auto distance = [](const scene::Scene& seen) {
    return (seen.camera.position - seen.camera.target).norm();
  };
  EXPECT_LT(distance(hit), 2 * distance(still));
  EXPECT_GT(distance(missed), 10 * distance(still));
}

// A body of 0.2 m goes from x = 1 m to 7 m, and may push one that stands at 3 m to 9 m.
TEST(DefaultView, ShowsWhereKeyframesLeadAndWhatTheyPush) {
  io::Manifest manifest = manifest_of(0.2, Vec3(1, 0, 0));
  scene::Scene scene;
  scene.rigid.resize(2);
  scene.rigid[0].is_kinematic = true;
  scene.rigid[0].motion.keyframes.resize(2);
  scene.rigid[0].motion.keyframes[0].position = Vec3(1, 0, 0);
  scene.rigid[0].motion.keyframes[1].position = Vec3(7, 0, 0);
  EXPECT_NEAR(with_default_view(scene, manifest).camera.target.x(), 4, 1e-12);
  manifest.bodies[1].kind = "rigid";
  manifest.bodies[1].box = manifest.bodies[0].box->translated(Vec3(2, 0, 0));
  EXPECT_NEAR(with_default_view(scene, manifest).camera.target.x(), (0.9 + 9.1) / 2, 1e-12);
}

// A row along x is as wide as the picture, less the margin, and not as high as it.
TEST(DefaultView, FillsWidePicturesWithWideScenes) {
  io::Manifest manifest = manifest_of(1, Vec3(0, 0, 0));
  manifest.bodies[0].box = Eigen::AlignedBox3d(Vec3(-10, 0, -0.1), Vec3(10, 0.5, 0.1));
  manifest.bodies.resize(1);
  const scene::Scene seen = with_default_view({}, manifest);
  const double width = 20 / (seen.camera.position - seen.camera.target).norm() / 2;
  const double half = std::tan(seen.camera.vertical_fov / 2 * std::numbers::pi / 180) * seen.render.width /
                      seen.render.height;
  EXPECT_GT(width, 0.6 * half);
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
