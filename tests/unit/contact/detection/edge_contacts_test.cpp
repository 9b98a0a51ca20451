#include "sim/contact/detection/edge_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "tests/support/meshes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/contact/detection/contact_point.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/geometry/level_set/grid_level_set.h"

namespace duet::edge_contacts_test {
namespace {

using test::random_rotation;
using test::random_vector;

const Eigen::AlignedBox3d everywhere(Vec3::Constant(-100), Vec3::Constant(100));

// Returns the edge contacts of a guest at `pose` that are less than `margin` (m) from `host`.
std::vector<EdgeContact> edge_contacts(const FeatureEdges& feature_edges, const Pose& pose,
                                       const LevelSet& host, double margin,
                                       const Eigen::AlignedBox3d& near = everywhere) {
  std::vector<EdgeContact> found;
  find_edge_contacts(feature_edges, pose, host, near, margin, found);
  return found;
}

// Returns the gap (m) between the place of an edge contact and its plane, less the radius of the ball there.
double gap_of(const EdgeContact& near, const Pose& pose) {
  return near.edge.normal.dot(pose.to_world(near.edge.place) - near.edge.foot) - near.edge.radius;
}

Quat turned(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis)); }

// Returns the pose of a cube of 1 m that stands on one of its edges. The edge runs along the unit vector
// `along`, the unit vector `normal` bisects the angle between its two faces and leads into the cube, and the
// point of the edge at `beyond` (m, from its middle) is at `place` (m).
Pose cube_on_edge(const Vec3& along, const Vec3& normal, const Vec3& place, double beyond) {
  Mat3 from, to;
  from << Vec3::UnitX(), Vec3(0, 1, 1).normalized(), Vec3(0, -1, 1).normalized();
  to << along, normal, along.cross(normal);
  const Quat orientation(Mat3(to * from.transpose()));
  return {place - orientation * Vec3(beyond, -0.5, -0.5), orientation};
}

// Returns the outward unit normal to both an edge along `along` and the upright edge at x = y = 1/2 of a
// cube. Returns nothing if the edges are almost parallel, or if the normal is almost that of a face: if one
// of its components is less than `least` times the other.
std::optional<Vec3> normal_of_crossing(const Vec3& along, double least) {
  Vec3 normal = along.cross(Vec3::UnitZ());
  if (normal.norm() < 0.3) return std::nullopt;
  normal.normalize();
  if (normal.x() < 0) normal = -normal;
  if (normal.y() < least * normal.x() || normal.x() < least * normal.y()) return std::nullopt;
  return normal;
}

const LevelSet cube = LevelSet::box(Vec3(1, 1, 1));
const LevelSet shapes[] = {LevelSet::box(Vec3(1, 0.6, 0.4)), LevelSet::cylinder(0.4, 0.9),
                           LevelSet::torus(0.6, 0.2), LevelSet::capsule(0.2, 0.8)};

