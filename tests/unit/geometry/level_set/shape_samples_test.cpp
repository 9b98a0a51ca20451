#include "sim/geometry/level_set/shape_samples.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/groove.h"
#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/feature_edges.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet::shape_samples_test {
namespace {

bool contains(const std::vector<Vec3>& samples, const Vec3& x) {
  for (const Vec3& sample : samples)
    if ((sample - x).norm() < 1e-9) return true;
  return false;
}

// Returns the greatest distance of a point of the mesh from its nearest sample (m), found with 60 random
// points on each triangle.
double max_gap(const TriangleMesh& mesh, const std::vector<Vec3>& samples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  double largest = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int i = 0; i < 60; ++i) {
      double u = uniform(random), v = uniform(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      const Vec3 x = (1 - u - v) * mesh.corner(t, 0) + u * mesh.corner(t, 1) + v * mesh.corner(t, 2);
      double nearest = 1e9;
      for (const Vec3& sample : samples) nearest = std::min(nearest, (sample - x).squaredNorm());
      largest = std::max(largest, std::sqrt(nearest));
    }
  return largest;
}

TEST(ShapeSamples, ACubeHasEightIntervalsAnEdgeUnlessToldOtherwise) {
  const LevelSet cube = LevelSet::box(Vec3(2, 2, 2));
  EXPECT_EQ(surface_samples(cube, default_sample_spacing(volume(cube))).size(), 9U * 9 * 9 - 7 * 7 * 7);
  const LevelSet box = LevelSet::box(Vec3(2, 4, 6));
  EXPECT_EQ(surface_samples(box, 0.5).size(), 5U * 9 * 13 - 3 * 7 * 11);
  EXPECT_EQ(surface_samples(box, 100).size(), 8U) << "the corners are always there";
}

// The edges of two thin crossing boxes overlap only over a length of their thickness, and a sample must lie
// on it. Otherwise the edges would slip through each other.
TEST(ShapeSamples, EdgesOfThinBoxesDoNotSlipPastEachOther) {
  for (const double thickness : {0.05, 0.01, 0.004}) {
    const LevelSet plate = LevelSet::box(Vec3(1, 1, thickness));
    const std::vector<Vec3> samples = surface_samples(plate, default_sample_spacing(volume(plate)));
    EXPECT_LT(samples.size(), 7500U);  // There are 5408 without the additional samples on edges.
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 50; ++i) {
      // One box stands on its edge. The other stands across it, and its edge is twice the thickness below
      // that of the first.
      const Pose other{Vec3(0.4 * uniform(random), 1 - 2 * thickness, 0.4 * uniform(random)),
                       Quat(Eigen::AngleAxisd(EIGEN_PI / 2 + 0.5 * uniform(random), Vec3::UnitY()))};
      bool found = false;
      for (const Vec3& x : samples)
        found = found || plate.distance(other.to_world(x)) < 0 || plate.distance(other.to_body(x)) < 0;
      EXPECT_TRUE(found) << "thickness " << thickness;
    }
  }
}

TEST(ShapeSamples, LieOnTheSurfaceWithoutGaps) {
  constexpr double spacing = 0.2;
  for (const LevelSet& shape :
       {LevelSet::box(Vec3(1, 2, 3)), LevelSet::cylinder(0.8, 1.1), LevelSet::torus(1, 0.3)}) {
    const std::vector<Vec3> samples = surface_samples(shape, spacing);
    for (const Vec3& x : samples) EXPECT_NEAR(shape.distance(x), 0, 1e-15);
    // Every sample has another one within the spacing.
    for (const Vec3& x : samples) {
      double nearest = 1e9;
      for (const Vec3& y : samples)
        if (x != y) nearest = std::min(nearest, (x - y).norm());
      EXPECT_LE(nearest, spacing + 1e-12);
    }
  }
}

TEST(ShapeSamples, TouchWhereShapesTouchFirst) {
  const std::vector<Vec3> cylinder = surface_samples(LevelSet::cylinder(0.5, 1), 0.2);
  int on_rim = 0;
  for (const Vec3& x : cylinder)
    on_rim += std::abs(x.y() - 0.5) < 1e-12 && std::abs(std::hypot(x.x(), x.z()) - 0.5) < 1e-12 ? 1 : 0;
  EXPECT_GE(on_rim, 24) << "rims are fine enough to roll on";
  for (const Vec3& x : cylinder) EXPECT_EQ(std::abs(x.y()), 0.5) << "nothing between the rims";
  const std::vector<Vec3> torus = surface_samples(LevelSet::torus(1, 0.25), 0.1);
  EXPECT_TRUE(contains(torus, Vec3(0, 0.25, 1)));  // The torus lies on its top or its bottom.
  EXPECT_TRUE(contains(torus, Vec3(0, -0.25, 1)));
  EXPECT_TRUE(surface_samples(LevelSet::sphere(1), 0.2).empty());
  EXPECT_TRUE(surface_samples(LevelSet::capsule(0.5, 1), 0.2).empty());
}

