// Static boxes side by side, with coordinates that are exact.
#include "sim/contact/detection/internal_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::internal_edges_test {
namespace {

// Two planks that meet at x = 0 with their tops at y = 0, a step on the right one from x = 1 on that is 1 m
// high, and a box apart.
class Planks : public ::testing::Test {
 protected:
  Planks() : scene_(test::free_space()), simulation_(build()) {}
  Simulation build() {
    const auto add = [&](const std::string& name, const Vec3& position, const Vec3& size) {
      scene::RigidBody& box = test::add_box(scene_, name, position, size, 1);
      box.mass.reset();
      box.is_static = true;
    };
    scene_.ground = scene::Ground{.height = -1, .friction = 0.5, .restitution = 0, .look = {}};
    add("left", Vec3(-2, -0.5, 0), Vec3(4, 1, 4));
    add("right", Vec3(2, -0.5, 0), Vec3(4, 1, 4));
    add("step", Vec3(2, 0.5, 0), Vec3(2, 1, 4));
    add("apart", Vec3(0, 4, 0), Vec3(1, 1, 1));
    test::add_ball(scene_, "ball", Vec3(0, 10, 0), 0.5, 1);
    return Simulation(scene_, test::plan(scene_));
  }
  const Bodies& bodies() { return simulation_.world().bodies; }
  std::vector<int> adjoining(int body) {
    const auto all = bodies().adjoining.of(body);
    return {all.begin(), all.end()};
  }

  scene::Scene scene_;
  Simulation simulation_;
};

TEST_F(Planks, AdjoinWhereTheyTouch) {
  EXPECT_EQ(adjoining(0), (std::vector<int>{1, 5}));
  EXPECT_EQ(adjoining(1), (std::vector<int>{0, 2, 5}));
  EXPECT_EQ(adjoining(5), (std::vector<int>{0, 1}));  // the ground
  EXPECT_EQ(adjoining(2), std::vector<int>{1});
  EXPECT_TRUE(adjoining(3).empty());
  EXPECT_TRUE(adjoining(4).empty());  // it moves
}

// Side by side at the seam the edges of the tops are gone, those of the outer sides are there.
TEST_F(Planks, KeepTheSamplesOfEdgesThatAreLeft) {
  const auto has_sample = [&](std::size_t body, const Vec3& x) {
    const RigidProperties& properties = bodies().rigid.properties[body];
    const Vec3 in_body = bodies().rigid.state[body].pose.to_body(x);
    return std::any_of(properties.samples.begin(), properties.samples.end(),
                       [&](const Vec3& sample) { return (sample - in_body).norm() < 1e-12; });
  };
  EXPECT_FALSE(has_sample(0, Vec3(0, 0, 0)));
  EXPECT_FALSE(has_sample(1, Vec3(0, 0, 0)));
  EXPECT_TRUE(has_sample(0, Vec3(0, 0, 2)));   // the rim that both have in common
  EXPECT_TRUE(has_sample(0, Vec3(-4, 0, 2)));  // a corner
  EXPECT_TRUE(has_sample(2, Vec3(1, 1, 2)));   // the step's edge
  EXPECT_FALSE(has_sample(2, Vec3(1, 0, 0)));  // the corner that it makes with the floor
  for (const RigidProperties& properties : bodies().rigid.properties)
    EXPECT_EQ(properties.samples.size(), properties.inside.size());
}

// So are the ridges; the corners that lines end in stay.
TEST_F(Planks, KeepTheRidgesThatAreLeft) {
  const auto ridge = [&](std::size_t body, const Vec3& x) {  // m, from the nearest line
    const RigidProperties& properties = bodies().rigid.properties[body];
    const Vec3 in_body = bodies().rigid.state[body].pose.to_body(x);
    double nearest = std::numeric_limits<double>::infinity();
    for (const FeatureEdges::Line& line : properties.feature_edges.lines)
      for (auto i = static_cast<std::size_t>(line.begin); i + 1 < static_cast<std::size_t>(line.end); ++i) {
        const Vec3 from = properties.feature_edges.nodes[i],
                   along = properties.feature_edges.nodes[i + 1] - from;
        const double t = std::clamp((in_body - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (from + t * along - in_body).norm());
      }
    return nearest;
  };
  EXPECT_GT(ridge(0, Vec3(0, 0, 0.1)), 0.5);
  EXPECT_GT(ridge(1, Vec3(0, 0, 0.1)), 0.5);
  EXPECT_LT(ridge(0, Vec3(-0.03, 0, 2)), 1e-12);
  EXPECT_LT(ridge(0, Vec3(-4, 0, 0.1)), 1e-12);
  EXPECT_LT(ridge(2, Vec3(1, 1, 0.1)), 1e-12);
  EXPECT_GT(ridge(2, Vec3(1, 0, 0.1)), 0.5);
  EXPECT_EQ(bodies().rigid.properties[3].feature_edges.lines.size(), 12U);
  for (const RigidProperties& properties : bodies().rigid.properties)
    EXPECT_EQ(properties.feature_edges.nodes.size(), properties.feature_edges.inward.size());
}

TEST_F(Planks, KnowTheirSeams) {
  EXPECT_TRUE(is_at_internal_edge(bodies(), 0, Vec3(0, 0, 0.3), 0));
  EXPECT_TRUE(is_at_internal_edge(bodies(), 1, Vec3(0, 0, 0.3), 0));
  EXPECT_TRUE(is_at_internal_edge(bodies(), 1, Vec3(1.5, 0, 0.3), 0));  // under the step
  EXPECT_FALSE(is_at_internal_edge(bodies(), 0, Vec3(-0.1, 0, 0.3), 0));
  EXPECT_TRUE(is_at_internal_edge(bodies(), 0, Vec3(-0.1, 0, 0.3), 0.11));  // up to what it is known
  EXPECT_FALSE(is_at_internal_edge(bodies(), 3, Vec3(0, 3.5, 0), 0));
}

TEST_F(Planks, HideTheirSidesFromEachOther) {
  const Vec3 left(-1, 0, 0), up(0, 1, 0);
  // The right one's side, 1/64 m deep and at the rim, as a point on the left one sees it.
  EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, -1.0 / 64, 0), left)->others_normal, Vec3(0, 0, 0));
  EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, 0, 0), left)->others_normal, up);
  // Their tops, the riser also where it stands on the floor, and sides that look outwards are not hidden.
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0, 0, 0), up));
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0.5, 0, 0), up));
  EXPECT_FALSE(hidden_foot(bodies(), 2, Vec3(1, 0, 0), left));
  EXPECT_FALSE(hidden_foot(bodies(), 2, Vec3(1, 0.5, 0), left));
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0.5, -0.5, 2), Vec3(0, 0, 1)));
  EXPECT_FALSE(hidden_foot(bodies(), 3, Vec3(0, 3.5, 0), -up));
}