// The edge of one cube crosses the upright edge at x = y = 1/2 of the other one at random angles, before and
// after they touch. Both edges lie in the plane of the contact, so the normal is the one to both edges, and
// the gap is along it. The crossing is at no node of either edge. The bounds are rounding over the distance
// of the two places from which the plane is made, a hundredth of that between nodes. A plane from the level
// set's gradient at one place alone would be that of a face.
TEST(EdgeContacts, OfCrossingEdgesLieInThePlaneOfBoth) {
  const FeatureEdges feature_edges = find_feature_edges(cube, 0.125);
  std::mt19937 random(1);
  int told = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 along = random_vector(random).normalized();
    const std::optional<Vec3> out = normal_of_crossing(along, 0.1);
    if (!out) continue;
    const Vec3& normal = *out;
    const double height = 0.3 * random_vector(random).x(), beyond = 0.2 * random_vector(random).x();
    for (const double gap : {1e-3, -1e-3}) {
      const Pose pose = cube_on_edge(along, normal, Vec3(0.5, 0.5, height) + gap * normal, beyond);
      const auto found = edge_contacts(feature_edges, pose, cube, 0.01);
      ASSERT_EQ(found.size(), 1U);
      const EdgePoint& lowest = found[0].edge;
      EXPECT_LT((lowest.normal - normal).norm(), 1e-10);
      EXPECT_NEAR(gap_of(found[0], pose), gap, 1e-11);
      EXPECT_LT((lowest.place - Vec3(beyond, -0.5, -0.5)).norm(), 0.01);
      EXPECT_EQ(found[0].distance < 0, gap < 0);
      // Along either edge the plane stays right; a displacement along the normal opens the gap by its length.
      RigidProperties host, guest;
      host.shape = guest.shape = cube;
      guest.feature_edges = feature_edges;
      const Pose moved{pose.position + 0.1 * along - 0.2 * Vec3::UnitZ() + 0.5 * normal, pose.orientation};
      const Touch touches = touch(host, Pose(), guest, moved, found[0].feature, lowest);
      EXPECT_NEAR(touches.gap, gap + 0.5, 1e-10);
      EXPECT_EQ(touches.normal, lowest.normal);
      ++told;
    }
  }
  EXPECT_GT(told, 500);
}

// Two rings cross, one of them upright through the tube of the other. Their center lines, circles with a
// radius of 1 m, come nearest at the lowest point of the upper one, over a point of the lower one. The
// upright ring turns in 200 small steps, so that this point passes all places between two nodes.
TEST(EdgeContacts, OfRingsAreThoseOfTheirMiddleLines) {
  const LevelSet ring = LevelSet::torus(1, 0.2);
  const FeatureEdges feature_edges = find_feature_edges(ring, 0.11);
  const double step = 6.283185307179586 / 200;  // a small fraction of the distance between nodes
  for (int i = 0; i < 200; ++i)
    for (const double gap : {2e-3, -2e-3}) {
      const double turn = i * step;
      // The axis of the upright ring is horizontal, across the lower circle.
      const Vec3 place(std::sin(0.7), 0, std::cos(0.7));
      const Quat upright = turned(0.7 + 1.5707963267948966, Vec3::UnitY()) *
                           turned(1.5707963267948966, Vec3::UnitX()) * turned(turn, Vec3::UnitY());
      const Pose pose{place + Vec3(0, 1.4 + gap, 0), upright};
      const auto found = edge_contacts(feature_edges, pose, ring, 0.01);
      ASSERT_FALSE(found.empty());
      const EdgeContact& lowest = *std::min_element(
          found.begin(), found.end(),
          [](const EdgeContact& a, const EdgeContact& b) { return a.distance < b.distance; });
      // Up to 2e-4 of the tube's radius, 0.2 m, arcs touch at another place than the nearest one.
      EXPECT_NEAR(lowest.distance, gap, 4e-5);
      EXPECT_LT((lowest.edge.normal - Vec3::UnitY()).norm(), 2e-2);
    }
}

