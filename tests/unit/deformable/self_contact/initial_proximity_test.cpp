#include "sim/deformable/self_contact/initial_proximity.h"

#include <cmath>

#include <gtest/gtest.h>

namespace duet::initial_proximity_test {
namespace {

constexpr double h = 0.02;  // m, thickness

// Returns a helix about y with the radius 5 h, `segments` segments in each of two turns, and turns `pitch`
// (m) apart.
CollisionSurface helix(int segments, double pitch) {
  std::vector<Vec3> x;
  std::vector<std::array<int, 2>> pieces;
  for (int i = 0; i <= 2 * segments; ++i) {
    const double angle = 2 * EIGEN_PI * i / segments;
    x.emplace_back(5 * h * std::cos(angle), pitch * i / segments, 5 * h * std::sin(angle));
    if (i > 0) pieces.push_back({i - 1, i});
  }
  CollisionSurface surface;
  surface.add({true, h, 0.5}, {}, pieces);
  surface.finish(x);
  return surface;
}

CandidatePair pair_of(const CollisionSurface& surface, std::size_t a, std::size_t b) {
  const auto &first = surface.edges[a], &second = surface.edges[b];
  return {ElementPair::edge_edge, {first[0], first[1], second[0], second[1]}, h, 0.5, true};
}

}  // namespace

TEST(InitialProximity, TurnsOfACoilLieButNeighborsBelong) {
  for (const int segments : {12, 25, 48}) {
    const double length = 2 * EIGEN_PI * 5 * h / segments;
    for (const double pitch : {1.02 * h, 1.3 * h, 1.6 * h}) {
      const CollisionSurface surface = helix(segments, pitch);
      for (int i = 0; i < segments; i += 5) {
        const auto a = static_cast<std::size_t>(i);
        for (std::size_t away = 2; away < 8; ++away) {
          const double gap = static_cast<double>(away - 1) * length;
          const InitialProximity found = initial_proximity(pair_of(surface, a, a + away), true, surface);
          if (gap < 1.3 * h) {
            EXPECT_EQ(found, InitialProximity::belonging);
          }
          if (gap > 1.6 * h) {
            EXPECT_EQ(found, InitialProximity::apart);
          }
        }
        const CandidatePair turns = pair_of(surface, a, a + static_cast<std::size_t>(segments));
        EXPECT_EQ(initial_proximity(turns, true, surface),
                  pitch < 1.5 * h ? InitialProximity::lying : InitialProximity::apart);
        EXPECT_NEAR(initial_distance(turns, surface), pitch, 0.02 * pitch);
        EXPECT_EQ(initial_proximity(turns, false, surface), InitialProximity::apart);
      }
    }
  }
}

// A body with more particles within 3 h than the search has room for counts as near itself.
TEST(InitialProximity, CountsAsNearWhereTheSearchEnds) {
  const CollisionSurface surface = helix(400, 1.3 * h);
  EXPECT_EQ(initial_proximity(pair_of(surface, 100, 500), true, surface), InitialProximity::belonging);
}

}  // namespace duet::initial_proximity_test
