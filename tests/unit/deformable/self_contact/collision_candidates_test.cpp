#include "sim/deformable/self_contact/collision_candidates.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "tests/support/sheets.h"
#include <gtest/gtest.h>

namespace duet::collision_candidates_test {
namespace {

using test::Sheets;

constexpr double thickness = 0.03;

using Name = std::array<int, 5>;

Name name_of(ElementPair kind, const std::array<int, 4>& p) {
  return {static_cast<int>(kind), p[0], p[1], p[2], p[3]};
}

// Returns whether the elements come within the range of repulsions during the motion, according to nine
// samples of it.
bool come_near(ElementPair kind, const std::array<int, 4>& p, const std::vector<Vec3>& start,
               const std::vector<Vec3>& end) {
  const FourPoints a = corners(p, start), b = corners(p, end);
  for (int i = 0; i <= 8; ++i) {
    FourPoints x;
    for (std::size_t k = 0; k < 4; ++k) x[k] = a[k] + i / 8.0 * (b[k] - a[k]);
    if (closest_points(kind, x).difference.norm() < repulsion_range * thickness) return true;
  }
  return false;
}

// Returns all pairs that come near, by brute force.
std::set<Name> all_near(const CollisionSurface& surface, const std::vector<Vec3>& start,
                        const std::vector<Vec3>& end) {
  std::set<Name> names;
  const auto examine = [&](ElementPair kind, const std::array<int, 4>& p) {
    std::set<int> distinct(p.begin(), p.end());
    if (distinct.size() == 4 && come_near(kind, p, start, end)) names.insert(name_of(kind, p));
  };
  for (const auto& [point] : surface.points)
    for (const Triangle& t : surface.triangles)
      examine(ElementPair::point_triangle, {point, t[0], t[1], t[2]});
  for (std::size_t i = 0; i < surface.edges.size(); ++i)
    for (std::size_t k = i + 1; k < surface.edges.size(); ++k)
      examine(ElementPair::edge_edge,
              {surface.edges[i][0], surface.edges[i][1], surface.edges[k][0], surface.edges[k][1]});
  return names;
}

// Returns the positions of two sheets at a time (s). They fall fast together, wave, and slide over each
// other, so that pairs are nearer at some times and places than at others.
std::vector<Vec3> positions(const Sheets& sheets, double time) {
  std::vector<Vec3> x = sheets.x;
  for (std::size_t p = 0; p < x.size(); ++p) {
    const bool upper = p >= 25;
    const double phase = 3 * sheets.x[p].x() + (upper ? 0.4 : 0.0) + time;
    x[p] += Vec3(upper ? 0.05 * time : 0, 0.02 * std::sin(2 * std::numbers::pi * phase) - 20 * time, 0);
  }
  return x;
}

// Returns the pairs of the candidates that are near at `x`, in their order.
std::vector<Name> near_at(const CollisionCandidates& candidates, const std::vector<Vec3>& x) {
  std::vector<Name> names;
  for (const CandidatePair& pair : candidates.near())
    if (closest_points(pair.kind, corners(pair.particle, x)).difference.norm() < repulsion_range * thickness)
      names.push_back(name_of(pair.kind, pair.particle));
  return names;
}

// Counts over all calls of watch(): awake pairs, kept pairs, and pairs that came near.
struct Watched {
  std::size_t near = 0, pairs = 0, meetings = 0;
};

// Updates the candidates and expects that they contain every pair that comes near, none of them twice, and
// that the near ones do not depend on earlier searches.
void watch(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end,
           CollisionCandidates& candidates, Watched& watched) {
  candidates.update(surface, start, end);
  std::set<Name> awake;
  for (const CandidatePair& pair : candidates.near())
    ASSERT_TRUE(awake.insert(name_of(pair.kind, pair.particle)).second) << "no pair is there twice";
  const std::set<Name> expected = all_near(surface, start, end);
  ASSERT_TRUE(std::includes(awake.begin(), awake.end(), expected.begin(), expected.end()));
  CollisionCandidates fresh;
  fresh.update(surface, start, end);
  ASSERT_EQ(near_at(candidates, start), near_at(fresh, start)) << "whatever was known before";
  watched.near += awake.size();
  watched.pairs += candidates.kept();
  watched.meetings += expected.size();
}

Sheets two_sheets(double gap) {
  Sheets sheets;
  sheets.add(4, 0.1, Vec3(0, 0, 0), thickness);
  sheets.add(3, 0.1, Vec3(0.04, gap, 0.03), thickness);
  return sheets;
}

// No pair of two waving sheets comes near while it sleeps, though most pairs sleep and few motions cause a
// search. A sum of distances that forgets the motion of one of the two elements would let pairs pass.
TEST(CollisionCandidates, WakeAllNearPairsOfWavingSheets) {
  const Sheets sheets = two_sheets(0.06);
  CollisionCandidates candidates;
  Watched watched;
  double time = 0;
  for (int step = 0; step < 60; ++step) {
    const double dt = step % 5 == 4 ? 0.04 : 0.01;
    const std::vector<Vec3> start = positions(sheets, time), end = positions(sheets, time + dt);
    time += dt;
    watch(sheets.surface, start, end, candidates, watched);
    watch(sheets.surface, end, end, candidates, watched);
  }
  EXPECT_GT(watched.meetings, 300U);
  EXPECT_LT(candidates.searches(), 40);  // the sheets make 120 motions
  EXPECT_LT(watched.near, watched.pairs / 4) << "most pairs sleep";
}

// A sheet falls past another one, which stays, and folds one half onto the other. So pairs of one body come
// near, and pairs of two bodies of which only one moves.
TEST(CollisionCandidates, WakeAllNearPairsOfAFoldingSheet) {
  Sheets sheets;
  sheets.add(5, 0.1, Vec3(0, 0, 0), thickness);
  sheets.add(4, 0.1, Vec3(0.52, 0.1, 0.05), thickness);
  const std::size_t first = 36;  // the second sheet begins there and has 25 particles
  const auto at = [&](double time) {
    std::vector<Vec3> x = sheets.x;
    for (std::size_t p = first; p < x.size(); ++p) {
      const double beyond = x[p].x() - 0.72 - 1e-9, angle = 2.9 * std::min(time, 1.0);
      if (beyond > 0) x[p] += beyond * Vec3(std::cos(angle) - 1, std::sin(angle), 0);
      x[p].y() -= 0.3 * time;
    }
    return x;
  };
  CollisionCandidates candidates;
  Watched watched;
  const double dt = 0.02;
  for (int step = 0; step < 60; ++step) {
    watch(sheets.surface, at(step * dt), at((step + 1) * dt), candidates, watched);
    watch(sheets.surface, at(step * dt), at(step * dt), candidates, watched);
  }
  // Returns how many of the pairs that are near at a time are within the second sheet, and how many are not.
  const auto meetings = [&](double time) {
    const std::set<Name> near = all_near(sheets.surface, at(time), at(time));
    const auto within = std::count_if(near.begin(), near.end(), [&](const Name& n) {
      return *std::min_element(n.begin() + 1, n.end()) >= static_cast<int>(first);
    });
    return std::pair(within, static_cast<std::ptrdiff_t>(near.size()) - within);
  };
  EXPECT_GT(meetings(60 * dt).first, 50) << "folded";
  EXPECT_GT(meetings(1 / 3.0).second, 10) << "as it falls past";
  EXPECT_LT(watched.near, watched.pairs / 2) << "most pairs sleep";
}

// Two sheets approach along straight lines. The sums of travels and distances are then exact, and no pair
// wakes before it can come near.
TEST(CollisionCandidates, PairsThatCloseStraightWakeWhenTheyMeet) {
  const double gap = 0.08, speed = 1, dt = 0.0013;
  const Sheets sheets = two_sheets(gap);
  const auto at = [&](double time) {
    std::vector<Vec3> x = sheets.x;
    for (std::size_t p = 25; p < x.size(); ++p) x[p].y() -= speed * time;
    return x;
  };
  CollisionCandidates candidates;
  Watched watched;
  for (int step = 0; step < 60; ++step) {
    const double time = step * dt, closed = gap - speed * (time + dt);
    watch(sheets.surface, at(time), at(time + dt), candidates, watched);
    if (closed > repulsion_range * thickness) {
      EXPECT_EQ(watched.near, 0U) << "step " << step;
    }
  }
  EXPECT_GT(watched.meetings, 1000U);
}

}  // namespace
}  // namespace duet::collision_candidates_test