// A cube lies flat on a plate that is narrower than it. Samples hold it up, and the edge contacts are only
// where its edges pass the edges of the plate, also when it is tilted by 0.002 rad. Without
// EdgesOnFaces::are_found there are none. When it is tilted by 0.05 rad and lifted, so that its edges cross
// those of the plate, the contacts have the planes of both edges.
TEST(EdgeContacts, OfEdgesAlongAFaceAreWhereTheyPassItsEnd) {
  const LevelSet plate = LevelSet::box(Vec3(0.7, 0.2, 3));
  const FeatureEdges feature_edges = find_feature_edges(cube, 0.125);
  for (const double height : {-1e-4, 0.0, 1e-4})
    for (const double tilt : {0.0, 0.002}) {
      const Pose pose{Vec3(0.03, 0.6 + height, 0.1),
                      turned(tilt, Vec3::UnitZ()) * turned(0.3, Vec3::UnitY())};
      auto found = edge_contacts(feature_edges, pose, plate, 0.01);
      EXPECT_EQ(found.size(), 4U) << height << ' ' << tilt;
      for (const EdgeContact& near : found) {
        // Below a face, the side is the nearer surface from as far before the edge as the place is deep.
        EXPECT_NEAR(std::abs(pose.to_world(near.edge.place).x()), 0.35, 1.1e-3) << height << ' ' << tilt;
        EXPECT_LT((near.edge.normal - Vec3::UnitY()).norm(), 1e-12) << height << ' ' << tilt;
      }
      found.clear();
      find_edge_contacts(feature_edges, pose, plate, everywhere, 0.01, found, EdgesOnFaces::are_left_out);
      EXPECT_TRUE(found.empty()) << height << ' ' << tilt;
    }
  const Pose pose{Vec3(0.03, 0.6, 0.1), turned(0.05, Vec3::UnitZ()) * turned(0.3, Vec3::UnitY())};
  const auto found = edge_contacts(feature_edges, pose, plate, 0.05);
  EXPECT_GE(found.size(), 2U);
  for (const EdgeContact& near : found) {
    const double gap = gap_of(near, pose);
    EXPECT_LT(std::abs(near.edge.normal.z()), 1e-9);  // the plate's edge lies in the plane
    EXPECT_NEAR(std::asin(std::abs(near.edge.normal.x())), 0.05, 0.03);
    EXPECT_LT(std::abs(gap), 0.05);
  }
}

// The nodes of the edges are so far apart that one or none of them is over the plate. All places over the
// plate are equally low but for rounding, and rounding must not choose one end: both ends are found for all
// heights and tilts of 1e-9 and all positions of the nodes.
TEST(EdgeContacts, OfEdgesOverAShortFaceAreBothOfItsEnds) {
  const LevelSet plate = LevelSet::box(Vec3(0.7, 0.2, 6));
  const FeatureEdges feature_edges = find_feature_edges(LevelSet::box(Vec3(4, 4, 4)), 0.63);
  for (const double height : {-1e-9, 0.0, 1e-9})
    for (const double tilt : {-1e-9, 0.0, 1e-9})
      for (double shift = 0; shift < 0.7; shift += 0.04) {
        const Pose pose{Vec3(shift, 2.1 + height, 0), turned(tilt, Vec3::UnitZ())};
        const std::string name = fmt::format("height {}, tilt {}, shift {}", height, tilt, shift);
        int ends[2] = {0, 0};
        for (const EdgeContact& near : edge_contacts(feature_edges, pose, plate, 0.01)) {
          const double x = pose.to_world(near.edge.place).x();
          EXPECT_NEAR(std::abs(x), 0.35, 1e-6) << name;
          EXPECT_LT((near.edge.normal - Vec3::UnitY()).norm(), 1e-12) << name;
          ++ends[x > 0 ? 1 : 0];
        }
        EXPECT_EQ(ends[0], 2) << name;
        EXPECT_EQ(ends[1], 2) << name;
      }
}

// A rod has gone through a plate. Along its edges the nearest surface changes from one face of the plate to
// the other, with opposite normals, so there is no plane in which they could touch.
TEST(EdgeContacts, IgnoresEdgesThatHaveGoneThrough) {
  const LevelSet plate = LevelSet::box(Vec3(2, 0.1, 2));
  const FeatureEdges rod = find_feature_edges(LevelSet::box(Vec3(0.2, 3, 0.2)), 0.1);
  EXPECT_TRUE(edge_contacts(rod, {Vec3(0.1, 0.2, 0), turned(0.1, Vec3::UnitX())}, plate, 0.01).empty());
  const FeatureEdges capsule = find_feature_edges(LevelSet::capsule(0.05, 3), 0.1);
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    const Quat slanted = turned(0.7 * random_vector(random).x(), Vec3::UnitX()) *
                         turned(0.7 * random_vector(random).x(), Vec3::UnitZ());
    const Pose pose{Vec3(0.5, 0.5, 0.5).cwiseProduct(random_vector(random)), slanted};
    EXPECT_TRUE(edge_contacts(capsule, pose, plate, 0.01).empty()) << i;
  }
}

