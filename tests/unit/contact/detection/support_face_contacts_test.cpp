#include "sim/contact/detection/support_face_contacts.h"

#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include "tests/support/contacts.h"
#include "tests/support/meshes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/contact/detection/max_penetration.h"
#include "sim/contact/detection/shape_support_point.h"

namespace duet::support_face_contacts_test {
namespace {

// Returns a ball and a soft box of 2 m about the origin. Its cells are 1 m wide, and its surface points a
// quarter of an edge apart.
scene::Scene ball_and_block(double radius) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "ball", Vec3(0, 9, 0), radius, 10);
  test::add_soft_box(scene, "block", Vec3::Zero(), Vec3(2, 2, 2), 2);
  return scene;
}

// A scene of a rigid host (body 0) and a soft guest, and the searches on it.
class Places {
 public:
  explicit Places(const scene::Scene& scene) : simulation_(scene, test::plan(scene)) {}
  Bodies& bodies() { return simulation_.world().bodies; }
  RigidProperties& host() { return bodies().rigid.properties[0]; }
  Pose& pose() { return bodies().rigid.state[0].pose; }
  std::array<Vec3, 3> corners(int triangle) {
    std::array<Vec3, 3> x;
    for (std::size_t i = 0; i < 3; ++i)
      x[i] = bodies().particles.x[as_index(bodies().triangles[as_index(triangle)][i])];
    return x;
  }
  Vec3 normal(int triangle) {
    const auto [a, b, c] = corners(triangle);
    return (b - a).cross(c - a).normalized();
  }
  std::vector<EdgeContact> find(double margin) {
    std::vector<BodyBounds> bounds;
    bound_bodies(bodies(), bounds);
    std::vector<EdgeContact> found;
    find_support_face_contacts(bodies(), bodies().deformable[0], bounds[0], 0, margin, found);
    return found;
  }
  // Returns the depth (m) of the deepest place of the guest in the host, from a lattice of 40 divisions on
  // each face.
  double deepest_place() {
    constexpr int order = 40;
    double least = 0;
    for (int t = 0; t < static_cast<int>(bodies().triangles.size()); ++t) {
      const auto [a, b, c] = corners(t);
      if (host().shape.distance(pose().to_body((a + b + c) / 3)) > 1.5) continue;  // no face is wider
      for (int i = 0; i <= order; ++i)
        for (int j = 0; i + j <= order; ++j) {
          const Vec3 x = (i * a + j * b + (order - i - j) * c) / order;
          least = std::min(least, host().shape.distance(pose().to_body(x)));
        }
    }
    return -least;
  }
  // Returns the depth (m) of the deepest surface point.
  double deepest_surface_point() {
    double least = 0;
    for (const SurfacePoint& point : bodies().points)
      least = std::min(least, host().shape.distance(pose().to_body(weighted(point, bodies().particles.x))));
    return -least;
  }

 private:
  Simulation simulation_;
};

