#include "sim/geometry/mesh/sheets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/geometry/level_set/thick_surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet::sheets_test {
namespace {

// Returns the sum of the area vectors of the triangles (m^2), and checks that each of them faces upward.
Vec3 area_vector_of(const Sheet& sheet) {
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : sheet.triangles) {
    const Vec3 &a = sheet.nodes[as_index(t[0])], &b = sheet.nodes[as_index(t[1])],
               &c = sheet.nodes[as_index(t[2])];
    const Vec3 area = (b - a).cross(c - a) / 2;
    EXPECT_GT(area.y(), 0) << "every triangle shows its front upward";
    sum += area;
  }
  return sum;
}

// The area of a panel is its length times its width, and that of a disc of r rings is that of a regular
// polygon of 6 r sides. A triangle that is missing, doubled or turned over changes the sum of area vectors.
TEST(Sheet, PanelsAndDiscsFaceUpwardAndFillTheirOutline) {
  EXPECT_NEAR((area_vector_of(panel(Vec2(3, 2), 5, 4)) - Vec3(0, 6, 0)).norm(), 0, 1e-13);
  const Sheet round = disc(2, 6);
  const double sides = 6 * 6, polygon = sides / 2 * std::sin(2 * std::numbers::pi / sides) * 4;
  EXPECT_NEAR((area_vector_of(round) - Vec3(0, polygon, 0)).norm(), 0, 1e-13);
  EXPECT_EQ(round.nodes.size(), 1U + 3 * 6 * 7);
  EXPECT_EQ(round.triangles.size(), 6U * 6 * 6);
}

// Euler's formula for a sheet without holes: vertices - edges + triangles = 1. Each triangle is found once
// from each of its three edges, as the edge with its opposite corner, which finds lost, doubled and wrongly
// paired edges.
TEST(Sheet, EdgesAreFoundOnceWithTheirOppositeCorners) {
  for (const Sheet& sheet : {panel(Vec2(3, 2), 5, 4), disc(1, 4)}) {
    const std::vector<SheetEdge> found = edges(sheet);
    EXPECT_EQ(sheet.nodes.size() - found.size() + sheet.triangles.size(), 1U);
    std::map<Triangle, int> seen;
    const auto count = [&](int a, int b, int c) {
      Triangle t{a, b, c};
      std::sort(t.begin(), t.end());
      ++seen[t];
    };
    for (const SheetEdge& e : found) {
      count(e.a, e.b, e.opposite);
      if (e.other_opposite >= 0) count(e.a, e.b, e.other_opposite);
    }
    EXPECT_EQ(seen.size(), sheet.triangles.size());
    for (const auto& [t, times] : seen) EXPECT_EQ(times, 3);
  }
}

// Returns the length of the longest segment over that of the shortest one, less 1.
double max_spread(const Curve& curve) {
  double least = 1e9, most = 0;
  for (std::size_t i = 0; i + 1 < curve.nodes.size() + (curve.is_closed ? 1 : 0); ++i) {
    const double length = (curve.nodes[(i + 1) % curve.nodes.size()] - curve.nodes[i]).norm();
    least = std::min(least, length);
    most = std::max(most, length);
  }
  return most / least - 1;
}

TEST(Curve, NodesAreEvenlySpacedFromEndToEnd) {
  const std::vector<Vec3> points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 2, 0), Vec3(1, 2, 5)};
  const Curve open = curve_through(points, 40, CurveEnds::are_apart);
  ASSERT_EQ(open.nodes.size(), 41U);
  EXPECT_NEAR((open.nodes.front() - points.front()).norm(), 0, 1e-12);
  EXPECT_NEAR((open.nodes.back() - points.back()).norm(), 0, 1e-12);
  const Curve closed = curve_through({Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(0, -1, 0)}, 40,
                                     CurveEnds::are_joined);
  EXPECT_EQ(closed.nodes.size(), 40U);
  // Nodes are at equal distances along the arc. Chords of equal arcs differ by the square of the angle by
  // which they bend.
  EXPECT_LT(max_spread(open), 0.05);
  EXPECT_LT(max_spread(closed), 0.05);
  EXPECT_LT(max_spread(torus_knot(1, 0.4, 2, 3, 100)), 0.01);
  EXPECT_LT(max_spread(helix(1, 0.3, 3, 60)), 1e-3);

  const Curve straight = curve_through({Vec3(0, 0, 0), Vec3(3, 0, 0)}, 3, CurveEnds::are_apart);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR((straight.nodes[as_index(i)] - Vec3(i, 0, 0)).norm(), 0, 1e-12);
}

