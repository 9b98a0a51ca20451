#include "sim/contact/detection/ring_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::ring_contacts_test {
namespace {

using test::random_rotation;
using test::random_vector;

constexpr double pi = 3.141592653589793;

// Returns the ring contacts of a torus at `pose` that are less than `margin` (m) from `host`.
std::vector<EdgeContact> contacts_of(const LevelSet& torus, const Pose& pose, const LevelSet& host,
                                     double margin) {
  std::vector<EdgeContact> found;
  find_ring_contacts(find_feature_edges(torus, torus.radius / 4), pose, host, margin, found);
  return found;
}

// Returns the least distance (m) of a torus at `pose` from `host`, from 20,000 places of its center line.
double dense_least(const LevelSet& torus, const Pose& pose, const LevelSet& host) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20000; ++i) {
    const double angle = 2 * pi * i / 20000;
    const Vec3 x(torus.radius * std::sin(angle), 0, torus.radius * std::cos(angle));
    least = std::min(least, host.distance(pose.to_world(x)) - torus.tube);
  }
  return least;
}

// Random rings that touch a ball, a capsule or a ring. The slack of an arc is 1e-4 of the tube, and a place
// is no farther than twice that from the nearest one. The dense look is exact to 1e-7 m.
TEST(RingContacts, LieAtTheNearestPlace) {
  std::mt19937 random(1);
  const LevelSet torus = LevelSet::torus(0.5, 0.1);
  const LevelSet hosts[] = {LevelSet::sphere(0.4), LevelSet::capsule(0.1, 0.5), LevelSet::torus(0.6, 0.15)};
  double farthest = 0;
  for (int i = 0; i < 600; ++i) {
    const LevelSet& host = hosts[i % 3];
    const Pose pose{0.8 * random_vector(random), random_rotation(random)};
    const double least = dense_least(torus, pose, host);
    if (least < -0.02) continue;  // so deep that the center lines may cross
    const std::vector<EdgeContact> found = contacts_of(torus, pose, host, least + 0.01);
    ASSERT_FALSE(found.empty());
    double nearest = found.front().distance;
    for (const EdgeContact& contact : found) nearest = std::min(nearest, contact.distance);
    farthest = std::max(farthest, std::abs(nearest - least));
  }
  EXPECT_LT(farthest, 2e-4 * torus.tube + 1e-6);
}

// The touch of a contact at the pose at which it was found is the one that the search found.
TEST(RingContacts, KeepTheirPlaceAtTheSamePose) {
  std::mt19937 random(2);
  const LevelSet torus = LevelSet::torus(0.5, 0.1), host = LevelSet::torus(0.6, 0.15);
  int told = 0;
  for (int i = 0; i < 100; ++i) {
    const Pose pose{0.6 * random_vector(random), random_rotation(random)};
    for (const EdgeContact& contact : contacts_of(torus, pose, host, 0.05)) {
      const RingPlace place = place_on_arc(arc_of(contact.edge), pose, host);
      EXPECT_EQ(place.distance - torus.tube, contact.distance);
      EXPECT_EQ(place.normal, contact.edge.normal);
      ++told;
    }
  }
  EXPECT_GT(told, 100);
}

// Coaxial rings of equal and of other radii, and a ball in the middle of a ring, touch all around.
TEST(RingContacts, AreAllAroundOnCoaxialBodies) {
  const LevelSet torus = LevelSet::torus(0.15, 0.04);
  for (const LevelSet& host : {torus, LevelSet::torus(0.18, 0.04), LevelSet::sphere(0.2)}) {
    const std::vector<EdgeContact> found = contacts_of(torus, {Vec3(0, 0.08, 0), Quat::Identity()}, host, 10);
    ASSERT_EQ(found.size(), 9U);
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_NEAR(found[k].distance, found[0].distance, 1e-15);
      EXPECT_EQ(found[k].feature, FeatureId::edge(9 * static_cast<int>(k)));
    }
  }
}