// Flat faces are the interior of the faces of a box and of the caps of a cylinder. Edges, rims and round
// surfaces are not flat.
TEST(ShapeSamples, FlatFacesAreTold) {
  const LevelSet box = LevelSet::box(Vec3(1, 2, 3)), cylinder = LevelSet::cylinder(0.8, 1.1),
                 torus = LevelSet::torus(1, 0.3);
  const auto flags = [](const LevelSet& shape) { return on_flat_faces(shape, surface_samples(shape, 0.2)); };
  const std::vector<Vec3> on_box = surface_samples(box, 0.2), on_cylinder = surface_samples(cylinder, 0.2);
  for (std::size_t i = 0; i < on_box.size(); ++i)
    EXPECT_EQ(flags(box)[i] != 0, ((on_box[i].cwiseAbs() - box.half).array() == 0).count() == 1);
  for (std::size_t i = 0; i < on_cylinder.size(); ++i)
    EXPECT_EQ(flags(cylinder)[i] != 0, std::hypot(on_cylinder[i].x(), on_cylinder[i].z()) < 0.79);
  for (const char flat : flags(torus)) EXPECT_EQ(flat, 0);
}

TEST(ShapeSamples, MeshesHaveNoGaps) {
  struct Case {
    TriangleMesh mesh;
    double spacing;
  };
  // The cases are coarse and fine meshes, and a sliver.
  for (const Case& c :
       {Case{test::l_mesh(), 0.3}, Case{test::l_mesh(), 1.7}, Case{test::torus_mesh(1, 0.4, 60, 30), 0.25},
        Case{test::tetrahedron(Vec3::Zero(), Vec3(3, 0, 0), Vec3(0, 0.1, 0), Vec3(0, 0, 1)), 0.3}}) {
    const std::vector<Vec3> samples = surface_samples(c.mesh, c.spacing);
    EXPECT_LE(max_gap(c.mesh, samples), c.spacing);
    const TriangleTree tree(c.mesh);
    for (const Vec3& x : samples) EXPECT_LT(tree.nearest(x).distance, 1e-12);
  }
}

TEST(ShapeSamples, FineMeshesAreThinnedAndKeepTheirCorners) {
  const TriangleMesh torus = test::torus_mesh(1, 0.4, 120, 60);  // 7200 vertices
  EXPECT_LT(surface_samples(torus, 0.25).size(), 700U);          // The bound is the area over (0.6 * 0.25)^2.
  const TriangleMesh box = test::box_mesh(Vec3::Zero(), Vec3(1, 0.02, 1));
  const std::vector<Vec3> samples = surface_samples(box, 0.25);
  for (const Vec3& corner : box.positions)
    EXPECT_TRUE(contains(samples, corner)) << "both sides of a thin plate: " << corner.transpose();
}

// Samples avoid the creases of a mesh. The faces of a groove touch a body first, and a point on both of them
// would have the normal of neither.
TEST(ShapeSamples, NoneLiesInACreaseOfAMesh) {
  const TriangleMesh groove = test::groove(0.6);
  const std::vector<Vec3> samples = surface_samples(groove, 0.1);
  EXPECT_GT(samples.size(), 1000U);
  for (const Vec3& x : samples) EXPECT_GT(std::hypot(x.y(), x.z()), 1e-3) << x.transpose();
  EXPECT_FALSE(contains(surface_samples(test::l_mesh(), 0.3), Vec3(1, 1, 0)));
}

// The estimate is of the right size for all proportions, so that a scene can be refused before memory is
// short.
TEST(SurfaceSamples, AreEstimated) {
  for (const LevelSet& shape :
       {LevelSet::box(Vec3(1, 1, 1)), LevelSet::box(Vec3(1, 1e-3, 1)), LevelSet::box(Vec3(1e-3, 1, 1e-3)),
        LevelSet::cylinder(1, 1), LevelSet::cylinder(1, 1e-3), LevelSet::cylinder(0.01, 5),
        LevelSet::capsule(0.01, 5), LevelSet::torus(1, 0.3), LevelSet::torus(1, 0.003)}) {
    const double spacing = default_sample_spacing(volume(shape));
    const double estimate = estimated_samples(shape, spacing);
    const auto count = static_cast<double>(surface_samples(shape, spacing).size() +
                                           find_feature_edges(shape, spacing).nodes.size());
    EXPECT_GT(estimate, count / 2) << static_cast<int>(shape.kind);
    EXPECT_LT(estimate, count * 2) << static_cast<int>(shape.kind);
  }
}

}  // namespace
}  // namespace duet::shape_samples_test