// A foot beside the seam, so near that it counts as being on both: there is one top.
TEST_F(Planks, DoNotHideTheirTopsBesideTheSeam) {
  const Vec3 up(0, 1, 0);
  for (const double beside : {1e-16, 1e-12, 1e-9, 1e-6, 1.6e-5, 5e-5, 9.9e-5, 1.1e-4}) {
    EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(beside, 0, 0.3), up)) << beside;
    EXPECT_FALSE(hidden_foot(bodies(), 0, Vec3(-beside, 0, 0.3), up)) << beside;
    EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, -beside, 0.3), Vec3(-1, 0, 0))->others_normal,
              beside < 1e-4 ? up : Vec3(0, 0, 0))
        << beside;
  }
}

TEST_F(Planks, ALowPointLeavesThemUpwards) {
  const Vec3 x(1.0 / 1024, -1.0 / 64, 0), inward = Vec3(0.25, 1, 0).normalized();
  const Exit side{Vec3(-1, 0, 0), 1.0 / 1024};
  const auto hidden = hidden_foot(bodies(), 1, Vec3(0, x.y(), 0), side.normal);
  ASSERT_TRUE(hidden);
  const Exit way = exit_from_union(bodies(), 1, x, inward, side, *hidden);
  EXPECT_EQ(way.normal, Vec3(0, 1, 0));
  EXPECT_NEAR(way.depth, 1.0 / 64, 1e-15);
}

// Of a point below the planks: their tops are too far away.
TEST_F(Planks, TheGroundBelowThemIsHiddenAndStaysTheWayOut) {
  const Vec3 x(-1, -1 - 1.0 / 64, 0), up(0, 1, 0);
  const Exit ground{up, 1.0 / 64};
  const auto hidden = hidden_foot(bodies(), 5, Vec3(-1, -1, 0), up);
  ASSERT_TRUE(hidden);
  const Exit way = exit_from_union(bodies(), 5, x, up, ground, *hidden);
  EXPECT_EQ(way.normal, up);
  EXPECT_EQ(way.depth, 1.0 / 64);
}

TEST_F(Planks, APointAboveTheOneMeetsThePlaneOfBoth) {
  const Vec3 x(-0.25, 1.0 / 1024, 0);
  const HiddenFoot rim{Vec3(0, 0, 0), Vec3(0, 1, 0)};
  const Vec3 normal = x.normalized();
  const Exit way = exit_from_union(bodies(), 1, x, Vec3(0, 1, 0), {normal, -x.norm()}, rim);
  EXPECT_EQ(way.normal, Vec3(0, 1, 0));
  EXPECT_EQ(way.depth, -1.0 / 1024);
}

// A point of a flat body that is level with both tops, and over the left one: it may slide onto the right
// one. Beside both it does not.
TEST_F(Planks, APointLevelWithBothFacesTheOtherPlank) {
  const auto plane_at = [&](const Vec3& x) {
    const Pose& pose = bodies().rigid.state[1].pose;
    return exposed_plane(bodies(), 1, pose, pose.to_body(x), pose.to_body(x + Vec3(0, 0.125, 0)),
                         PointKind::fixed);
  };
  const ContactPlane over = plane_at(Vec3(-0.25, 0, 0));
  EXPECT_TRUE(over.faces);
  EXPECT_EQ(over.normal, Vec3(0, 1, 0));
  EXPECT_EQ(over.gap, 0);
  EXPECT_FALSE(plane_at(Vec3(-0.25, 0, 2.25)).faces);
}

}  // namespace
}  // namespace duet::internal_edges_test
