// Static boxes side by side are one surface. All coordinates are exact doubles.
#include "sim/contact/detection/internal_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::internal_edges_test {
namespace {

// Two planks that meet at x = 0 with their tops at y = 0; on the right one, from x = 1 on, a step of 1 m; and
// a box that touches none of them. All stand on a ground or float above it.
class InternalEdges : public ::testing::Test {
 protected:
  InternalEdges() : scene_(test::free_space()), simulation_(build()) {}
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

// Static bodies that touch are listed with each other, the ground included; bodies apart and dynamic ones are
// not.
TEST_F(InternalEdges, AdjoinWhereTheyTouch) {
  EXPECT_EQ(adjoining(0), (std::vector<int>{1, 5}));
  EXPECT_EQ(adjoining(1), (std::vector<int>{0, 2, 5}));
  EXPECT_EQ(adjoining(5), (std::vector<int>{0, 1}));  // body 5 is the ground
  EXPECT_EQ(adjoining(2), std::vector<int>{1});
  EXPECT_TRUE(adjoining(3).empty());
  EXPECT_TRUE(adjoining(4).empty());  // body 4 moves
}

// Where the planks adjoin, the samples along the edges of their tops are gone; those of edges at the outside
// stay. A sample that is left at the internal edge is a bump that bodies collide with.
TEST_F(InternalEdges, KeepTheSamplesOfExposedEdges) {
  const auto has_sample = [&](std::size_t body, const Vec3& x) {
    const RigidProperties& properties = bodies().rigid.properties[body];
    const Vec3 in_body = bodies().rigid.state[body].pose.to_body(x);
    return std::any_of(properties.samples.begin(), properties.samples.end(),
                       [&](const Vec3& sample) { return (sample - in_body).norm() < 1e-12; });
  };
  EXPECT_FALSE(has_sample(0, Vec3(0, 0, 0)));
  EXPECT_FALSE(has_sample(1, Vec3(0, 0, 0)));
  EXPECT_TRUE(has_sample(0, Vec3(0, 0, 2)));   // the rim that both planks have in common
  EXPECT_TRUE(has_sample(0, Vec3(-4, 0, 2)));  // a corner
  EXPECT_TRUE(has_sample(2, Vec3(1, 1, 2)));   // the step's edge
  EXPECT_FALSE(has_sample(2, Vec3(1, 0, 0)));  // the concave corner between step and floor
  for (const RigidProperties& properties : bodies().rigid.properties)
    EXPECT_EQ(properties.samples.size(), properties.inside.size());
}

// Feature edges at internal edges are gone, like the samples there. The lines keep the vertices in which they
// end.
TEST_F(InternalEdges, KeepTheExposedFeatureEdges) {
  const auto edge_distance = [&](std::size_t body,
                                 const Vec3& x) {  // m: distance of x from the nearest feature edge
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
  EXPECT_GT(edge_distance(0, Vec3(0, 0, 0.1)), 0.5);
  EXPECT_GT(edge_distance(1, Vec3(0, 0, 0.1)), 0.5);
  EXPECT_LT(edge_distance(0, Vec3(-0.03, 0, 2)), 1e-12);
  EXPECT_LT(edge_distance(0, Vec3(-4, 0, 0.1)), 1e-12);
  EXPECT_LT(edge_distance(2, Vec3(1, 1, 0.1)), 1e-12);
  EXPECT_GT(edge_distance(2, Vec3(1, 0, 0.1)), 0.5);
  EXPECT_EQ(bodies().rigid.properties[3].feature_edges.lines.size(), 12U);
  for (const RigidProperties& properties : bodies().rigid.properties)
    EXPECT_EQ(properties.feature_edges.nodes.size(), properties.feature_edges.inward.size());
}

// A foot is at an internal edge if an adjoining body is there, also below the step, and within the precision
// with which the foot is known.
TEST_F(InternalEdges, AreFoundWhereBodiesAdjoin) {
  EXPECT_TRUE(is_at_internal_edge(bodies(), 0, Vec3(0, 0, 0.3), 0));
  EXPECT_TRUE(is_at_internal_edge(bodies(), 1, Vec3(0, 0, 0.3), 0));
  EXPECT_TRUE(is_at_internal_edge(bodies(), 1, Vec3(1.5, 0, 0.3), 0));  // under the step
  EXPECT_FALSE(is_at_internal_edge(bodies(), 0, Vec3(-0.1, 0, 0.3), 0));
  // The internal edge is within the precision of the foot.
  EXPECT_TRUE(is_at_internal_edge(bodies(), 0, Vec3(-0.1, 0, 0.3), 0.11));
  EXPECT_FALSE(is_at_internal_edge(bodies(), 3, Vec3(0, 3.5, 0), 0));
}

// Sides that adjoining bodies hide are distinguished from exposed surfaces. A hidden side that acts is a
// ghost collision; an exposed one that does not is a hole.
TEST_F(InternalEdges, HideTheirSidesFromEachOther) {
  const Vec3 left(-1, 0, 0), up(0, 1, 0);
  // A point on the left plank sees the side of the right plank, 1/64 m deep and at the rim. Deep down the two
  // surfaces face each other (zero normal); at the rim the top of the left plank goes on.
  EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, -1.0 / 64, 0), left)->others_normal, Vec3(0, 0, 0));
  EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, 0, 0), left)->others_normal, up);
  // These places are not hidden: the tops, the riser of the step (also where it stands on the floor), and
  // sides that face outward.
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0, 0, 0), up));
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0.5, 0, 0), up));
  EXPECT_FALSE(hidden_foot(bodies(), 2, Vec3(1, 0, 0), left));
  EXPECT_FALSE(hidden_foot(bodies(), 2, Vec3(1, 0.5, 0), left));
  EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(0.5, -0.5, 2), Vec3(0, 0, 1)));
  EXPECT_FALSE(hidden_foot(bodies(), 3, Vec3(0, 3.5, 0), -up));
}