// The search skips nodes by their distance from the host. With a box and a margin that let it skip none, the
// same places are found, to the bit. Of a ring that a round body touches on one side, the greater margin also
// shows arcs beside the nearest place, which touch at that place too.
TEST(EdgeContacts, AreTheSameWithNothingSkipped) {
  std::mt19937 random(3);
  int told = 0;
  for (int i = 0; i < 3000; ++i) {
    const LevelSet &guest = shapes[i % 4], &host = shapes[i / 4 % 4];
    const FeatureEdges feature_edges = find_feature_edges(guest, 0.1);
    const Pose pose{0.8 * random_vector(random), random_rotation(random)};
    const double margin = 0.02;
    const Eigen::AlignedBox3d near(host.lower() - Vec3::Constant(margin),
                                   host.upper() + Vec3::Constant(margin));
    const auto found = edge_contacts(feature_edges, pose, host, margin, near);
    auto all = edge_contacts(feature_edges, pose, host, 10);
    all.erase(
        std::remove_if(all.begin(), all.end(), [&](const EdgeContact& a) { return a.distance >= margin; }),
        all.end());
    if (touch_along_ring(guest, host)) {
      const auto is_found = [&](const EdgeContact& a) {
        return std::any_of(found.begin(), found.end(),
                           [&](const EdgeContact& b) { return (a.edge.foot - b.edge.foot).norm() < 1e-9; });
      };
      EXPECT_TRUE(std::all_of(all.begin(), all.end(), is_found));
      std::erase_if(all, [&](const EdgeContact& a) {
        return std::none_of(found.begin(), found.end(),
                            [&](const EdgeContact& b) { return a.feature == b.feature; });
      });
    }
    ASSERT_EQ(found.size(), all.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].feature, all[k].feature);
      EXPECT_EQ(found[k].edge.place, all[k].edge.place);
      ++told;
    }
  }
  EXPECT_GT(told, 300);
}

// Distances (m, negative inside) from a dense look along the feature edges of one body or both: `least` is
// the smallest of all places, and `known` that of the nodes and the contacts found.
struct DenseLook {
  double least = std::numeric_limits<double>::infinity(), known = least;
};

// Looks at the feature edges of `guest` at `pose`, 20 places between two nodes, and updates `look`.
void look_densely(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host,
                  PairDirection direction, const LevelSet& guest, DenseLook& look) {
  if (can_touch_with_feature_edges(guest, host, direction))
    for (const EdgeContact& near : edge_contacts(feature_edges, pose, host, 0.02))
      look.known = std::min(look.known, near.distance);
  for (const FeatureEdges::Line& line : feature_edges.lines) {
    const int count = line.end - line.begin;
    const auto node = [&](int i) { return feature_edges.nodes[as_index(line.begin + i % count)]; };
    for (int i = 0; i < (line.is_closed ? count : count - 1); ++i)
      for (int k = 0; k <= 20; ++k) {
        const Vec3 x = place_between(line, node(i), node(i + 1), k / 20.0);
        const double distance = host.distance(pose.to_world(x)) - line.radius;
        look.least = std::min(look.least, distance);
        if (k % 20 == 0) look.known = std::min(look.known, distance);
      }
  }
}