// Round bodies sink into random places of a crumpled block, at any orientation, by up to a fiftieth of their
// size. The reported penetration is no less than that on a dense lattice, to 1e-4 m: along edges the search
// may miss (precision of the place)^2 / (2 radius). In at least 30 cases the surface points alone show less
// by a millimeter.
TEST(SupportFaceContacts, WithEdgesAndPointsShowEveryOverlap) {
  Places places(ball_and_block(0.1));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Vec3& x : places.bodies().particles.x) x += 0.05 * test::random_vector(random);
  int told = 0, between_points = 0;
  for (const LevelSet& shape :
       {LevelSet::sphere(0.1), LevelSet::sphere(0.4), LevelSet::capsule(0.08, 0.3),
        LevelSet::torus(0.2, 0.06), LevelSet::cylinder(0.15, 0.2), LevelSet::cylinder(0.8, 0.5)}) {
    places.host().shape = shape;
    places.host().feature_edges = find_feature_edges(shape, 0.1);
    for (int i = 0; i < 60; ++i) {
      const auto t =
          static_cast<int>(uniform(random) * static_cast<double>(places.bodies().triangles.size()));
      const double u = uniform(random), v = (1 - u) * uniform(random);
      const auto [a, b, c] = places.corners(t);
      const Vec3 n = places.normal(t);
      const double depth = 0.02 * uniform(random) * shape.min_size();
      places.pose().orientation = test::random_rotation(random);
      const Vec3 in_body = places.pose().orientation.conjugate() * n;
      Vec3 lowest = Vec3::Zero();
      for (int k = 0; k < support_point_count(shape); ++k) {
        const Vec3 x = support_point(shape, k, in_body).position;
        if (x.dot(in_body) < lowest.dot(in_body)) lowest = x;
      }
      places.pose().position =
          (1 - u - v) * a + u * b + v * c - depth * n - places.pose().orientation * lowest;
      const double deepest = places.deepest_place();
      if (deepest > 0.05 * shape.min_size()) continue;  // it is deeper in other faces beside a fold
      ++told;
      between_points += deepest > places.deepest_surface_point() + 1e-3;
      EXPECT_GT(max_penetration(places.bodies(), {}), deepest - 1e-4)
          << static_cast<int>(shape.kind) << ' ' << i;
    }
  }
  EXPECT_GT(told, 300);
  EXPECT_GT(between_points, 30);
}

// Each contact is on the surface of its host, opposite its place in the face, at the normal of the host
// there, and has a number of its own after those of the corners.
TEST(SupportFaceContacts, AreOnTheSurfaceOfTheirBody) {
  Places places(ball_and_block(0.1));
  std::mt19937 random(11);
  for (Vec3& x : places.bodies().particles.x) x += 0.05 * test::random_vector(random);
  const int corners = static_cast<int>(places.host().feature_edges.corner_count());
  int told = 0;
  for (const LevelSet& shape : {LevelSet::sphere(0.1), LevelSet::capsule(0.08, 0.3),
                                LevelSet::torus(0.2, 0.06), LevelSet::cylinder(0.15, 0.2)}) {
    places.host().shape = shape;
    for (int i = 0; i < 300; ++i) {
      places.pose().orientation = test::random_rotation(random);
      places.pose().position = Vec3(0, 1.15, 0) + 0.2 * test::random_vector(random);
      std::set<int> numbers;
      for (const EdgeContact& near : places.find(0.05)) {
        ++told;
        const auto& [place, normal, foot, radius, weight, face] = near.edge;
        EXPECT_NEAR(shape.distance(foot), 0, 1e-15);
        const auto [a, b, c] = places.corners(face);
        EXPECT_LT((weight[0] * a + weight[1] * b + weight[2] * c - places.pose().to_world(place)).norm(),
                  1e-14);
        const Vec3 outward = places.pose().orientation.conjugate() * places.normal(face);
        EXPECT_LT((foot - place).cross(outward).norm(), 1e-8);
        EXPECT_NEAR(near.distance, normal.dot(place - foot), 1e-15);
        if (shape.kind == LevelSet::Kind::cylinder)
          EXPECT_GT(normal.dot(-outward), 0.94);
        else
          EXPECT_LT((normal - shape.normal(foot + 1e-6 * normal)).norm(), 1e-9);
        EXPECT_TRUE(numbers.insert(near.feature.index).second);
        EXPECT_GE(near.feature.index, corners);
      }
    }
  }
  EXPECT_GT(told, 250);
}

