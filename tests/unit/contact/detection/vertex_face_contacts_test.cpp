#include "sim/contact/detection/vertex_face_contacts.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <random>

#include "tests/support/contacts.h"
#include "tests/support/meshes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/contact/detection/body_bounds.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet::vertex_face_contacts_test {
namespace {

// Returns a cube and a soft box of 2 m about the origin, with cells of 1 m.
scene::Scene cube_and_block() {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "cube", Vec3(0, 9, 0), Vec3::Constant(0.4), 10);
  test::add_soft_box(scene, "block", Vec3::Zero(), Vec3(2, 2, 2), 2);
  return scene;
}

// A scene of a rigid host (body 0) and a soft guest, and the search for vertex-face contacts on it.
class Corners {
 public:
  explicit Corners(const scene::Scene& scene) : simulation_(scene, test::plan(scene)) {}
  Bodies& bodies() { return simulation_.world().bodies; }
  // Moves body 0 such that its first corner is at `x` and the body lies in the direction `inward` from there.
  void put(const Vec3& x, const Vec3& inward) {
    const FeatureEdges& feature_edges = bodies().rigid.properties[0].feature_edges;
    const auto node = static_cast<std::size_t>(feature_edges.corners[0]);
    Pose& pose = bodies().rigid.state[0].pose;
    pose.orientation = shortest_rotation(feature_edges.inward[node], inward);
    pose.position = x - pose.orientation * feature_edges.nodes[node];
  }
  std::vector<EdgeContact> find(double margin) {
    std::vector<BodyBounds> bounds;
    bound_bodies(bodies(), bounds);
    std::vector<EdgeContact> found;
    find_vertex_face_contacts(bodies(), bodies().deformable[0], bounds[0], 0, margin, scratch_, found);
    return found;
  }
  // Returns the normal of a contact in the world.
  Vec3 normal(const EdgeContact& near) { return bodies().rigid.state[0].pose.orientation * near.edge.normal; }
  // Returns the place of a contact on its face, m, world.
  Vec3 surface_point(const EdgeContact& near) {
    const Triangle& face = bodies().triangles[static_cast<std::size_t>(near.edge.face)];
    Vec3 x = Vec3::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      x += near.edge.weight[i] * bodies().particles.x[static_cast<std::size_t>(face[i])];
    return x;
  }

 private:
  Simulation simulation_;
  VertexSearches scratch_;
};

// A corner above, on and below a face has its distance from the face, its place below it and the normal of
// the face; the bounds are rounding.
TEST(VertexFaceContacts, TouchTheFaceBelowThem) {
  Corners corners(cube_and_block());
  EXPECT_TRUE(has_vertex_face_contacts(corners.bodies().deformable[0],
                                       corners.bodies().rigid.properties[0].feature_edges));
  for (const double height : {0.009, 0.0, -0.03}) {
    const Vec3 x(0.31, 1 + height, -0.17);
    corners.put(x, Vec3(0.2, 1, 0.1).normalized());
    const auto found = corners.find(0.01);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].feature.index, 0);
    EXPECT_NEAR(found[0].distance, height, 1e-14);
    EXPECT_LT((corners.normal(found[0]) + Vec3::UnitY()).norm(), 1e-12);  // outward of the cube
    EXPECT_LT((corners.surface_point(found[0]) - Vec3(0.31, 1, -0.17)).norm(), 1e-14);
    const Pose& pose = corners.bodies().rigid.state[0].pose;
    EXPECT_LT((pose.to_world(found[0].edge.foot) - x).norm(), 1e-14);
    EXPECT_LT((pose.to_world(found[0].edge.place) - Vec3(0.31, 1, -0.17)).norm(), 1e-14);
  }
}