// Random bodies approach until they overlap by up to 1 cm. No place on the feature edges of either is deeper
// than the nodes and the edge contacts found by more than the fall that counts as flat (`min_fall`), 0.005 of
// the distance of up to 0.1 m between nodes. A first touch that is missed would let bodies sink into each
// other until the next sample.
TEST(EdgeContacts, MissNothingOfAFirstTouch) {
  std::mt19937 random(4);
  int told = 0;
  for (int i = 0; i < 640; ++i) {
    const LevelSet &guest = shapes[i % 4], &host = shapes[i / 4 % 4];
    const FeatureEdges feature_edges = find_feature_edges(guest, 0.1), others = find_feature_edges(host, 0.1);
    const Vec3 from = random_vector(random).normalized(), beside = 0.3 * random_vector(random);
    const Quat orientation = random_rotation(random);
    DenseLook look;
    for (double way = 3; way > 0 && !(look.least <= 0); way -= std::max(look.least, 0.01)) {
      const Pose pose{beside + way * from, orientation};
      const Pose inverse{-(orientation.conjugate() * pose.position), orientation.conjugate()};
      look = {};
      look_densely(feature_edges, pose, host, PairDirection::as_found, guest, look);
      look_densely(others, inverse, guest, PairDirection::reversed, host, look);
    }
    if (look.least > 0) continue;  // the bodies miss each other, or one goes through a ring
    ++told;
    EXPECT_GT(look.least, -0.01);
    EXPECT_LT(look.known - look.least, 0.005 * 0.1) << i;
  }
  EXPECT_GT(told, 300);
}

// The grid of a mesh rounds off its edges by a third of a cell, here 2 cm. The edge contacts are those of the
// exact surface, with the bounds of two boxes.
TEST(EdgeContacts, OnAMeshAreThoseOfItsExactSurface) {
  const LevelSet mesh = LevelSet::mesh(
      std::make_shared<GridLevelSet>(test::box_mesh(Vec3::Constant(-0.5), Vec3::Constant(0.5)), 16));
  ASSERT_GT(mesh.tolerance(), 0.06);
  const FeatureEdges feature_edges = find_feature_edges(cube, 0.125);
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    const Vec3 normal = Vec3(1, 1 + 0.5 * random_vector(random).x(), 0).normalized(),
               along = (normal.cross(Vec3::UnitZ()) + 0.7 * random_vector(random).x() * Vec3::UnitZ())
                           .normalized();
    const double height = 0.3 * random_vector(random).x(), beyond = 0.2 * random_vector(random).x();
    for (const double gap : {9e-3, 1e-3, -1e-3}) {
      const Pose pose = cube_on_edge(along, normal, Vec3(0.5, 0.5, height) + gap * normal, beyond);
      const auto found = edge_contacts(feature_edges, pose, mesh, 0.01);
      ASSERT_EQ(found.size(), 1U);
      EXPECT_LT((found[0].edge.normal - normal).norm(), 1e-10);
      EXPECT_NEAR(gap_of(found[0], pose), gap, 1e-11);
      EXPECT_NEAR(found[0].edge.place.x(), beyond, 0.01 * 0.125);
    }
  }
}

// A thin plate leans on the upright edge of a box, across it. Only its two rims on the side of the box touch.
// Those on the other side are only 1 cm farther and must not: they face away.
TEST(EdgeContacts, IgnoresRimsThatFaceAway) {
  const LevelSet post = LevelSet::box(Vec3(1, 1, 3));
  const FeatureEdges plate = find_feature_edges(LevelSet::box(Vec3(1, 1, 0.01)), 0.125);
  const Quat leaning = turned(0.7853981633974483, Vec3::UnitZ()) * turned(1.5707963267948966, Vec3::UnitY());
  const Pose pose{Vec3(0.5, 0.5, 0) + leaning * Vec3(0, 0, 0.006), leaning};
  const auto found = edge_contacts(plate, pose, post, 0.05);
  EXPECT_EQ(found.size(), 2U);
  for (const EdgeContact& near : found) {
    EXPECT_NEAR(near.distance, 0.001, 1e-3);
    EXPECT_LT(near.edge.place.z(), 0);
  }
}

