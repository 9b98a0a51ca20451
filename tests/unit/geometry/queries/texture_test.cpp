#include "sim/geometry/queries/texture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace duet::texture_test {
namespace {

constexpr double pi = std::numbers::pi;

// Returns a tube about the x axis between x = -2 and 2. Texture coordinates are lengths along x and around
// the tube, in meters, with a texture seam at the angle 0.
TriangleMesh tube(double radius, int rows, int columns) {
  TriangleMesh mesh;
  const auto place = [&](int row, int column) {
    const double angle = 2 * pi * column / columns;
    return Vec3(-2 + 4.0 * row / rows, radius * std::cos(angle), radius * std::sin(angle));
  };
  const auto uv = [&](int row, int column) -> Vec2f {
    return Vec2(-2 + 4.0 * row / rows, 2 * pi * radius * column / columns).cast<float>();
  };
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column < columns; ++column) mesh.positions.push_back(place(row, column));
  const auto number = [&](int row, int column) { return row * columns + column % columns; };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int next = column + 1;
      mesh.triangles.push_back({number(row, column), number(row, next), number(row + 1, column)});
      mesh.uvs.push_back({uv(row, column), uv(row, next), uv(row + 1, column)});
      mesh.triangles.push_back({number(row + 1, column), number(row, next), number(row + 1, next)});
      mesh.uvs.push_back({uv(row + 1, column), uv(row, next), uv(row + 1, next)});
    }
  return mesh;
}

// Returns a tube of coarser triangles, turned about its axis by `turn` (rad), so that some of its triangles
// lie across the texture seam.
Surface coarse_tube(double radius, int rows, int columns, double turn) {
  const TriangleMesh mesh = tube(radius, rows, columns);
  Surface surface;
  for (const Vec3& x : mesh.positions) {
    const double angle = std::atan2(x.z(), x.y()) + turn;
    surface.positions.emplace_back(x.x(), radius * std::cos(angle), radius * std::sin(angle));
  }
  surface.normals = {Vec3f::UnitY()};
  surface.uvs = {Vec2f::Zero()};
  for (const Triangle& t : mesh.triangles)
    surface.triangles.push_back({Corner{t[0], 0, 0}, Corner{t[1], 0, 0}, Corner{t[2], 0, 0}});
  return surface;
}

TEST(Texture, TransfersToANearbySurfaceAcrossTheTextureSeam) {
  const double radius = 0.5, around = 2 * pi * radius;
  const TriangleMesh mesh = tube(radius, 24, 48);
  Surface surface = coarse_tube(radius, 9, 14, 0.1);
  transfer_texture(mesh, surface);
  int across = 0;
  for (const auto& triangle : surface.triangles) {
    double least = 1e9, most = -1e9;
    for (const Corner& corner : triangle) {
      const Vec3& x = surface.positions[static_cast<std::size_t>(corner.position)];
      const Vec2f& uv = surface.uvs[static_cast<std::size_t>(corner.uv)];
      EXPECT_NEAR(uv.x(), x.x(), 1e-5);
      // The coordinate around the tube equals the arc length up to whole turns. The tolerance is for the
      // planes of triangles, which stand off from the circle.
      const double angle = std::atan2(x.z(), x.y());
      const double turns = (static_cast<double>(uv.y()) - radius * angle) / around;
      EXPECT_NEAR(turns, std::round(turns), 0.02);
      least = std::min<double>(least, uv.y());
      most = std::max<double>(most, uv.y());
    }
    EXPECT_LT(most - least, 1.5 * around / 14);
    across += least < 0 || most > around;
  }
  EXPECT_EQ(across, 2 * 9);
  EXPECT_LT(surface.uvs.size(), 2 * surface.positions.size());
}

// On a mesh without a texture seam, every position has one place in the texture, that of the nearest point of
// the mesh.
TEST(Texture, IsExactOnAPlane) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto uv = [](const Vec3& x) -> Vec2f {
    return Vec2(3 * x.x() + x.y(), 5 - x.x() + 2 * x.y()).cast<float>();
  };
  for (std::size_t t = 0; t < 2; ++t)
    mesh.uvs.push_back({uv(mesh.corner(t, 0)), uv(mesh.corner(t, 1)), uv(mesh.corner(t, 2))});
  Surface surface;
  surface.positions = {{0.2, 0.1, 0.3}, {1.7, 0.4, -0.2}, {0.5, 0.9, 0.1}, {1.9, 0.9, 0}};
  surface.triangles = {{Corner{0, 0, 0}, Corner{1, 0, 0}, Corner{2, 0, 0}},
                       {Corner{1, 0, 0}, Corner{3, 0, 0}, Corner{2, 0, 0}}};
  transfer_texture(mesh, surface);
  ASSERT_EQ(surface.uvs.size(), 4u);
  for (const auto& triangle : surface.triangles)
    for (const Corner& c : triangle)
      EXPECT_LT((surface.uvs[static_cast<std::size_t>(c.uv)] -
                 uv(surface.positions[static_cast<std::size_t>(c.position)]))
                    .norm(),
                1e-5);
}

}  // namespace
}  // namespace duet::texture_test
