// All coordinates are sums of few powers of two unless said otherwise, so that the answers are exact.
#include "sim/contact/detection/contact_plane.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "sim/contact/detection/contact_point.h"

namespace duet::contact_plane_test {
namespace {

const LevelSet plate = LevelSet::box(Vec3(2, 1, 2));  // its faces at x, z = +-1 and y = +-0.5

TEST(ContactPlane, ACornerAboveAFaceHasTheNormalOfTheFace) {
  const ContactPlane plane = contact_plane(plate, Vec3(0.25, 0.625, -0.5), Vec3(0.375, 0.75, -0.375));
  EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
  EXPECT_EQ(plane.gap, 0.125);
  EXPECT_TRUE(plane.faces);
  const ContactPlane below = contact_plane(plate, Vec3(0.25, -0.5625, -0.5), Vec3(0.375, -1, -0.375));
  EXPECT_EQ(below.normal, Vec3(0, -1, 0));
  EXPECT_EQ(below.gap, 0.0625);
  EXPECT_TRUE(below.faces);
}

// The nearest surface is the side, 1/1024 away; the body stands on the top, 1/64 deep.
TEST(ContactPlane, ACornerJustInsideARimIsNotPushedOffSideways) {
  const Vec3 corner(1 - 1.0 / 1024, 0.5 - 1.0 / 64, 0);
  ASSERT_EQ(plate.normal(corner), Vec3(1, 0, 0));
  const ContactPlane plane = contact_plane(plate, corner, corner + Vec3(-0.25, 0.25, 0));
  EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
  EXPECT_EQ(plane.gap, -1.0 / 64);
  EXPECT_TRUE(plane.faces);
}

TEST(ContactPlane, APointThatIsMoreThanHalfThroughLeavesByTheFaceItEntered) {
  const LevelSet card = LevelSet::box(Vec3(2, 0.125, 2));
  const Vec3 point(0.25, -0.03125, 0.25);
  ASSERT_EQ(card.normal(point), Vec3(0, -1, 0));
  const ContactPlane plane = contact_plane(card, point, point + Vec3(0.0625, 0.25, 0));
  EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
  EXPECT_EQ(plane.gap, -0.09375);
  EXPECT_TRUE(plane.faces);
}

// The body reaches over the edge: its inner point lies above the top, the point hangs down beside the plate.
TEST(ContactPlane, APointBesideAnEdgeFacesNothing) {
  const Vec3 point(1.25, 0.25, 0), inside(0.75, 1, 0);
  const ContactPlane plane = contact_plane(plate, point, inside);
  EXPECT_EQ(plane.normal, Vec3(1, 0, 0));
  EXPECT_EQ(plane.gap, 0.25);
  EXPECT_FALSE(plane.faces);

  // As a sample of a body it has no gap.
  RigidProperties host, guest;
  host.shape = plate;
  guest.samples = {point};
  guest.inside = {inside};
  EXPECT_EQ(touch(host, Pose(), guest, Pose(), 0).gap, std::numeric_limits<double>::infinity());
  guest.samples = {Vec3(0.75, 0.625, 0)};
  EXPECT_EQ(touch(host, Pose(), guest, Pose(), 0).gap, 0.125);
  // One that overlaps has one nevertheless: it must get out somewhere.
  guest.samples = {Vec3(1 - 1.0 / 64, -0.25, 0)};
  guest.inside = {Vec3(0.75, -0.25, 0)};
  const Touch overlap = touch(host, Pose(), guest, Pose(), 0);
  EXPECT_EQ(overlap.gap, -1.0 / 64);
  EXPECT_EQ(overlap.normal, Vec3(1, 0, 0));
}

// Beside the plate, with its body up and away: the way inwards leads into the region of the edge, whose
// normal is none of a face; the side is what the point is opposite to.
TEST(ContactPlane, BesideAnEdgeTheNearestFaceCountsForABodyOnItsOuterSide) {
  const ContactPlane plane = contact_plane(plate, Vec3(1.25, 0.25, 0), Vec3(1.75, 0.75, 0));
  EXPECT_EQ(plane.normal, Vec3(1, 0, 0));
  EXPECT_EQ(plane.gap, 0.25);
  EXPECT_TRUE(plane.faces);
}

// Lengths along (0.6, 0.8, 0) are not exact: a few roundings of numbers of size 2.
TEST(ContactPlane, OfABallIsTheTangentPlaneBelowThePoint) {
  const LevelSet ball = LevelSet::sphere(1);
  const Vec3 up(0.6, 0.8, 0);
  const ContactPlane plane = contact_plane(ball, 1.5 * up, 2 * up);
  EXPECT_LT((plane.normal - up).norm(), 1e-15);
  EXPECT_NEAR(plane.gap, 0.5, 1e-15);
  EXPECT_TRUE(plane.faces);
  // Not below the inner point, but faced.
  const ContactPlane aslant = contact_plane(ball, Vec3(0, 1.25, 0), Vec3(0.5, 1.75, 0));
  EXPECT_EQ(aslant.normal, Vec3(0, 1, 0));
  EXPECT_EQ(aslant.gap, 0.25);
  EXPECT_TRUE(aslant.faces);
  // The body lies beside the point, along the tangent.
  const ContactPlane along = contact_plane(ball, Vec3(0, 1.25, 0), Vec3(1, 1.25, 0));
  EXPECT_EQ(along.normal, Vec3(0, 1, 0));
  EXPECT_EQ(along.gap, 0.25);
  EXPECT_FALSE(along.faces);
}

// Both points are inside the ball, and beyond its centre the nearest surface would be on the other side.
TEST(ContactPlane, InsideABallTheInnerPointTellsTheWayOut) {
  const LevelSet ball = LevelSet::sphere(1);
  for (const double height : {0.25, -0.25}) {
    const ContactPlane plane = contact_plane(ball, Vec3(0, height, 0), Vec3(0, 0.5, 0));
    EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
    EXPECT_EQ(plane.gap, height - 1);
    EXPECT_TRUE(plane.faces);
  }
}

// A ball that has sunk in by more than its radius still touches with its lowest point.
TEST(ContactPlane, OfABallDeepInTheGround) {
  RigidProperties ground, ball;
  ground.shape = LevelSet::half_space();
  ball.shape = LevelSet::sphere(0.5);
  const Touch lowest = touch(ground, Pose(), ball, Pose{Vec3(2, -0.75, 1), Quat::Identity()}, -1);
  EXPECT_EQ(lowest.position, Vec3(2, -1.25, 1));
  EXPECT_EQ(lowest.normal, Vec3(0, 1, 0));
  EXPECT_EQ(lowest.gap, -1.25);
}

// What comes from the side at the height of a wall's end goes over it; what is lower hits it, and so does
// what comes against an edge.
TEST(ContactPlane, AtTheEndOfAWallItIsNoObstacle) {
  const LevelSet box = LevelSet::box(Vec3(1, 1, 1));
  const auto faces = [&](const Vec3& x, const Vec3& way) { return contact_plane(box, x, x + way).faces; };
  const Vec3 up(0.05, 0.06, 0.02), down(0.05, -0.06, 0.02);
  for (const double beside : {1e-9, 0.001, 0.02}) {
    EXPECT_FALSE(faces(Vec3(0.5 + beside, 0.5, 0), up)) << beside;
    EXPECT_FALSE(faces(Vec3(0.5 + beside, 0.5 - 1e-6, 0), up)) << beside;
    EXPECT_FALSE(faces(Vec3(0.5 + beside, -0.5, 0), down)) << beside;
    EXPECT_TRUE(faces(Vec3(0.5 + beside, 0.4, 0), down)) << "hangs beside it, " << beside;
    EXPECT_TRUE(faces(Vec3(0.5 + beside, 0.49, 0), up)) << beside;
    EXPECT_TRUE(faces(Vec3(0.5 + beside, 0.5 + beside, 0), up)) << "against the edge, " << beside;
  }
}

}  // namespace
}  // namespace duet::contact_plane_test