// The feature edges of two round bodies are searched in one of the two directions of their pair. Otherwise
// their center lines would be found twice, with two contacts at one place.
TEST(EdgeContacts, OfRoundBodiesAreSearchedInOneDirection) {
  using enum PairDirection;
  const LevelSet ring = LevelSet::torus(1, 0.2), ball = LevelSet::sphere(1);
  EXPECT_TRUE(can_touch_with_feature_edges(ring, ring, as_found));
  EXPECT_FALSE(can_touch_with_feature_edges(ring, ring, reversed));
  EXPECT_TRUE(
      can_touch_with_feature_edges(ring, cube, reversed));  // its center line over the edges of the cube
  EXPECT_FALSE(can_touch_with_feature_edges(cube, ring, reversed));
  EXPECT_TRUE(can_touch_with_feature_edges(cube, cube, reversed));
  EXPECT_FALSE(can_touch_with_feature_edges(ring, ball, reversed));
  EXPECT_FALSE(can_touch_with_feature_edges(cube, LevelSet::half_space(), as_found));
}

// A soft edge crosses the upright edge at x = y = 1/2 of a cube. The contact has the plane of both edges
// wherever between the points of the soft edge they cross; the bounds are rounding, as for two rigid edges.
TEST(EdgeContacts, OfSoftEdgesLieInThePlaneOfBoth) {
  const FeatureEdges feature_edges = find_feature_edges(cube, 0.125);
  EXPECT_TRUE(can_touch_soft_edges(cube, feature_edges));
  std::mt19937 random(2);
  std::vector<double> scratch;
  int told = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 along = random_vector(random).normalized();
    const std::optional<Vec3> out = normal_of_crossing(along, 0.3);
    if (!out) continue;
    const Vec3& normal = *out;
    const double height = 0.2 * random_vector(random).x(), share = 0.5 + 0.3 * random_vector(random).x();
    for (const double gap : {2e-3, -2e-3, -2e-2}) {
      const Vec3 place = Vec3(0.5, 0.5, height) + gap * normal;
      const Vec3 first = place - 0.4 * share * along, second = first + 0.4 * along;
      const auto near = edge_contact_on(first, second, 4, cube, 0.01, scratch);
      ASSERT_TRUE(near);
      const EdgePoint& lowest = near->edge;
      EXPECT_LT((lowest.normal - normal).norm(), 1e-10);
      // The place is known to a hundredth of a quarter of the edge, and it is off by up to 1.5 gaps because
      // the bisector of the two faces leans from the normal.
      EXPECT_NEAR(lowest.weight[1], share, 0.005 + 1.5 * std::abs(gap) / 0.4);
      EXPECT_NEAR(normal.dot(first + lowest.weight[1] * (second - first) - lowest.foot), gap, 1e-11);
      EXPECT_EQ(near->distance < 0, gap < 0);
      ++told;
    }
  }
  EXPECT_GT(told, 500);
}

// Edges that are out of reach are left out early. The others have the same contact, to the bit, as with a
// margin that leaves none out.
TEST(EdgeContacts, OfSoftEdgesAreTheSameWithNothingSkipped) {
  const LevelSet mesh = LevelSet::mesh(
      std::make_shared<GridLevelSet>(test::box_mesh(Vec3::Constant(-0.5), Vec3::Constant(0.5)), 16));
  std::mt19937 random(8);
  std::vector<double> scratch;
  int found = 0, left_out = 0;
  for (int i = 0; i < 6000; ++i) {
    const LevelSet& host = i % 2 == 0 ? mesh : cube;
    const Vec3 first = 0.8 * random_vector(random), second = first + 0.5 * random_vector(random);
    const int parts = 2 + i % 3;
    const auto all = edge_contact_on(first, second, parts, host, 10, scratch);
    for (const double margin : {0.02, 0.1}) {
      const auto near = edge_contact_on(first, second, parts, host, margin, scratch);
      ASSERT_EQ(near.has_value(), all && all->distance < margin);
      ++(near ? found : left_out);
      if (near) {
        EXPECT_EQ(near->distance, all->distance);
        EXPECT_EQ(near->edge.place, all->edge.place);
        EXPECT_EQ(near->edge.normal, all->edge.normal);
      }
    }
  }
  EXPECT_GT(found, 1000);
  EXPECT_GT(left_out, 1000);
}

