#include "render/projection.h"

#include <gtest/gtest.h>

#include "sim/base/error.h"

namespace duet::render::projection_test {
namespace {

// Returns a camera that looks down the negative z axis from z = 10, with a vertical field of view of 90
// degrees. Half of the height at distance 10 is thus 10 m.
View wide_view() {
  return make_view({.position = {0, 0, 10}, .target = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov = 90}, 200,
                   100);
}

TEST(Projection, PixelsAgreeWithHandNumbers) {
  const View view = wide_view();
  EXPECT_NEAR((view.to_pixel({0, 0, 0}, 200, 100) - Vec2(100, 50)).norm(), 0, 1e-10);
  EXPECT_NEAR((view.to_pixel({20, 10, 0}, 200, 100) - Vec2(200, 0)).norm(), 0, 1e-10);  // right, up
  EXPECT_NEAR((view.to_pixel({-5, -5, 5}, 200, 100) - Vec2(50, 100)).norm(), 0,
              1e-10);  // at half the distance, twice as large
}

TEST(Projection, MatrixAgreesWithHandNumbers) {
  const Mat4 m = wide_view().projection(5, 15);
  const auto clip = [&](const Vec3& x) -> Vec3 { return (m * x.homogeneous()).hnormalized(); };
  EXPECT_NEAR((clip({0, 0, 5}) - Vec3(0, 0, -1)).norm(), 0, 1e-12);          // near plane
  EXPECT_NEAR((clip({0, 0, -5}) - Vec3(0, 0, 1)).norm(), 0, 1e-12);          // far plane
  EXPECT_NEAR((clip({10, -5, 0}) - Vec3(0.5, -0.5, 0.5)).norm(), 0, 1e-12);  // depth (20 - 150 / 10) / 10
}

// The matrix of OpenGL and to_pixel() are two formulas for one camera, and agree for a camera with a tilted
// up vector.
TEST(Projection, MatrixAndPixelsAgreeForATiltedCamera) {
  const View view =
      make_view({.position = {-32, 6, -28}, .target = {-2, 5, 1.6}, .up = {0.02, 1, 0.1}, .vertical_fov = 20},
                1280, 720);
  const Mat4 m = view.projection(1, 100);
  for (const Vec3& x : {Vec3(0, 1, 0), Vec3(3, 11, -4), Vec3(-7, 2, 9)}) {
    const Vec3 clip = (m * x.homogeneous()).hnormalized();
    const Vec2 pixel = view.to_pixel(x, 1280, 720);
    EXPECT_NEAR(pixel.x(), 640 * (1 + clip.x()), 1e-9);
    EXPECT_NEAR(pixel.y(), 360 * (1 - clip.y()), 1e-9);
  }
}

TEST(Projection, CornersOfTheParallelBoxBecomeCornersOfTheCube) {
  const Mat4 m = clip_parallel({1, 2, 3}, {2, 4, 7});
  EXPECT_NEAR(((m * Vec3(1, 2, 3).homogeneous()).hnormalized() - Vec3(-1, -1, -1)).norm(), 0, 1e-12);
  EXPECT_NEAR(((m * Vec3(2, 4, 7).homogeneous()).hnormalized() - Vec3(1, 1, 1)).norm(), 0, 1e-12);
}

TEST(Projection, VisiblePointsLieInsideAllPlanes) {
  const View view = wide_view();
  const auto inside = [&](const Vec3& x) {
    for (const Vec3& n : view.inward_normals())
      if (n.dot(x - view.eye) < 0) return false;
    return true;
  };
  EXPECT_TRUE(inside({19.9, 9.9, 0}));
  EXPECT_FALSE(inside({20.1, 0, 0}));
  EXPECT_FALSE(inside({0, 10.1, 0}));
  EXPECT_FALSE(inside({0, 0, 11}));
}

TEST(Projection, CamerasWithoutAViewAreRefused) {
  EXPECT_THROW(make_view({.position = {1, 1, 1}, .target = {1, 1, 1}}, 100, 100), Error);
  EXPECT_THROW(make_view({.position = {0, 5, 0}, .target = {0, 0, 0}, .up = {0, 1, 0}}, 100, 100), Error);
}

}  // namespace
}  // namespace duet::render::projection_test