// A foot beside the internal edge, so near that it counts as being on both planks, is on one common top. From
// 1e-4 m (the tolerance `adjoin_within` times a smallest size of 1 m) the sides below count as facing each
// other. A top that hides itself would drop bodies through the floor.
TEST_F(InternalEdges, DoNotHideTheTopBesideThem) {
  const Vec3 up(0, 1, 0);
  for (const double beside : {1e-16, 1e-12, 1e-9, 1e-6, 1.6e-5, 5e-5, 9.9e-5, 1.1e-4}) {
    EXPECT_FALSE(hidden_foot(bodies(), 1, Vec3(beside, 0, 0.3), up)) << beside;
    EXPECT_FALSE(hidden_foot(bodies(), 0, Vec3(-beside, 0, 0.3), up)) << beside;
    EXPECT_EQ(hidden_foot(bodies(), 1, Vec3(0, -beside, 0.3), Vec3(-1, 0, 0))->others_normal,
              beside < 1e-4 ? up : Vec3(0, 0, 0))
        << beside;
  }
}

// A sample 1/64 m deep and 1/1024 m behind the internal edge is nearest to the hidden side, but leaves the
// union through the top.
TEST_F(InternalEdges, ALowPointLeavesThroughTheTop) {
  const Vec3 x(1.0 / 1024, -1.0 / 64, 0), inward = Vec3(0.25, 1, 0).normalized();
  const Exit side{Vec3(-1, 0, 0), 1.0 / 1024};
  const auto hidden = hidden_foot(bodies(), 1, Vec3(0, x.y(), 0), side.normal);
  ASSERT_TRUE(hidden);
  const Exit way = exit_from_union(bodies(), 1, x, inward, side, *hidden);
  EXPECT_EQ(way.normal, Vec3(0, 1, 0));
  EXPECT_NEAR(way.depth, 1.0 / 64, 1e-15);
}

// A point is below the planks and in the ground. The tops of the planks are too far away to leave by (more
// than half the smallest size), so the exit stays that of the ground.
TEST_F(InternalEdges, KeepTheExitOfTheGroundFarBelow) {
  const Vec3 x(-1, -1 - 1.0 / 64, 0), up(0, 1, 0);
  const Exit ground{up, 1.0 / 64};
  const auto hidden = hidden_foot(bodies(), 5, Vec3(-1, -1, 0), up);
  ASSERT_TRUE(hidden);
  const Exit way = exit_from_union(bodies(), 5, x, up, ground, *hidden);
  EXPECT_EQ(way.normal, up);
  EXPECT_EQ(way.depth, 1.0 / 64);
}

// The exit from a hidden rim, for a point outside, is the plane of the surface that both tops share.
TEST_F(InternalEdges, APointAboveTheOneMeetsThePlaneOfBoth) {
  const Vec3 x(-0.25, 1.0 / 1024, 0);
  const HiddenFoot rim{Vec3(0, 0, 0), Vec3(0, 1, 0)};
  const Vec3 normal = x.normalized();
  const Exit way = exit_from_union(bodies(), 1, x, Vec3(0, 1, 0), {normal, -x.norm()}, rim);
  EXPECT_EQ(way.normal, Vec3(0, 1, 0));
  EXPECT_EQ(way.depth, -1.0 / 1024);
}

// A point of a flat body is level with both tops and over the left one: it faces the right plank, onto which
// it may slide. A point beside both planks does not.
TEST_F(InternalEdges, APointLevelWithBothFacesTheOtherPlank) {
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

// Over a narrow gap between two planks the exit is through the plane of both tops, wherever over the gap and
// however deep the point is. The direction from the nearer rim would lean by up to 16 degrees here, and threw
// up the boxes that slid over it.
TEST(InternalEdgesWithGaps, HaveOnePlaneForBothTops) {
  for (const double gap : {1e-6, 1e-5, 5e-5, 9e-5}) {
    scene::Scene scene = test::free_space();
    for (const double side : {-1.0, 1.0}) {
      scene::RigidBody& plank = test::add_box(scene, side < 0 ? "left" : "right",
                                              Vec3(side * (2 + gap / 2), -0.5, 0), Vec3(4, 1, 4), 1);
      plank.mass.reset();
      plank.is_static = true;
    }
    const Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const int left = bodies.rigid.state[0].pose.position.x() < 0 ? 0 : 1;
    for (const double place : {-0.5, -0.3, -1e-3, 0.0, 1e-3, 0.3, 0.5})
      for (const double depth : {0.0, 1e-9, 1e-6, 1e-3}) {
        const Vec3 x(place * gap, -depth, 0.3), up(0, 1, 0);
        const Exit side{Vec3(1, 0, 0), -(0.5 + place) * gap};  // from the left plank alone
        const auto hidden = hidden_foot(bodies, left, Vec3(-gap / 2, -depth, 0.3), side.normal);
        ASSERT_TRUE(hidden) << gap;
        const Exit way = exit_from_union(bodies, left, x, up, side, *hidden);
        EXPECT_LT((way.normal - up).norm(), 1e-9) << gap << " " << place << " " << depth;
        EXPECT_NEAR(way.depth, depth, 1e-9 * gap + 1e-15) << gap << " " << place;
      }
  }
}

}  // namespace
}  // namespace duet::internal_edges_test