// An edge that lies on the face has no minimum of the distance, and one that rises from it is lowest at its
// end. Either touches at the plane of the face, as it does before and after, so that the contact does not
// vanish when a body tilts. An edge that comes down on the face from beyond it is found as well. The bound of
// 0.002 m on the place is twice the precision of the place, a hundredth of a part of the edge.
TEST(EdgeContacts, OfSoftEdgesAreKeptWhereTheyOnlyRise) {
  std::vector<double> scratch;
  for (const double rise : {0.0, 0.02, -0.02}) {
    const Vec3 first(0.4, 0.5001 + 0.1 * rise, 0), second(0.8, 0.5001 + 0.5 * rise, 0);
    for (const bool is_reversed : {false, true}) {
      const auto near =
          edge_contact_on(is_reversed ? second : first, is_reversed ? first : second, 4, cube, 0.01, scratch);
      ASSERT_TRUE(near);
      if (rise < 0) continue;
      EXPECT_LT((near->edge.normal - Vec3::UnitY()).norm(), 1e-12);
      EXPECT_NEAR(near->edge.foot.x(), 0.5, 0.002);
      EXPECT_NEAR(near->distance, 1e-4 + rise * (near->edge.place.x() - 0.3), 1e-6);
    }
  }
}

// Surface points carry edges that lie on a face, cross it or end above it: these have no edge contact. Edges
// out of reach and edges that have gone through the body have none either, and a half space has no edges at
// all.
TEST(EdgeContacts, OfSoftEdgesAreNoneBesideTheEdgesOfTheHost) {
  std::vector<double> scratch;
  const auto is_none = [&](const Vec3& first, const Vec3& second, double margin) {
    return !edge_contact_on(first, second, 4, cube, margin, scratch);
  };
  EXPECT_TRUE(is_none(Vec3(-0.2, 0.5, 0), Vec3(0.2, 0.4999, 0), 0.01));
  EXPECT_TRUE(is_none(Vec3(-0.1, 0.6, 0), Vec3(0.1, 0.45, 0), 0.01));
  EXPECT_TRUE(is_none(Vec3(0.3, 0.72, 0), Vec3(0.72, 0.3, 0), 0.01));
  EXPECT_FALSE(is_none(Vec3(0.3, 0.72, 0), Vec3(0.72, 0.3, 0), 0.02));
  const LevelSet plate = LevelSet::box(Vec3(2, 0.2, 2));
  EXPECT_FALSE(edge_contact_on(Vec3(0.1, -0.6, 0), Vec3(0.2, 0.6, 0), 4, plate, 0.01, scratch));
  EXPECT_FALSE(can_touch_soft_edges(LevelSet::half_space(), find_feature_edges(LevelSet::half_space(), 0.1)));
}

// The place on a soft edge is the one nearest to a ball, a ring or a rod, at the known nearest point between
// the ends. There is no contact if the nearest place is an end of the edge.
TEST(EdgeContacts, OfSoftEdgesAreTheNearestToRoundBodies) {
  std::vector<double> scratch;
  const LevelSet ball = LevelSet::sphere(0.5), ring = LevelSet::torus(0.6, 0.2),
                 rod = LevelSet::capsule(0.2, 2);
  const double height = 0.01;
  const auto expect_place = [&](const LevelSet& host, const Vec3& x, const Vec3& normal, const Vec3& along) {
    for (const double at : {0.03, 0.5, 0.6, 0.97}) {
      const Vec3 place = x + height * normal;
      const auto near = edge_contact_on(place - at * along, place + (1 - at) * along, 4, host, 0.02, scratch);
      ASSERT_TRUE(near.has_value()) << at;
      EXPECT_NEAR(near->distance, height,
                  3e-5);  // precision 1/100 of 1/4 m, squared over a diameter
      EXPECT_LT((near->edge.place - place).norm(), 0.01 * along.norm() / 4);
      EXPECT_GT(near->edge.normal.dot(normal), 1 - 1e-4);
      EXPECT_NEAR(near->edge.weight[1], at, 0.0025);
    }
  };
  expect_place(ball, Vec3(0, 0.5, 0), Vec3::UnitY(), Vec3(1, 0, 0));
  expect_place(ring, Vec3(0.6, 0.2, 0), Vec3::UnitY(), Vec3(1, 0, 0));
  expect_place(rod, Vec3(0.2, 0.3, 0), Vec3::UnitX(), Vec3(0, 0, 1));
  const auto is_none = [&](const Vec3& first, const Vec3& second, double margin) {
    return !edge_contact_on(first, second, 4, ball, margin, scratch);
  };
  EXPECT_TRUE(is_none(Vec3(0, 0.501, 0), Vec3(0, 1.501, 0), 0.01));       // its end is nearest
  EXPECT_TRUE(is_none(Vec3(0.4, 0.501, 0), Vec3(1, 0.501, 0), 0.5));      // its end is nearest, slantwise
  EXPECT_TRUE(is_none(Vec3(-0.4, 0.511, 0), Vec3(0.6, 0.511, 0), 0.01));  // out of reach
}