// Where rings cross at a small angle, the lowest contacts are the middles of their arcs, and stay there when
// the upper ring tilts by 2e-5 rad. The nearest place then moves by a hundredth of the radius.
TEST(RingContacts, StayWhereRingsCrossAtASmallAngle) {
  const LevelSet torus = LevelSet::torus(0.15, 0.04);
  const Pose pose{Vec3(0.005, 0.08, 0), Quat::Identity()};
  const Pose turned{pose.position, Quat(Eigen::AngleAxisd(2e-5, Vec3::UnitZ()))};
  int near = 0;
  for (const EdgeContact& contact : contacts_of(torus, pose, torus, 5e-7))
    for (const Pose& at : {pose, turned}) {
      const RingPlace place = place_on_arc(arc_of(contact.edge), at, torus);
      EXPECT_LT((place.center - at.to_world(contact.edge.place)).norm(), 1e-12);
      ++near;
    }
  EXPECT_GE(near, 4);
}

// A ball touches all around if it is near the axis of the ring, also above and below it.
TEST(RingContacts, OfBallsAreThoseNearTheAxis) {
  const LevelSet torus = LevelSet::torus(0.15, 0.04), ball = LevelSet::sphere(0.2);
  for (const double height : {-0.19, 0.0, 0.19}) {
    EXPECT_TRUE(is_left_to_ring(ball, {Vec3(0.001, height, 0), Quat::Identity()}, torus));
    EXPECT_FALSE(is_left_to_ring(ball, {Vec3(0, height, 0.01), Quat::Identity()}, torus));
  }
}

// The contacts of a ball as guest have the planes of those of the ring, with the normal turned round.
TEST(RingContacts, OfBallsHaveTheRingAsHost) {
  const LevelSet torus = LevelSet::torus(0.15, 0.04), ball = LevelSet::sphere(0.2);
  const FeatureEdges feature_edges = find_feature_edges(torus, 0.04);
  const Pose pose{Vec3(0.001, 0.19, 0.0005), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))};
  std::vector<EdgeContact> found;
  find_ring_contacts_of_ball(feature_edges, pose, ball, 1, found);
  ASSERT_GE(found.size(), 9U);
  for (const EdgeContact& contact : found) {
    const Vec3 point = pose.position - ball.radius * contact.edge.normal;  // of the ball
    EXPECT_NEAR(torus.distance(point), contact.distance, 1e-5);
    EXPECT_NEAR(torus.distance(contact.edge.foot), 0, 1e-5);
    EXPECT_NEAR(contact.edge.normal.dot(point - contact.edge.foot), contact.distance, 1e-12);
    EXPECT_GT(contact.edge.normal.y(), 0.5);
  }
}

// The smaller of two tori is the guest, and of equal ones that of the direction which is looked at first. Of
// a torus and a capsule it is the torus, and of a torus and a ball the ball.
TEST(RingContacts, HaveOneGuest) {
  const LevelSet small = LevelSet::torus(0.1, 0.04), large = LevelSet::torus(0.2, 0.04),
                 ball = LevelSet::sphere(1), rod = LevelSet::capsule(1, 1);
  for (const PairDirection direction : {PairDirection::as_found, PairDirection::reversed}) {
    EXPECT_TRUE(is_guest_of_ring(small, large, direction));
    EXPECT_FALSE(is_guest_of_ring(large, small, direction));
    EXPECT_EQ(is_guest_of_ring(small, small, direction), direction == PairDirection::as_found);
    EXPECT_TRUE(can_touch_with_feature_edges(small, rod, direction));
    EXPECT_FALSE(can_touch_with_feature_edges(rod, small, direction));
    EXPECT_TRUE(can_touch_with_feature_edges(ball, small, direction));
    EXPECT_FALSE(can_touch_with_feature_edges(small, ball, direction));
  }
  EXPECT_FALSE(touch_along_ring(small, LevelSet::box(Vec3(1, 1, 1))));
  EXPECT_FALSE(touch_along_ring(LevelSet::sphere(1), LevelSet::capsule(1, 1)));
}

}  // namespace
}  // namespace duet::ring_contacts_test
