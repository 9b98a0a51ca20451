#include "sim/geometry/level_set/round_surface.h"

#include <algorithm>
#include <set>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/geometry/level_set/shape_samples.h"

namespace duet::round_surface_test {
namespace {

// A mesh with its samples and its round parts.
struct Made {
  TriangleMesh mesh;
  std::vector<MeshSample> samples;
  RoundSurface round;
};

Made make(const TriangleMesh& mesh, double spacing) {
  Made made{mesh, mesh_samples(mesh, spacing), {}};
  made.round = find_round_surface(mesh, made.samples);
  return made;
}

// Returns the vertex of a surface that is lowest above y = 0.
int lowest_of_all(const RoundSurface& round, const Pose& pose) {
  const auto height = [&](const Vec3& x) { return pose.to_world(x).y(); };
  const auto found = std::min_element(round.vertices.begin(), round.vertices.end(),
                                      [&](const Vec3& a, const Vec3& b) { return height(a) < height(b); });
  return static_cast<int>(found - round.vertices.begin());
}

}  // namespace

TEST(RoundSurface, HasTheVerticesBetweenBluntEdgesOnly) {
  EXPECT_TRUE(make(test::box_mesh(-Vec3::Ones(), Vec3::Ones()), 0.3).round.vertices.empty());
  const TriangleMesh ball = test::ball_mesh(1, 32, 16);
  EXPECT_EQ(make(ball, 0.3).round.vertices.size(), ball.positions.size());
  EXPECT_TRUE(make(test::torus_mesh(1, 0.3, 8, 8), 0.3).round.vertices.empty()) << "45 degrees are sharp";
}

TEST(RoundSurface, EveryVertexBelongsToAPatchWithinItsReach) {
  for (const double spacing : {0.1, 0.3, 1.0}) {
    const RoundSurface round = make(test::torus_mesh(1, 0.3, 48, 24), spacing).round;
    ASSERT_EQ(round.patch.size(), round.vertices.size());
    std::set<int> starts;
    for (const RoundSample& sample : round.at_sample)
      if (sample.patch >= 0) starts.insert(sample.patch);
    for (std::size_t v = 0; v < round.vertices.size(); ++v) {
      const int start = round.patch[v];
      ASSERT_TRUE(starts.contains(start));
      EXPECT_LE((round.vertices[v] - round.vertices[as_index(start)]).norm(), round.reach[as_index(start)]);
    }
  }
}

// Samples on edges and faces of a coarse ball are told from those at its vertices.
TEST(RoundSurface, TellsSamplesOnEdgesFromThoseAtVertices) {
  const Made made = make(test::ball_mesh(1, 16, 8), 0.1);
  ASSERT_EQ(made.round.at_sample.size(), made.samples.size());
  std::size_t vertices = 0, others = 0;
  for (std::size_t i = 0; i < made.samples.size(); ++i) {
    const RoundSample& sample = made.round.at_sample[i];
    ASSERT_TRUE(sample.is_between_vertices());
    const double off = (made.round.vertices[as_index(sample.corner[0])] - made.samples[i].position).norm();
    EXPECT_EQ(sample.patch >= 0, off == 0);
    (sample.patch >= 0 ? vertices : others) += 1;
  }
  EXPECT_EQ(vertices, made.mesh.positions.size());
  EXPECT_GT(others, vertices);
}

// A ball is convex: whatever its pose and wherever the way begins, it ends at the lowest of all vertices, or
// no higher than the slope that counts as level allows.
TEST(RoundSurface, TheWayDownEndsAtTheLowestVertex) {
  std::mt19937 random(3);
  const RoundSurface round = make(test::ball_mesh(1, 48, 24), 0.5).round;
  const LevelSet ground = LevelSet::half_space();
  for (int i = 0; i < 50; ++i) {
    const Pose pose{test::random_vector(random), test::random_rotation(random)};
    const double lowest = pose.to_world(round.vertices[as_index(lowest_of_all(round, pose))]).y();
    for (const RoundSample& sample : round.at_sample) {
      const int start = sample.patch;
      if (start < 0) continue;
      const RoundPlace place = lowest_vertex(round, start, pose, ground);
      EXPECT_LT(place.distance - lowest, 1e-4 * 2);
      const std::optional<RoundPlace> in_patch = lowest_in_patch(round, start, pose, ground);
      EXPECT_EQ(in_patch.has_value(), round.patch[as_index(place.vertex)] == start);
      EXPECT_EQ(in_patch.value_or(place).vertex, place.vertex);
      EXPECT_EQ(place.distance, pose.to_world(round.vertices[as_index(place.vertex)]).y());
    }
  }
}

// All corners of a quad are neighbors, also the two without an edge between them; those of two facets are
// not.
TEST(RoundSurface, TheCornersOfAFlatFacetAreNeighbors) {
  constexpr int columns = 24, rows = 12;
  const RoundSurface round = make(test::ball_mesh(1, columns, rows), 0.3).round;
  const auto are_neighbors = [&](int a, int b) {
    const auto begin = round.neighbors.begin();
    return std::count(begin + round.first[as_index(a)], begin + round.first[as_index(a) + 1], b) == 1;
  };
  for (int row = 0; row + 2 < rows; ++row)
    for (int i = 0; i < columns; ++i) {
      const int upper = 1 + row * columns, lower = upper + columns, k = (i + 1) % columns;
      EXPECT_TRUE(are_neighbors(upper + i, lower + k)) << "row " << row << " column " << i;
      EXPECT_TRUE(are_neighbors(upper + k, lower + i)) << "row " << row << " column " << i;
      EXPECT_FALSE(are_neighbors(upper + i, upper + (i + 2) % columns));
    }
}

// Lying on a quad, a ball has four vertices that are level: from each of them the three others are visited.
// Tilted by three times the slope that counts as level it has one or two.
TEST(RoundSurface, TheCornersOfAFacetThatLiesFlatAreLevel) {
  const TriangleMesh ball = test::ball_mesh(1, 24, 12);
  const RoundSurface round = make(ball, 0.3).round;
  const LevelSet ground = LevelSet::half_space();
  for (const std::size_t t : {std::size_t{100}, std::size_t{201}}) {
    const Vec3 normal = area_vector(ball, t).normalized();
    const Pose flat{Vec3::Zero(), Quat::FromTwoVectors(normal, -Vec3::UnitY())};
    const Pose tilted{Vec3::Zero(), exponential(Vec3(3 * level_slope, 0, 0)) * flat.orientation};
    for (const int corner : ball.triangles[t]) {
      const RoundPlace lowest = lowest_vertex(round, corner, flat, ground);
      EXPECT_EQ(lowest.vertex, corner);
      int level = 0;
      visit_level_vertices(round, lowest, flat, ground, [&](const RoundPlace&) { ++level; });
      EXPECT_EQ(level, 3);
      int after = 0;
      visit_level_vertices(round, lowest_vertex(round, corner, tilted, ground), tilted, ground,
                           [&](const RoundPlace&) { ++after; });
      EXPECT_LT(after, 2);
    }
  }
}

}  // namespace duet::round_surface_test