// A small body lies on a large table and reaches over the table's edge at x = 0. The edge contacts are where
// its edges, rim or circle pass that edge. Without them a body would have no contact between its last sample
// on the table and the table's edge.
TEST(EdgeContacts, AreWhereEdgesOnAFacePassItsEnd) {
  const LevelSet table = LevelSet::box(Vec3(10, 1, 10));  // its top is at y = 0, from x = -10 to 0
  const auto on_table = [&](const LevelSet& shape, double spacing, const Pose& pose) {
    const Pose in_table{pose.position + Vec3(5, 0.5, 0), pose.orientation};
    std::vector<Vec3> places;
    for (const EdgeContact& near : edge_contacts(find_feature_edges(shape, spacing), in_table, table, 0.01)) {
      EXPECT_LT((near.edge.normal - Vec3::UnitY()).norm(), 1e-12);
      EXPECT_NEAR(near.distance, 0, 1e-12);
      places.push_back(in_table.to_world(near.edge.place) - Vec3(5, 0.5 + near.edge.radius, 0));
    }
    std::sort(places.begin(), places.end(), [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
    return places;
  };
  for (const double x : {-0.31, -0.05, 0.0, 0.2})
    for (const double spacing : {0.05, 0.13}) {
      const std::vector<Vec3> of_box =
          on_table(LevelSet::box(Vec3(1, 0.4, 0.6)), spacing, {Vec3(x, 0.2, 0.1)});
      ASSERT_EQ(of_box.size(), 2u) << x << " " << spacing;
      EXPECT_LT((of_box[0] - Vec3(0, 0, -0.2)).norm(), 1e-9);
      EXPECT_LT((of_box[1] - Vec3(0, 0, 0.4)).norm(), 1e-9);
      const double half = std::sqrt(0.16 - x * x);
      for (const LevelSet& round : {LevelSet::cylinder(0.4, 0.4), LevelSet::torus(0.4, 0.1)}) {
        const double height = round.kind == LevelSet::Kind::torus ? 0.1 : 0.2;
        const std::vector<Vec3> of_round = on_table(round, spacing, {Vec3(x, height, 0.1)});
        ASSERT_EQ(of_round.size(), 2u) << x << " " << spacing;
        // Normals there turn by 1e-6 within the precision of the place.
        EXPECT_LT((of_round[0] - Vec3(0, 0, 0.1 - half)).norm(), 1e-6);
        EXPECT_LT((of_round[1] - Vec3(0, 0, 0.1 + half)).norm(), 1e-6);
      }
    }
  // Beside the table and level with its top there is nothing to touch.
  EXPECT_TRUE(on_table(LevelSet::box(Vec3(1, 0.4, 20)), 0.1, {Vec3(0.51, 0.2, 0)}).empty());
}

}  // namespace
}  // namespace duet::edge_contacts_test
