#include "tests/support/meshes.h"

#include <cmath>

#include <gtest/gtest.h>

namespace duet::test {

Vec3 random_vector(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double x = uniform(random), y = uniform(random);
  return {x, y, uniform(random)};
}

Quat random_rotation(std::mt19937& random) {
  // The axis has a statement of its own: compilers evaluate the arguments of a call in different orders.
  const Vec3 axis = random_vector(random).normalized();
  return Quat(Eigen::AngleAxisd(3 * random_vector(random).x(), axis));
}

std::shared_ptr<TriangleMesh> asset(const std::string& file) {
  auto mesh = std::make_shared<TriangleMesh>(read_mesh(source_folder() + "/assets/" + file));
  EXPECT_TRUE(repair(*mesh).flaws.empty()) << file;
  return mesh;
}

void add_face(TriangleMesh& mesh, const std::vector<int>& polygon) {
  for (std::size_t i = 2; i < polygon.size(); ++i)
    mesh.triangles.push_back({polygon[0], polygon[i - 1], polygon[i]});
}

TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.emplace_back((i & 1 ? upper : lower).x(), (i & 2 ? upper : lower).y(),
                                (i & 4 ? upper : lower).z());
  for (const auto& face : std::vector<std::vector<int>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    add_face(mesh, face);
  return mesh;
}

TriangleMesh tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  TriangleMesh mesh;
  mesh.positions = {a, b, c, d};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

TriangleMesh l_mesh() {
  TriangleMesh mesh;
  for (const double z : {1.0, 0.0})
    for (const Vec2& p : {Vec2(0, 0), Vec2(2, 0), Vec2(2, 1), Vec2(1, 1), Vec2(1, 2), Vec2(0, 2)})
      mesh.positions.emplace_back(p.x(), p.y(), z);
  add_face(mesh, {0, 1, 2, 3});
  add_face(mesh, {0, 3, 4, 5});
  add_face(mesh, {9, 8, 7, 6});
  add_face(mesh, {11, 10, 9, 6});
  for (int i = 0; i < 6; ++i) add_face(mesh, {i, i + 6, (i + 1) % 6 + 6, (i + 1) % 6});
  return mesh;
}

TriangleMesh torus_mesh(double radius, double tube, int columns, int rows) {
  TriangleMesh mesh;
  for (int i = 0; i < columns; ++i)
    for (int j = 0; j < rows; ++j) {
      const double a = 2 * EIGEN_PI * i / columns, b = 2 * EIGEN_PI * j / rows,
                   r = radius + tube * std::sin(b);
      mesh.positions.emplace_back(r * std::sin(a), tube * std::cos(b), r * std::cos(a));
      const int k = (i + 1) % columns, l = (j + 1) % rows;
      add_face(mesh, {i * rows + j, i * rows + l, k * rows + l, k * rows + j});
    }
  return mesh;
}

TriangleMesh ball_mesh(double radius, int columns, int rows) {
  TriangleMesh mesh;
  mesh.positions.emplace_back(0, radius, 0);
  for (int j = 1; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * EIGEN_PI * i / columns, b = EIGEN_PI * j / rows;
      mesh.positions.emplace_back(radius * std::sin(b) * std::sin(a), radius * std::cos(b),
                                  radius * std::sin(b) * std::cos(a));
    }
  mesh.positions.emplace_back(0, -radius, 0);
  const int last = static_cast<int>(mesh.positions.size()) - 1;
  for (int i = 0; i < columns; ++i) {
    const int k = (i + 1) % columns;
    add_face(mesh, {0, 1 + i, 1 + k});
    for (int j = 0; j + 2 < rows; ++j) {
      const int upper = 1 + j * columns, lower = upper + columns;
      add_face(mesh, {upper + i, lower + i, lower + k, upper + k});
    }
    add_face(mesh, {last, last - columns + k, last - columns + i});
  }
  return mesh;
}

TriangleMesh drum_mesh(double radius, double width, int columns) {
  TriangleMesh mesh;
  for (const double y : {-width / 2, width / 2}) {
    mesh.positions.emplace_back(0, y, 0);
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * EIGEN_PI * i / columns;
      mesh.positions.emplace_back(radius * std::sin(a), y, radius * std::cos(a));
    }
  }
  const int upper = columns + 1;
  for (int i = 0; i < columns; ++i) {
    const int k = (i + 1) % columns;
    add_face(mesh, {0, 1 + k, 1 + i});
    add_face(mesh, {upper, upper + 1 + i, upper + 1 + k});
    add_face(mesh, {1 + i, 1 + k, upper + 1 + k, upper + 1 + i});
  }
  return mesh;
}

TriangleMesh bowl_mesh(double radius, double wall, int columns, int rows) {
  TriangleMesh mesh;
  const auto add_side = [&](double r) {
    mesh.positions.emplace_back(0, -r, 0);
    for (int j = 1; j <= rows; ++j)
      for (int i = 0; i < columns; ++i) {
        const double a = 2 * EIGEN_PI * i / columns, b = 70 * EIGEN_PI / 180 * j / rows;
        mesh.positions.emplace_back(r * std::sin(b) * std::sin(a), -r * std::cos(b),
                                    r * std::sin(b) * std::cos(a));
      }
  };
  add_side(radius);
  const int outside = static_cast<int>(mesh.positions.size()), rim = 1 + (rows - 1) * columns;
  add_side(radius + wall);
  for (int i = 0; i < columns; ++i) {
    const int k = (i + 1) % columns;
    add_face(mesh, {0, 1 + i, 1 + k});
    add_face(mesh, {outside, outside + 1 + k, outside + 1 + i});
    for (int j = 0; j + 1 < rows; ++j) {
      const int lower = 1 + j * columns, upper = lower + columns;
      add_face(mesh, {lower + i, upper + i, upper + k, lower + k});
      add_face(mesh, {outside + lower + i, outside + lower + k, outside + upper + k, outside + upper + i});
    }
    add_face(mesh, {rim + i, outside + rim + i, outside + rim + k, rim + k});
  }
  return mesh;
}

TriangleMesh mesh_of(const Surface& surface) {
  TriangleMesh mesh;
  mesh.positions = surface.positions;
  for (const auto& t : surface.triangles)
    mesh.triangles.push_back({t[0].position, t[1].position, t[2].position});
  return mesh;
}

}  // namespace duet::test