// Three turns of a pitch of 0.5 m rise by 1.5 m. Nodes between the ends are on a fine polygon instead of the
// helix, hence the bound of 1 mm on the radius.
TEST(Curve, HelixRisesByItsPitch) {
  const Curve wire = helix(2, 0.5, 3, 90);
  EXPECT_NEAR(wire.nodes.front().y(), -0.75, 1e-12);
  EXPECT_NEAR(wire.nodes.back().y(), 0.75, 1e-12);
  for (const Vec3& x : wire.nodes) EXPECT_NEAR(std::hypot(x.x(), x.z()), 2, 1e-3);
}

// Checks that every edge of the surface occurs once in each direction, which holds for closed, consistently
// oriented surfaces.
void expect_closed(const Surface& surface) {
  std::map<std::pair<int, int>, int> directed;
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++directed[{t[i].position, t[(i + 1) % 3].position}];
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(directed.contains({edge.second, edge.first}));
  }
}

double volume_of(const Surface& surface) {
  TriangleMesh mesh;
  mesh.positions = surface.positions;
  for (const auto& t : surface.triangles)
    mesh.triangles.push_back({t[0].position, t[1].position, t[2].position});
  return mass_properties(mesh).volume;
}

// The surface of a thick sheet encloses area times thickness, at rest and after a rigid motion, which also
// turns its normals.
TEST(ThickSurface, OfASheetIsClosedAndFollowsIt) {
  const Sheet sheet = panel(Vec2(3, 2), 6, 4);
  const ThickSheet thick(sheet, 0.02);
  expect_closed(thick.rest());
  EXPECT_NEAR(volume_of(thick.rest()), 3 * 2 * 0.02, 1e-12);
  const Quat turn(Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized()));
  std::vector<Vec3> moved;
  for (const Vec3& x : sheet.nodes) moved.push_back(turn * x + Vec3(1, 0, 0));
  Surface surface = thick.rest();
  thick.update(moved, surface);
  EXPECT_NEAR(volume_of(surface), 3 * 2 * 0.02, 1e-12);
  EXPECT_LT((surface.normals[0] - (turn * Vec3::UnitY()).cast<float>()).norm(), 1e-5F);
}

// A tube of 12 sides has the section 6 sin(2 pi / 12) r^2, and its volume is that times its length. The bound
// of 2e-3 is for the bends between the segments of the ring. A ring whose ends do not meet is not closed.
TEST(ThickSurface, OfARodIsClosedAndAsThickAsIt) {
  const double sector = 2 * std::numbers::pi / 12, section = 6 * std::sin(sector) * 0.1 * 0.1;
  const Tube rod(curve_through({Vec3(0, 0, 0), Vec3(3, 0, 0)}, 10, CurveEnds::are_apart), 0.1);
  expect_closed(rod.rest());
  EXPECT_NEAR(volume_of(rod.rest()), 3 * section, 1e-5);
  std::vector<Vec3> circle;
  for (int i = 0; i < 200; ++i) {
    const double angle = 2 * std::numbers::pi * i / 200;
    circle.emplace_back(std::cos(angle), 0.1 * std::sin(2 * angle), std::sin(angle));
  }
  const Curve ring{circle, true};
  const Tube loop(ring, 0.1);
  expect_closed(loop.rest());
  double length = 0;
  for (std::size_t i = 0; i < 200; ++i) length += (circle[(i + 1) % 200] - circle[i]).norm();
  EXPECT_NEAR(volume_of(loop.rest()), length * section, 2e-3 * length * section);
}

}  // namespace
}  // namespace duet::sheets_test
