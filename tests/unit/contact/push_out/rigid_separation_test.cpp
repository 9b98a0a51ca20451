#include "sim/contact/push_out/rigid_separation.h"

#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/contacts.h"
#include <gtest/gtest.h>

#include "sim/contact/detection/max_penetration.h"
#include "sim/contact/push_out/push_out.h"

namespace duet::rigid_separation_test {
namespace {

using test::ContactScene;

constexpr double sweep_tolerance = 1e-8;  // m: the largest displacement in the last sweep at one geometry
constexpr int iterations = 4;

// Separates the rigid bodies of a scene, at most at `geometries` geometries. Returns the number of pairs that
// overlapped.
int separate(ContactScene& scene, int geometries = iterations, const ArticulatedResponse* linked = nullptr) {
  SeparationScratch scratch;
  return separate_rigid_bodies(scene.bodies, linked, scene.graph, geometries, scene.contacts, scratch);
}

// Two free boxes share the displacement in the inverse ratio of their masses and do not turn, because they
// lie flat on each other. Velocities and angular momenta stay to the bit.
TEST(RigidSeparation, MovesFreeBoxesAboutTheirCenterOfMass) {
  const double overlap = 0.01;
  scene::Scene scene = test::free_space();
  test::add_box(scene, "heavy", Vec3(0, 0, 0), Vec3(1, 1, 1), 3).placement.velocity = Vec3(1, 2, 3);
  test::add_box(scene, "light", Vec3(0, 1 - overlap, 0), Vec3(1, 1, 1), 1).placement.angular_velocity =
      Vec3(0.1, 0.2, 0.3);
  ContactScene boxes(scene, 0.01);
  const RigidState before[] = {boxes.state(0), boxes.state(1)};
  EXPECT_EQ(separate(boxes), 1);
  const Vec3 heavy = boxes.state(0).pose.position, light = boxes.state(1).pose.position;
  // The bound is rounding: displacements are sums of some hundred pushes of at most their size.
  EXPECT_LT((3 * heavy + light - Vec3(0, 1 - overlap, 0)).norm(), 1e-15);
  EXPECT_LT((light - heavy - Vec3(0, 1, 0)).norm(), 2 * sweep_tolerance);
  EXPECT_LT((heavy - Vec3(0, -overlap / 4, 0)).norm(), 2 * sweep_tolerance);
  for (const std::size_t i : {0u, 1u}) {
    const RigidState& after = boxes.state(i);
    EXPECT_LT(after.pose.orientation.angularDistance(before[i].pose.orientation), 4 * sweep_tolerance);
    EXPECT_EQ(after.velocity, before[i].velocity);
    EXPECT_EQ(after.angular_momentum, before[i].angular_momentum);
  }
}

// A corner is in a face, off its center, so that the separation turns both boxes. Turning by about 0.01 rad
// changes the overlap to second order, and the next geometry removes that.
TEST(RigidSeparation, KeepsTheCenterOfMassOfTurningBodies) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "heavy", Vec3(0, 0, 0), Vec3(2, 1, 2), 3);
  test::add_box(scene, "light", Vec3(0.6, 1.2, 0.5), Vec3(1, 1, 1), 1).placement.orientation =
      Quat(1, 0.3, 0.2, 0.4).normalized();
  ContactScene boxes(scene, 0.01);
  const Vec3 before = 3 * boxes.state(0).pose.position + boxes.state(1).pose.position;
  ASSERT_GT(max_penetration(boxes.bodies, {}), 0.01);
  EXPECT_EQ(separate(boxes), 1);
  EXPECT_LT(max_penetration(boxes.bodies, {}), overlap_tolerance);
  const Vec3 after = 3 * boxes.state(0).pose.position + boxes.state(1).pose.position;
  EXPECT_LT((after - before).norm(), 1e-14);
  EXPECT_GT(boxes.state(1).pose.orientation.angularDistance(scene.rigid[1].placement.orientation), 1e-4);
}

