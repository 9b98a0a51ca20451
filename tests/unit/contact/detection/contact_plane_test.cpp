// All coordinates are sums of few powers of two unless a comment says otherwise, so that the answers are
// exact.
#include "sim/contact/detection/contact_plane.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "sim/contact/detection/contact_point.h"

namespace duet::contact_plane_test {
namespace {

const LevelSet plate = LevelSet::box(Vec3(2, 1, 2));  // its faces are at x, z = +-1 and y = +-0.5

// A corner above or below a plate has the normal of that face and its distance from it, although its inner
// point is not straight above.
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

// The point stands on the top, 1/64 m deep, and 1/1024 m from the side, which is the nearest surface. The
// plane is that of the top: the nearest surface would push the body off sideways.
TEST(ContactPlane, ACornerJustInsideARimIsNotPushedOffSideways) {
  const Vec3 corner(1 - 1.0 / 1024, 0.5 - 1.0 / 64, 0);
  ASSERT_EQ(plate.normal(corner), Vec3(1, 0, 0));
  const ContactPlane plane = contact_plane(plate, corner, corner + Vec3(-0.25, 0.25, 0));
  EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
  EXPECT_EQ(plane.gap, -1.0 / 64);
  EXPECT_TRUE(plane.faces);
}

// A point that is more than half through a thin card is nearest to the far face. It leaves by the face
// through which it came in, on whose side its body is.
TEST(ContactPlane, APointHalfThroughLeavesByTheFaceItEntered) {
  const LevelSet card = LevelSet::box(Vec3(2, 0.125, 2));
  const Vec3 point(0.25, -0.03125, 0.25);
  ASSERT_EQ(card.normal(point), Vec3(0, -1, 0));
  const ContactPlane plane = contact_plane(card, point, point + Vec3(0.0625, 0.25, 0));
  EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
  EXPECT_EQ(plane.gap, -0.09375);
  EXPECT_TRUE(plane.faces);
}

// A body reaches over the edge of the plate: its inner point lies above the top, and its surface point hangs
// down beside the plate. The point faces nothing, so that no contact holds the body back there.
TEST(ContactPlane, APointBesideAnEdgeFacesNothing) {
  const Vec3 point(1.25, 0.25, 0), inside(0.75, 1, 0);
  const ContactPlane plane = contact_plane(plate, point, inside);
  EXPECT_EQ(plane.normal, Vec3(1, 0, 0));
  EXPECT_EQ(plane.gap, 0.25);
  EXPECT_FALSE(plane.faces);

  // A sample in that place has an infinite gap.
  RigidProperties host, guest;
  host.shape = plate;
  guest.samples = {point};
  guest.inside = {inside};
  EXPECT_EQ(touch(host, Pose(), guest, Pose(), FeatureId::point(0)).gap,
            std::numeric_limits<double>::infinity());
  guest.samples = {Vec3(0.75, 0.625, 0)};
  EXPECT_EQ(touch(host, Pose(), guest, Pose(), FeatureId::point(0)).gap, 0.125);
  // A sample that overlaps has a finite gap nevertheless, because it must leave somewhere.
  guest.samples = {Vec3(1 - 1.0 / 64, -0.25, 0)};
  guest.inside = {Vec3(0.75, -0.25, 0)};
  const Touch overlap = touch(host, Pose(), guest, Pose(), FeatureId::point(0));
  EXPECT_EQ(overlap.gap, -1.0 / 64);
  EXPECT_EQ(overlap.normal, Vec3(1, 0, 0));
}

// The point is beside the plate, and its body lies up and away from it. From the inner point the nearest
// place is the edge, whose normal is that of no face. The plane is then that of the side, which the point is
// opposite to.
TEST(ContactPlane, BesideAnEdgeItIsThatOfTheNearestFace) {
  const ContactPlane plane = contact_plane(plate, Vec3(1.25, 0.25, 0), Vec3(1.75, 0.75, 0));
  EXPECT_EQ(plane.normal, Vec3(1, 0, 0));
  EXPECT_EQ(plane.gap, 0.25);
  EXPECT_TRUE(plane.faces);
}

// Lengths along (0.6, 0.8, 0) are not exact: the bounds are a few roundings of numbers of size 2.
TEST(ContactPlane, OfABallIsTheTangentPlaneBelowThePoint) {
  const LevelSet ball = LevelSet::sphere(1);
  const Vec3 up(0.6, 0.8, 0);
  const ContactPlane plane = contact_plane(ball, 1.5 * up, 2 * up);
  EXPECT_LT((plane.normal - up).norm(), 1e-15);
  EXPECT_NEAR(plane.gap, 0.5, 1e-15);
  EXPECT_TRUE(plane.faces);
  // A point that is not below the inner point faces the ball as well.
  const ContactPlane aslant = contact_plane(ball, Vec3(0, 1.25, 0), Vec3(0.5, 1.75, 0));
  EXPECT_EQ(aslant.normal, Vec3(0, 1, 0));
  EXPECT_EQ(aslant.gap, 0.25);
  EXPECT_TRUE(aslant.faces);
  // The body lies beside the point, along the tangent: it does not face the ball.
  const ContactPlane along = contact_plane(ball, Vec3(0, 1.25, 0), Vec3(1, 1.25, 0));
  EXPECT_EQ(along.normal, Vec3(0, 1, 0));
  EXPECT_EQ(along.gap, 0.25);
  EXPECT_FALSE(along.faces);
}

// Both points are inside of the ball. Beyond its center the nearest surface would be on the far side; the
// inner point decides in which direction the body leaves.
TEST(ContactPlane, InsideABallTheInnerPointTellsTheExit) {
  const LevelSet ball = LevelSet::sphere(1);
  for (const double height : {0.25, -0.25}) {
    const ContactPlane plane = contact_plane(ball, Vec3(0, height, 0), Vec3(0, 0.5, 0));
    EXPECT_EQ(plane.normal, Vec3(0, 1, 0));
    EXPECT_EQ(plane.gap, height - 1);
    EXPECT_TRUE(plane.faces);
  }
}

// A ball that has sunk into the ground by more than its radius still touches with its support point.
TEST(ContactPlane, OfABallDeepInTheGround) {
  RigidProperties ground, ball;
  ground.shape = LevelSet::half_space();
  ball.shape = LevelSet::sphere(0.5);
  const Touch lowest =
      touch(ground, Pose(), ball, Pose{Vec3(2, -0.75, 1), Quat::Identity()}, FeatureId::support(0));
  EXPECT_EQ(lowest.position, Vec3(2, -1.25, 1));
  EXPECT_EQ(lowest.normal, Vec3(0, 1, 0));
  EXPECT_EQ(lowest.gap, -1.25);
}

// A point at the height of the end of a wall that comes from the side passes over it. A point at a lower
// height hits the wall, and so does a point that comes against an edge. Otherwise a box that slides over
// level tiles would hit the walls between them.
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