// A ball over a face, an edge or a particle of a plane touches at one place. A contact for each of the faces
// around would push with several times the force. There is none out of reach, too deep, or beside the block.
TEST(SupportFaceContacts, TouchAtOnePlaceAboveEdgesOfAPlane) {
  const double radius = 0.1, depth = 0.002;
  Places places(ball_and_block(radius));
  for (const Vec3& x : {Vec3(0.31, 1, 0.12), Vec3(0.5, 1, 0), Vec3(0.5, 1, 0.5), Vec3(0, 1, 0)}) {
    places.pose().position = x + (radius - depth) * Vec3::UnitY();
    const auto found = places.find(0.01);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].distance, -depth, 1e-15);
    EXPECT_LT((found[0].edge.normal + Vec3::UnitY()).norm(), 1e-12);
    EXPECT_LT((places.pose().to_world(found[0].edge.place) - x).norm(), 1e-12);
    const auto [a, b, c] = places.corners(found[0].edge.face);
    const auto& weight = found[0].edge.weight;
    EXPECT_LT((weight[0] * a + weight[1] * b + weight[2] * c - x).norm(), 1e-12);
  }
  const auto is_none = [&](const Vec3& center) {
    places.pose().position = center;
    return places.find(0.01).empty();
  };
  EXPECT_TRUE(is_none(Vec3(0.31, 1 + radius + 0.011, 0.12)));  // out of reach
  EXPECT_TRUE(is_none(Vec3(0.31, 0.6, 0.12)));                 // too deep
  EXPECT_TRUE(is_none(Vec3(1.005, 1 + radius - depth, 0)));    // beside the block
}

// Between the points of a fine face a large ball is less than a four-hundredth of its size deeper than at the
// points (apart^2 / (8 radius)), so the search is left out. For a cylinder it never is.
TEST(SupportFaceContacts, AreSkippedWherePointsAreDense) {
  const double apart = std::sqrt(2) / 4, radius = 2;
  Places places(ball_and_block(radius));
  places.pose().position = Vec3(0.31, 1 + radius - 1e-3, 0.12);
  EXPECT_TRUE(places.find(0.01).empty());
  EXPECT_LT(apart * apart / (8 * radius), 2 * radius / 400);
  EXPECT_FALSE(is_coarse_for(places.host().shape, apart));
  EXPECT_TRUE(is_coarse_for(places.host().shape, 0.21 * radius));
  EXPECT_TRUE(is_coarse_for(LevelSet::cylinder(radius, radius), apart));
}

// A cylinder that lies on its side on the block touches with each rim, at the normal of its side and with a
// number of its own. One that stands on the block touches with one rim, at any of its points.
TEST(SupportFaceContacts, TouchWithTheRimsOfACylinder) {
  Places places(ball_and_block(0.1));
  places.host().shape = LevelSet::cylinder(0.2, 0.3);
  places.host().feature_edges = find_feature_edges(places.host().shape, 0.1);
  places.pose().orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitZ()));
  places.pose().position = Vec3(0.31, 1.2 + 0.001, 0.12);
  const auto found = places.find(0.01);
  ASSERT_EQ(found.size(), 2U);
  std::set<int> numbers;
  for (const EdgeContact& near : found) {
    numbers.insert(near.feature.index);
    EXPECT_NEAR(near.distance, 0.001, 1e-15);
    EXPECT_NEAR(std::abs(near.edge.foot.y()), 0.15, 1e-15);
    EXPECT_LT((places.pose().orientation * near.edge.normal + Vec3::UnitY()).norm(), 1e-14);
    EXPECT_GE(near.feature.index, static_cast<int>(places.host().feature_edges.corner_count()));
  }
  EXPECT_EQ(numbers.size(), 2U);
  places.pose().orientation = Quat::Identity();
  places.pose().position.y() = 1.15 + 0.001;
  const auto standing = places.find(0.01);
  ASSERT_EQ(standing.size(), 1U);
  EXPECT_NEAR(standing[0].distance, 0.001, 1e-15);
  EXPECT_NEAR(standing[0].edge.foot.y(), -0.15, 1e-15);
}

// A sheet touches from either side. The distance is that of the ball from its middle surface; contact
// accounts for the thickness with the contact offset.
TEST(SupportFaceContacts, TouchEitherSideOfASheet) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "ball", Vec3(0, 9, 0), 0.1, 10);
  test::add_material(scene, "canvas");
  test::add_panel(scene, "sheet", Vec3::Zero(), Vec2(2, 2), 2, 0.02);
  Places places(scene);
  for (const double side : {1.0, -1.0}) {
    places.pose().position = Vec3(0.3, side * 0.115, 0.1);
    const auto found = places.find(0.02);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].distance, 0.015, 1e-14);
    EXPECT_LT((found[0].edge.normal + side * Vec3::UnitY()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace duet::support_face_contacts_test