// A stack in which every box is sunk into the one below is lifted to exact contact: no overlap and no gap is
// left.
TEST(RigidSeparation, AStackOnTheGroundIsLiftedWithoutGaps) {
  const double overlap = 0.002;
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < 3; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 0.5 + i - (i + 1) * overlap, 0), Vec3(1, 1, 1),
                  1 + i);
  ContactScene stack(scene, 0.01);
  EXPECT_EQ(separate(stack), 3);
  EXPECT_LT(max_penetration(stack.bodies, {}), overlap_tolerance);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 place(0, 0.5 + static_cast<double>(i), 0);
    // A box can miss its place by the overlap tolerance of every box below, and from above by as much.
    EXPECT_LT((stack.state(i).pose.position - place).norm(), 4 * overlap_tolerance) << i;
  }
  EXPECT_EQ(stack.state(3).pose.position, Vec3(0, 0, 0));
}

// Bodies that do not overlap, or by less than the tolerance of contact, stay to the bit, also while another
// pair of the scene is separated.
TEST(RigidSeparation, LeavesOthersAlone) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "touching", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 1);
  test::add_box(scene, "above", Vec3(0, 1.5 - overlap_tolerance / 2, 0), Vec3(1, 1, 1), 1);
  test::add_ball(scene, "sunk", Vec3(5, 0.99, 0), 1, 1);
  ContactScene bodies(scene, 0.01);
  EXPECT_EQ(separate(bodies), 1);
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_EQ(bodies.state(i).pose.position, scene.rigid[i].placement.position);
    EXPECT_EQ(bodies.state(i).pose.orientation.coeffs(), Quat::Identity().coeffs());
  }
  EXPECT_NEAR(bodies.state(2).pose.position.y(), 1, 2 * sweep_tolerance);
  EXPECT_EQ(separate(bodies), 0);
}

// A box that is lifted off the ground must not be pushed into the box on top of it. That one is ten times as
// heavy, so each sweep alone would leave 10/11 of the error; with the lower box held it is lifted at once.
TEST(RigidSeparation, PushesThroughToTheBodiesAbove) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "sunk", Vec3(0, 0.49, 0), Vec3(1, 1, 1), 1);
  test::add_box(scene, "above", Vec3(0, 1.49, 0), Vec3(1, 1, 1), 10);
  ContactScene tower(scene, 0.01);
  EXPECT_EQ(separate(tower), 1);
  EXPECT_LT(max_penetration(tower.bodies, {}), overlap_tolerance);
  EXPECT_NEAR(tower.state(1).pose.position.y(), 1.5, 1e-3 * 0.01);
}

// Each box of a tower is sunk into the one below and is a hundred times as heavy. One geometry is enough, and
// no box is lifted by more than it had sunk.
TEST(RigidSeparation, LiftsHeavyBodiesOffLightOnes) {
  scene::Scene scene = test::on_ground();
  const double overlap = 0.01;
  for (int i = 0; i < 4; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 0.5 + i - (i + 1) * overlap, 0), Vec3(1, 1, 1),
                  std::pow(100.0, i));
  ContactScene tower(scene, 0.01);
  EXPECT_EQ(separate(tower, 1), 4);
  EXPECT_LT(max_penetration(tower.bodies, {}), overlap_tolerance);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 place(0, 0.5 + static_cast<double>(i), 0);
    EXPECT_LT((tower.state(i).pose.position - place).norm(), 5 * overlap_tolerance) << i;
  }
}