// The cube stands on a face that leans by 3 degrees. All its corners touch along the cube's own normal: with
// the normal of the face, contacts with nearly equal normals would make the problem ill-conditioned.
TEST(VertexFaceContacts, UseTheHostsNormalOnFacesThatLieFlat) {
  Corners corners(cube_and_block());
  for (Vec3& x : corners.bodies().particles.x) x.y() += 0.05 * x.x();
  Pose& pose = corners.bodies().rigid.state[0].pose;
  pose.orientation = Quat::Identity();
  pose.position = Vec3(0.31, 1.2 + 0.05 * 0.31, -0.17);
  const auto found = corners.find(0.05);
  ASSERT_EQ(found.size(), 4U);
  for (const EdgeContact& near : found) {
    EXPECT_LT((corners.normal(near) + Vec3::UnitY()).norm(), 1e-14);
    EXPECT_NEAR(std::abs(near.distance), 0.05 * 0.2, 1e-4);  // two corners are above the face, two below
  }
}

// Corners out of reach, too deep, inside of the other body or beside it have no contact with a face.
TEST(VertexFaceContacts, IgnoreFacesBesideOrBehindThem) {
  Corners corners(cube_and_block());
  const auto is_none = [&](const Vec3& x, const Vec3& inward) {
    corners.put(x, inward);
    return corners.find(0.01).empty();
  };
  EXPECT_TRUE(is_none(Vec3(0.31, 1.011, 0), Vec3::UnitY()));                // out of reach
  EXPECT_TRUE(is_none(Vec3(0.31, 0.6, 0), Vec3::UnitY()));                  // too deep
  EXPECT_TRUE(is_none(Vec3(0.31, 0.99, 0), -Vec3::UnitY()));                // the cube is inside of the block
  EXPECT_TRUE(is_none(Vec3(1.005, 1.0, 0), Vec3::UnitY()));                 // beside the block
  EXPECT_TRUE(is_none(Vec3(1.005, 1.004, 0), Vec3(1, 1, 0).normalized()));  // at its rim, askew
}

// A corner of the cube is at a corner of the block, as between stacked boxes. Rounding decides which of the
// block's faces is nearest, but the contact is always with the face that the cube is above.
TEST(VertexFaceContacts, AtACornerUseTheFaceBelowTheirBody) {
  Corners corners(cube_and_block());
  const Vec3 corner(1, 1, 1), inward = Vec3(-1, 1, -1).normalized();
  std::mt19937 random(7);
  for (int i = 0; i < 32; ++i) {
    corners.put(corner + 1e-15 * test::random_vector(random), inward);
    const auto found = corners.find(0.01);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_LT((corners.normal(found[0]) + Vec3::UnitY()).norm(), 1e-12);
  }
}

// The convex vertices of a mesh touch like corners: the tube of a ring lies on the top of the block, and its
// vertices below the margin touch along their own normals.
TEST(VertexFaceContacts, ConvexVerticesTouchAsCorners) {
  // The rows of vertices next to the lowest one are 11 degrees up; those after them are above the margin.
  const double tube = 0.2, depth = 0.01, margin = 0.004;
  scene::Scene scene = cube_and_block();
  scene.rigid.clear();
  test::add_mesh(scene, "ring", std::make_shared<TriangleMesh>(test::torus_mesh(0.5, tube, 64, 32)), 1, 1)
      .shape.cells = 32;
  Corners corners(scene);
  const RigidProperties& properties = corners.bodies().rigid.properties[0];
  Pose& pose = corners.bodies().rigid.state[0].pose;
  const Vec3 thin = Vec3::Unit(std::distance(
      properties.inertia.data(), std::max_element(properties.inertia.data(), properties.inertia.data() + 3)));
  pose.orientation = shortest_rotation(thin, Vec3::UnitY());
  pose.position = Vec3(0.1, 1 + tube - depth, 0.07);
  std::vector<int> expected, found;
  for (int i = 0; i < static_cast<int>(properties.feature_edges.corner_count()); ++i)
    if (pose.to_world(properties.feature_edges.corner(i)).y() < 1 + margin) expected.push_back(i);
  for (const EdgeContact& near : corners.find(margin)) {
    found.push_back(near.feature.index);
    const Vec3 x = pose.to_world(near.edge.foot);
    EXPECT_LT((x - pose.to_world(properties.feature_edges.corner(near.feature.index))).norm(), 1e-12);
    EXPECT_LT((corners.surface_point(near) - Vec3(x.x(), 1, x.z())).norm(), 1e-12);
    const Vec3 from_axis = x - pose.position, flat(from_axis.x(), 0, from_axis.z());
    const Vec3 normal = (from_axis - 0.5 * flat.normalized()).normalized();
    EXPECT_LT((corners.normal(near) - normal).norm(), 0.1);  // the facets of the mesh turn by as much
    EXPECT_LT(near.distance, margin);
  }
  EXPECT_GT(found.size(), 10U);
  EXPECT_EQ(found, expected);
}

