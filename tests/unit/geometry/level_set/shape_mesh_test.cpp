#include "sim/geometry/level_set/shape_mesh.h"

#include <map>
#include <set>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::shape_mesh_test {
namespace {

// Checks that every edge occurs once in each direction (the surface is closed and consistently oriented),
// that normals are unit vectors on the side of their triangles, that all indices are in range, and that the
// volume (m^3) is as expected.
void expect_closed(const Surface& surface, double volume_expected, double tolerance) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k].position, t[(k + 1) % 3].position}];
    const auto at = [&](std::size_t k) { return surface.positions[as_index(t[k].position)]; };
    const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    for (const Corner& c : t) {
      ASSERT_LT(as_index(c.uv), surface.uvs.size());
      const Vec3 corner_normal = surface.normals.at(as_index(c.normal)).cast<double>();
      EXPECT_NEAR(corner_normal.norm(), 1, 1e-6);
      EXPECT_GT(normal.dot(corner_normal), 0.9);
    }
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_NEAR(mass_properties(test::mesh_of(surface)).volume, volume_expected, tolerance);
}

TEST(ShapeMesh, SurfacesAreClosedAndOutward) {
  expect_closed(shape_surface(LevelSet::box(Vec3(2, 3, 4))), 24, 1e-5);
  for (const LevelSet& shape :
       {LevelSet::sphere(1), LevelSet::capsule(0.5, 1), LevelSet::cylinder(0.5, 2), LevelSet::torus(2, 0.5)})
    // Facets cut less than 1 % off.
    expect_closed(shape_surface(shape), volume(shape), 0.01 * volume(shape));
}

TEST(ShapeMesh, WithLessDetailSurfacesStayClosed) {
  for (const LevelSet& shape : {LevelSet::sphere(1), LevelSet::capsule(0.5, 1), LevelSet::cylinder(0.5, 2),
                                LevelSet::torus(2, 0.5)}) {
    const Surface surface = shape_surface(shape, 1.0 / 3);
    // 21 columns cut 3 % off, and 11 rows as much.
    expect_closed(surface, volume(shape), 0.08 * volume(shape));
    EXPECT_LT(5 * surface.triangles.size(), 2 * shape_surface(shape).triangles.size());
  }
}

TEST(ShapeMesh, TheRimsOfACylinderAreSharp) {
  const Surface surface = shape_surface(LevelSet::cylinder(1, 2));
  // Cap and side share the vertices of a rim. The poles have their own.
  EXPECT_EQ(surface.positions.size(), 2U * 64 + 2);
  EXPECT_EQ(surface.normals.size(), 4U * 64 + 2);
  for (const auto& t : surface.triangles) {
    const float first = surface.normals[as_index(t[0].normal)].y();
    for (const Corner& c : t) EXPECT_EQ(surface.normals[as_index(c.normal)].y(), first) << "0 or +-1 alike";
  }
}

TEST(ShapeMesh, NormalsOfAMeshSplitAtCreases) {
  const Surface box = mesh_surface(test::box_mesh(Vec3::Zero(), Vec3::Ones()));
  expect_closed(box, 1, 1e-6);
  EXPECT_EQ(box.positions.size(), 8U);
  EXPECT_EQ(box.normals.size(), 24U);  // Every corner has three normals.
  const Surface torus = mesh_surface(test::torus_mesh(1, 0.4, 48, 24));
  // All edges are smooth, so that every vertex has one normal.
  EXPECT_EQ(torus.normals.size(), torus.positions.size());
}

TEST(ShapeMesh, NormalsAndTextureCoordinatesOfTheFileWin) {
  TriangleMesh mesh = test::tetrahedron(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ());
  for (std::size_t t = 0; t < 4; ++t) {
    const Vec3f n = area_vector(mesh, t).normalized().cast<float>();
    mesh.normals.push_back({n, n, Vec3f(Vec3f::UnitZ())});
    mesh.uvs.push_back({Vec2f(0, 0.25F), Vec2f(0.5F, 0), Vec2f(1, 1)});
  }
  const Surface surface = mesh_surface(mesh);
  for (std::size_t t = 0; t < 4; ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(surface.normals[as_index(surface.triangles[t][k].normal)], mesh.normals[t][k]);
      EXPECT_EQ(surface.uvs[as_index(surface.triangles[t][k].uv)], mesh.uvs[t][k]);
    }
}

}  // namespace
}  // namespace duet::shape_mesh_test