// A heavy plank is sunk into two light blocks that share its load unevenly. It is lifted and tilts by no more
// than a hundredth of the angle that lifting it off one block alone would give.
TEST(RigidSeparation, LiftsAHeavyPlankOffTwoLightBlocks) {
  scene::Scene scene = test::on_ground();
  for (const double x : {-1.0, 1.5})
    test::add_box(scene, x < 0 ? "left" : "right", Vec3(x, 0.5, 0), Vec3(0.5, 1, 0.5), 1);
  test::add_box(scene, "plank", Vec3(0, 1.24, 0), Vec3(4, 0.5, 1), 100);
  ContactScene bench(scene, 0.01);
  EXPECT_EQ(separate(bench, 2), 2);
  EXPECT_LT(max_penetration(bench.bodies, {}), overlap_tolerance);
  EXPECT_NEAR(bench.state(2).pose.position.y(), 1.25, 1e-2 * 0.01);
  EXPECT_LT(bench.state(2).pose.orientation.angularDistance(Quat::Identity()), 1e-2 * 0.01 / 2.5);
}

// In free flight no body is held, and the center of mass stays. Holding lower bodies, as on the ground, would
// move it.
TEST(RigidSeparation, HoldsNobodyInFreeFlight) {
  scene::Scene scene = test::on_ground();
  const double overlap = 0.01;
  for (int i = 0; i < 3; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 10 + i * (1 - overlap), 0), Vec3(1, 1, 1),
                  std::pow(100.0, i));
  ContactScene tower(scene, 0.01);
  const auto center = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i)
      sum += std::pow(100.0, static_cast<double>(i)) * tower.state(i).pose.position.y();
    return sum / 10101;
  };
  const double before = center();
  EXPECT_EQ(separate(tower), 2);
  EXPECT_NEAR(center(), before, 1e-13);  // rounding of the sum
}

// A pair that does not overlap yet is measured as soon as one of its bodies is moved into the other,
// whichever is listed first. Contact is flat, so one geometry is enough.
TEST(RigidSeparation, SeesAtOnceWhatABodyIsPushedInto) {
  for (const bool upper_first : {false, true}) {
    scene::Scene scene = test::on_ground();
    for (const bool upper : {upper_first, !upper_first})
      test::add_box(scene, upper ? "above" : "sunk", Vec3(0, upper ? 1.49 : 0.49, 0), Vec3(1, 1, 1),
                    upper ? 0.5 : 1);
    ContactScene tower(scene, 0.01);
    EXPECT_EQ(separate(tower, 1), 1);
    EXPECT_LT(max_penetration(tower.bodies, {}), 2 * sweep_tolerance);
  }
}

// A box is 1 mm deep in the second link of a chain. With the articulated response the chain gives way as its
// joints allow, to first order: the joints' errors are of the order of the square of the overlap over the
// length of a link. If the link moves by itself, its joints open by at least a quarter of the overlap.
TEST(RigidSeparation, MovesJointedBodiesAsTheirJointsAllow) {
  const double overlap = 1e-3;
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 3, scene::JointType::point, true);
  test::add_box(scene, "load", Vec3(1.7, 0.15 - overlap, 0), Vec3(0.2, 0.2, 0.2), 500);
  for (const bool knows : {true, false}) {
    ContactScene chain(scene, 0.01);
    JointSolver joints;
    joints.analyze(chain.bodies.articulation, chain.bodies.rigid);
    joints.update(chain.bodies.articulation, chain.bodies.rigid);
    ArticulatedResponse linked;
    ASSERT_TRUE(linked.prepare(chain.bodies, joints, ControlledJoints::are_free, chain.contacts));
    EXPECT_EQ(linked.prepared(), &linked);
    EXPECT_EQ(separate(chain, iterations, knows ? &linked : nullptr), 1);
    EXPECT_LT(max_penetration(chain.bodies, {}), 2 * sweep_tolerance + overlap_tolerance);
    const double off = JointSolver::drift(chain.bodies.articulation, chain.bodies.rigid).gap;
    if (knows)
      EXPECT_LT(off, 4 * overlap * overlap);
    else
      EXPECT_GT(off, overlap / 4);
  }
}

}  // namespace
}  // namespace duet::rigid_separation_test
