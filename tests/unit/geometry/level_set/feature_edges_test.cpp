#include "sim/geometry/level_set/feature_edges.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/geometry/level_set/shape_samples.h"

namespace duet::feature_edges_test {
namespace {

constexpr double pi = std::numbers::pi;

const Vec3& node(const FeatureEdges& feature_edges, int i) {
  return feature_edges.nodes[static_cast<std::size_t>(i)];
}

// Returns the total length of the chords between nodes, in m.
double length_of(const FeatureEdges& feature_edges) {
  double length = 0;
  for (const FeatureEdges::Line& line : feature_edges.lines) {
    for (int i = line.begin; i + 1 < line.end; ++i)
      length += (node(feature_edges, i + 1) - node(feature_edges, i)).norm();
    if (line.is_closed)
      length += (node(feature_edges, line.begin) - node(feature_edges, line.end - 1)).norm();
  }
  return length;
}

// Checks that consecutive nodes are at most `longest` apart, and that `longest` is at most `spacing` (both in
// m).
void expect_spacing(const FeatureEdges& feature_edges, double spacing) {
  for (const FeatureEdges::Line& line : feature_edges.lines) {
    EXPECT_LE(line.longest, spacing * (1 + 1e-12));
    for (int i = line.begin; i + 1 < line.end; ++i)
      EXPECT_LE((node(feature_edges, i + 1) - node(feature_edges, i)).norm(), line.longest * (1 + 1e-12));
  }
}

FeatureEdges feature_edges_of(const TriangleMesh& mesh, const LevelSet& shape, double spacing) {
  const std::vector<Vec3> samples = surface_samples(mesh, spacing);
  return find_feature_edges(mesh, shape, samples, points_inside(shape, samples), spacing);
}

FeatureEdges feature_edges_of(const TriangleMesh& mesh, double spacing) {
  return feature_edges_of(mesh, LevelSet::mesh(std::make_shared<GridLevelSet>(mesh, 32)), spacing);
}

// Returns a closed prism about the y axis, from y = 0 to `height`, with outward faces.
TriangleMesh prism(int corners, double radius, double height) {
  TriangleMesh mesh;
  std::vector<int> bottom, top;
  for (int i = 0; i < corners; ++i) {
    const double a = 2 * pi * i / corners;
    for (const double y : {0.0, height})
      mesh.positions.emplace_back(radius * std::sin(a), y, radius * std::cos(a));
    bottom.insert(bottom.begin(), 2 * i);
    top.push_back(2 * i + 1);
  }
  test::add_face(mesh, bottom);
  test::add_face(mesh, top);
  for (int i = 0; i < corners; ++i) {
    const int j = (i + 1) % corners;
    test::add_face(mesh, {2 * i, 2 * j, 2 * j + 1, 2 * i + 1});
  }
  return mesh;
}

// The feature edges of a box are its 12 edges with their whole length, its 8 corners, and inward directions
// of unit length.
TEST(FeatureEdges, ABoxHasItsTwelveEdges) {
  const FeatureEdges feature_edges = find_feature_edges(LevelSet::box(Vec3(2, 1, 0.5)), 0.3);
  EXPECT_EQ(feature_edges.lines.size(), 12U);
  EXPECT_NEAR(length_of(feature_edges), 4 * (2 + 1 + 0.5), 1e-14);
  expect_spacing(feature_edges, 0.3);
  for (std::size_t i = 0; i < feature_edges.nodes.size(); ++i) {
    const Vec3 share = feature_edges.nodes[i].cwiseQuotient(Vec3(1, 0.5, 0.25)).cwiseAbs();
    EXPECT_GE((share.array() > 1 - 1e-12).count(), 2) << "on no edge";
    EXPECT_LT(feature_edges.inward[i].dot(feature_edges.nodes[i]), 0);
    EXPECT_NEAR(feature_edges.inward[i].norm(), 1, 1e-14);
  }
  EXPECT_EQ(feature_edges.corners.size(), 8U);
  for (const int corner : feature_edges.corners)
    EXPECT_EQ(node(feature_edges, corner).cwiseAbs(), Vec3(1, 0.5, 0.25));
}

TEST(FeatureEdges, RoundBodiesHaveMiddleLinesAndRims) {
  const FeatureEdges torus = find_feature_edges(LevelSet::torus(2, 0.5), 0.25);
  ASSERT_EQ(torus.lines.size(), 1U);
  EXPECT_TRUE(torus.lines[0].is_closed);
  EXPECT_EQ(torus.lines[0].radius, 0.5);
  EXPECT_EQ(torus.nodes.size(), 51U);  // The circle has 2 pi 2 / 0.25 = 50.3 intervals, rounded up.
  EXPECT_NEAR(torus.lines[0].longest, 4 * pi / 51, 1e-14);
  // A place half way between two nodes lies on the circle and not on its chord.
  const Vec3 middle = place_between(torus.lines[0], torus.nodes[0], torus.nodes[1], 0.5);
  EXPECT_LT((middle - 2 * Vec3(std::sin(pi / 51), 0, std::cos(pi / 51))).norm(), 1e-14);

  const FeatureEdges cylinder = find_feature_edges(LevelSet::cylinder(1, 3), 0.4);
  ASSERT_EQ(cylinder.lines.size(), 3U);
  EXPECT_EQ(cylinder.lines[0].radius, 0);
  EXPECT_EQ(cylinder.lines[2].radius, 1);
  EXPECT_FALSE(cylinder.lines[2].is_closed);
  const Vec3 on_rim = cylinder.nodes[0];
  EXPECT_EQ(std::abs(on_rim.y()), 1.5);
  // The inward direction at a rim is near the bisector of the side and the end. The bound allows for
  // points_inside(), which averages 27 normals around the node.
  EXPECT_LT((cylinder.inward[0] - Vec3(-on_rim.x(), -on_rim.y() / 1.5, -on_rim.z()).normalized()).norm(),
            0.1);

  EXPECT_TRUE(cylinder.corners.empty());  // The axis ends inside the end faces: its ends are no corners.

  EXPECT_EQ(find_feature_edges(LevelSet::capsule(0.5, 1), 0.25).nodes.size(), 5U);
  EXPECT_TRUE(find_feature_edges(LevelSet::sphere(1), 0.25).lines.empty());
  EXPECT_TRUE(find_feature_edges(LevelSet::half_space(), 0.25).lines.empty());
}

TEST(FeatureEdges, MeshesHaveTheirSharpConvexEdges) {
  const FeatureEdges box = feature_edges_of(test::box_mesh(Vec3(-1, -1, -1), Vec3(1, 1, 1)), 0.3);
  // Corners end the lines, and the diagonals of faces are no feature edges.
  EXPECT_EQ(box.lines.size(), 12U);
  EXPECT_EQ(box.corners.size(), 8U);
  EXPECT_NEAR(length_of(box), 24, 1e-13);
  expect_spacing(box, 0.3);
  // An L has 18 edges. The concave one, of length 1, is no feature edge.
  EXPECT_NEAR(length_of(feature_edges_of(test::l_mesh(), 0.3)), 2 * 8 + 6 - 1, 1e-13);
  // Neighboring sides of a prism of 64 sides meet at 5.6 degrees, so that only its two rims are feature
  // edges. In a prism of six sides they meet at 60 degrees, and all edges are feature edges.
  const FeatureEdges round = feature_edges_of(prism(64, 1, 0.5), 10);
  ASSERT_EQ(round.lines.size(), 2U);
  EXPECT_TRUE(round.lines[0].is_closed && round.lines[1].is_closed);
  EXPECT_TRUE(round.corners.empty());
  EXPECT_NEAR(length_of(round), 2 * 64 * 2 * std::sin(pi / 64), 1e-13);
  EXPECT_NEAR(length_of(feature_edges_of(prism(6, 1, 0.5), 10)), 12 * 1 + 6 * 0.5, 1e-13);
  EXPECT_TRUE(feature_edges_of(test::torus_mesh(1, 0.4, 48, 24), 10).lines.empty());
}

// Convex vertices are samples from which the surface falls off on both sides: at edges, everywhere on a
// torus, and on the side and the rims of a drum but not on its ends. On the drum's side they count only where
// samples are so far apart that the surface bends noticeably between them: at a spacing of 0.2 m, and not at
// 0.05 m.
TEST(FeatureEdges, ConvexVerticesAreWhereMeshesBendOutward) {
  const auto for_convex_vertices = [](const FeatureEdges& feature_edges, auto&& visit) {
    for (const int bulge : feature_edges.convex_vertices) {
      visit(node(feature_edges, bulge));
      EXPECT_NEAR(feature_edges.inward[static_cast<std::size_t>(bulge)].norm(), 1, 1e-14);
    }
    return feature_edges.convex_vertices.size();
  };
  const FeatureEdges box = feature_edges_of(test::box_mesh(Vec3(-1, -1, -1), Vec3(1, 1, 1)), 0.3);
  EXPECT_GE(
      for_convex_vertices(box, [](const Vec3& x) { EXPECT_GE((x.array().abs() > 1 - 1e-12).count(), 2); }),
      12U * 6U + 8U);
  const TriangleMesh torus = test::torus_mesh(1, 0.4, 48, 24);
  EXPECT_EQ(feature_edges_of(torus, 0.25).convex_vertices.size(), surface_samples(torus, 0.25).size());
  const TriangleMesh drum = prism(128, 1, 0.5);
  const LevelSet drum_shape = LevelSet::mesh(std::make_shared<GridLevelSet>(drum, 64));
  // In m: samples this near a rim may count, because their inward directions average normals around them.
  constexpr double beside = 0.051;
  int on_side = 0;
  const auto is_around = [&](const Vec3& x) {
    EXPECT_GT(std::hypot(x.x(), x.z()), 1 - beside);
    on_side += x.y() > beside && x.y() < 0.5 - beside;
  };
  EXPECT_GT(for_convex_vertices(feature_edges_of(drum, drum_shape, 0.2), is_around), 0U);
  EXPECT_GT(on_side, 2 * pi / 0.2);
  on_side = 0;
  EXPECT_GT(for_convex_vertices(feature_edges_of(drum, drum_shape, 0.05), is_around), 0U);
  EXPECT_EQ(on_side, 0);
}

// The tree finds exactly the corners and convex vertices in a box, also after keep_nodes() has renumbered
// them.
TEST(FeatureEdges, TreeFindsCornersAndConvexVerticesInABox) {
  FeatureEdges feature_edges = feature_edges_of(test::box_mesh(Vec3(-1, -1, -1), Vec3(1, 1, 1)), 0.3);
  const auto expect_found = [&] {
    const Eigen::AlignedBox3d box(Vec3(-2, -0.7, -2), Vec3(-0.5, 2, 1));
    std::vector<int> found, expected;
    feature_edges.corner_tree->query(box, [&](int number) { found.push_back(number); });
    std::sort(found.begin(), found.end());
    for (int i = 0; i < static_cast<int>(feature_edges.corner_count()); ++i)
      if (box.contains(feature_edges.corner(i))) expected.push_back(i);
    EXPECT_EQ(found, expected);
    EXPECT_GE(found.size(), 8U);
    EXPECT_LT(found.size(), feature_edges.corner_count());
  };
  expect_found();
  const std::size_t all = feature_edges.convex_vertices.size();
  std::vector<char> stays;
  for (const Vec3& x : feature_edges.nodes) stays.push_back(x.y() < 0.5);
  keep_nodes(stays, feature_edges);
  EXPECT_LT(feature_edges.convex_vertices.size(), all);
  EXPECT_EQ(feature_edges.corners.size(), 4U);
  for (std::size_t i = 0; i < feature_edges.corner_count(); ++i)
    EXPECT_LT(feature_edges.corner(static_cast<int>(i)).y(), 0.5);
  expect_found();
}

// Dropping nodes splits a closed line into open ones that keep the order of the nodes, and drops corners with
// their nodes.
TEST(FeatureEdges, DroppingNodesSplitsLinesInOrder) {
  FeatureEdges torus = find_feature_edges(LevelSet::torus(2, 0.5), 0.25);
  const FeatureEdges whole = torus;
  std::vector<char> stays(51, 1);
  keep_nodes(stays, torus);
  EXPECT_EQ(torus.nodes, whole.nodes);
  EXPECT_TRUE(torus.lines[0].is_closed);
  // Node 11 is left alone and dropped. The last line goes on past the last node.
  stays[10] = stays[12] = stays[20] = 0;
  keep_nodes(stays, torus);
  ASSERT_EQ(torus.lines.size(), 2U);
  std::vector<Vec3> expected(whole.nodes.begin() + 13, whole.nodes.begin() + 20);
  const auto first = torus.nodes.begin();
  EXPECT_EQ(std::vector<Vec3>(first + torus.lines[0].begin, first + torus.lines[0].end), expected);
  expected.assign(whole.nodes.begin() + 21, whole.nodes.end());
  expected.insert(expected.end(), whole.nodes.begin(), whole.nodes.begin() + 10);
  EXPECT_EQ(std::vector<Vec3>(first + torus.lines[1].begin, first + torus.lines[1].end), expected);
  for (const FeatureEdges::Line& line : torus.lines) {
    EXPECT_FALSE(line.is_closed);
    EXPECT_EQ(line.radius, 0.5);
    EXPECT_EQ(line.around, 2);
  }
  EXPECT_EQ(torus.inward.size(), torus.nodes.size());

  FeatureEdges box = find_feature_edges(LevelSet::box(Vec3(2, 1, 0.5)), 0.3);
  std::vector<char> stays_of_box;
  for (const Vec3& place : box.nodes) stays_of_box.push_back(place.x() > -0.9);
  keep_nodes(stays_of_box, box);
  ASSERT_EQ(box.corners.size(), 4U);
  for (const int corner : box.corners) {
    EXPECT_EQ(node(box, corner).x(), 1);
    EXPECT_EQ(node(box, corner).cwiseAbs(), Vec3(1, 0.5, 0.25));
  }
}

}  // namespace
}  // namespace duet::feature_edges_test
