#include "sim/geometry/shape_mesh.h"

#include <cmath>
#include <numbers>

namespace duet {
namespace {

// A face of the cube [-1, 1]^3: outward axis and two tangents with axis = tangent_u x tangent_v.
struct CubeFace {
  Vec3 axis, u, v;
};

std::array<CubeFace, 6> cube_faces() {
  std::array<CubeFace, 6> faces;
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = Vec3::Unit(i), u = Vec3::Unit((i + 1) % 3), v = Vec3::Unit((i + 2) % 3);
    faces[static_cast<std::size_t>(2 * i)] = {axis, u, v};
    faces[static_cast<std::size_t>(2 * i + 1)] = {-axis, v, u};
  }
  return faces;
}

void add_quad(Surface& surface, const std::array<Corner, 4>& q) {
  surface.triangles.push_back({q[0], q[1], q[2]});
  surface.triangles.push_back({q[0], q[2], q[3]});
}

Surface box_surface(const Vec3& half) {
  Surface surface;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1);
    surface.positions.push_back(half.cwiseProduct(sign).cast<float>());
  }
  surface.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const CubeFace& face : cube_faces()) {
    const int normal = static_cast<int>(surface.normals.size());
    surface.normals.push_back(face.axis.cast<float>());
    std::array<Corner, 4> corners;
    for (int k = 0; k < 4; ++k) {
      const Vec3 x = face.axis + (k == 1 || k == 2 ? 1 : -1) * face.u + (k >= 2 ? 1 : -1) * face.v;
      const int vertex = (x.x() > 0 ? 1 : 0) + (x.y() > 0 ? 2 : 0) + (x.z() > 0 ? 4 : 0);
      corners[static_cast<std::size_t>(k)] = {vertex, k, normal};
    }
    add_quad(surface, corners);
  }
  return surface;
}

// Latitude and longitude: rows of quads between two poles, with its seam in the texture coordinates only.
Surface sphere_surface(double radius) {
  constexpr int rows = 32, columns = 64;
  Surface surface;
  const auto vertex = [](int row, int column) {
    if (row == 0) return 0;
    if (row == rows) return 1 + (rows - 1) * columns;
    return 1 + (row - 1) * columns + column % columns;
  };
  const auto add_vertex = [&](double polar, double azimuth) {
    const Vec3 n(std::sin(polar) * std::sin(azimuth), std::cos(polar), std::sin(polar) * std::cos(azimuth));
    surface.positions.push_back((radius * n).cast<float>());
    surface.normals.push_back(n.cast<float>());
  };
  add_vertex(0, 0);
  for (int row = 1; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      add_vertex(std::numbers::pi * row / rows, 2 * std::numbers::pi * column / columns);
  add_vertex(std::numbers::pi, 0);
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column)
      surface.uvs.emplace_back(static_cast<float>(column) / columns, 1 - static_cast<float>(row) / rows);

  const auto corner = [&](int row, int column) {
    const int v = vertex(row, column);
    return Corner{v, row * (columns + 1) + column, v};
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Corner a = corner(row, column), b = corner(row + 1, column), c = corner(row + 1, column + 1),
                   d = corner(row, column + 1);
      if (row + 1 < rows)
        surface.triangles.push_back({a, b, c});             // none of the lower fan: b and c are the pole
      if (row > 0) surface.triangles.push_back({a, c, d});  // none of the upper fan: a and d are the pole
    }
  return surface;
}

}  // namespace

std::vector<Vec3> surface_samples(const LevelSet& shape, int intervals) {
  std::vector<Vec3> samples;
  if (shape.kind != LevelSet::Kind::box) return samples;
  const int n = intervals;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (int k = 0; k <= n; ++k) {
        const bool on_surface = i == 0 || j == 0 || k == 0 || i == n || j == n || k == n;
        if (on_surface)
          samples.emplace_back(
              shape.half.cwiseProduct(Vec3(2.0 * i / n - 1, 2.0 * j / n - 1, 2.0 * k / n - 1)));
      }
  return samples;
}

Surface shape_surface(const LevelSet& shape) {
  return shape.kind == LevelSet::Kind::sphere ? sphere_surface(shape.radius) : box_surface(shape.half);
}

}  // namespace duet