// The block is crumpled, and the corner of the cube is anywhere near its boundary: above faces, edges and
// particles. The sign of the distance is compared with a test of all tetrahedra, and its size with the
// nearest point of all triangles. At edges and particles the distance along the normal is less than the
// length, but at least 0.9 * 0.94 of it.
TEST(VertexFaceContacts, HaveTheDistanceFromAnyBoundary) {
  Corners corners(cube_and_block());
  Bodies& bodies = corners.bodies();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random_vector = [&] {
    Vec3 v;
    for (int axis = 2; axis >= 0; --axis) v[axis] = uniform(random);
    return v;
  };
  int inside = 0, outside = 0;
  for (int shape = 0; shape < 20; ++shape) {
    const std::vector<Vec3> rest = bodies.particles.x;
    for (Vec3& x : bodies.particles.x) x += 0.15 * random_vector();
    for (int i = 0; i < 400; ++i) {
      const Vec3 x = 1.1 * random_vector();
      corners.put(x, random_vector().normalized());
      double least = std::numeric_limits<double>::infinity();
      for (const Triangle& t : bodies.triangles) {
        const auto at = [&](std::size_t k) { return bodies.particles.x[static_cast<std::size_t>(t[k])]; };
        least = std::min(least, closest_point_triangle({x, at(0), at(1), at(2)}).difference.norm());
      }
      const bool is_inside = std::any_of(bodies.tets.begin(), bodies.tets.end(), [&](const Tet& tet) {
        Mat3 edges;
        const auto at = [&](std::size_t k) { return bodies.particles.x[static_cast<std::size_t>(tet[k])]; };
        for (int k = 0; k < 3; ++k) edges.col(k) = at(static_cast<std::size_t>(k) + 1) - at(0);
        const Vec3 weight = edges.inverse() * (x - at(0));
        return weight.minCoeff() >= 0 && weight.sum() <= 1;
      });
      for (const EdgeContact& near : corners.find(0.2)) {
        if (near.feature.index != 0) continue;
        EXPECT_EQ(near.distance < 0, is_inside);
        EXPECT_LE(std::abs(near.distance), least + 1e-12);  // above a face it is the distance
        EXPECT_GE(std::abs(near.distance), 0.9 * 0.94 * least);
        EXPECT_NEAR((corners.surface_point(near) - x).norm(), least, 1e-12);
        ++(is_inside ? inside : outside);
      }
    }
    bodies.particles.x = rest;
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(outside, 100);
}

// A corner touches a sheet from either side, on the side from which its body comes even if it has passed
// through, and touches nothing beside it.
TEST(VertexFaceContacts, TouchBothSidesOfASheetNotBesideIt) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "cube", Vec3(0, 9, 0), Vec3::Constant(0.4), 10);
  test::add_material(scene, "canvas");
  test::add_panel(scene, "sheet", Vec3::Zero(), Vec2(2, 2), 2, 0.02);
  Corners corners(scene);
  for (const double side : {1.0, -1.0})
    for (const double height : {0.015, -0.015}) {
      corners.put(Vec3(0.3, side * height, 0.1), side * Vec3::UnitY());
      const auto found = corners.find(0.02);
      ASSERT_EQ(found.size(), 1U);
      EXPECT_NEAR(found[0].distance, height, 1e-14);
      EXPECT_LT((corners.normal(found[0]) + side * Vec3::UnitY()).norm(), 1e-12);
    }
  corners.put(Vec3(1.01, 0.001, 0), Vec3::UnitY());
  EXPECT_TRUE(corners.find(0.02).empty());
}

}  // namespace
}  // namespace duet::vertex_face_contacts_test
