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

constexpr double sweep_tolerance = 1e-8;  // m, where the sweeps at one geometry end
constexpr int iterations = 4;

int separate(ContactScene& scene, int geometries = iterations, const ArticulatedResponse* linked = nullptr) {
  SeparationScratch scratch;
  return separate_rigid_bodies(scene.bodies, linked, scene.graph, geometries, scene.contacts, scratch);
}

// The overlap is parted in the inverse ratio of the masses, and the boxes stay as they are turned.
TEST(Separation, PartsFreeBoxesByTheirOverlapAboutTheirCentreOfMass) {
  const double overlap = 0.01;
  scene::Scene scene = test::free_space();
  test::add_box(scene, "heavy", Vec3(0, 0, 0), Vec3(1, 1, 1), 3).placement.velocity = Vec3(1, 2, 3);
  test::add_box(scene, "light", Vec3(0, 1 - overlap, 0), Vec3(1, 1, 1), 1).placement.angular_velocity =
      Vec3(0.1, 0.2, 0.3);
  ContactScene boxes(scene, 0.01);
  const RigidState before[] = {boxes.state(0), boxes.state(1)};
  EXPECT_EQ(separate(boxes), 1);
  const Vec3 heavy = boxes.state(0).pose.position, light = boxes.state(1).pose.position;
  // Rounding: the shifts are sums of some hundred pushes of at most their size.
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

// Corner in face, off centre: it turns them too. What the turn adds, 0.01 squared, is left to the next
// geometry.
TEST(Separation, KeepsTheCentreOfMassOfBodiesThatTurn) {
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

TEST(Separation, AStackOnTheGroundIsLiftedWithoutGaps) {
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
    // From above the place can be missed by the tolerance of every box below, and from there by as much.
    EXPECT_LT((stack.state(i).pose.position - place).norm(), 4 * overlap_tolerance) << i;
  }
  EXPECT_EQ(stack.state(3).pose.position, Vec3(0, 0, 0));
}

// What does not overlap, or by less than contact minds, stays to the bit; so does a pair next to one that is
// parted.
TEST(Separation, LeavesOthersAlone) {
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

// Lifted off the ground, a box must not be pushed into the one that stands on it. Sweeps alone leave 10/11 of
// the error each where the upper body is ten times as heavy; held from below it is lifted at once.
TEST(Separation, PushesThroughToTheBodiesAbove) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "sunk", Vec3(0, 0.49, 0), Vec3(1, 1, 1), 1);
  test::add_box(scene, "above", Vec3(0, 1.49, 0), Vec3(1, 1, 1), 10);
  ContactScene tower(scene, 0.01);
  EXPECT_EQ(separate(tower), 1);
  EXPECT_LT(max_penetration(tower.bodies, {}), overlap_tolerance);
  EXPECT_NEAR(tower.state(1).pose.position.y(), 1.5, 1e-3 * 0.01);
}

// A tower whose every box is sunk into the one below and weighs a hundred times as much: one geometry is
// enough, and no box is lifted more than it had sunk.
TEST(Separation, LiftsHeavyBodiesOffLightOnes) {
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

// The same between two light ones that share the load, off the middle: it tilts by no more than a hundredth
// of what it would if it were lifted off one of them alone.
TEST(Separation, LiftsAHeavyPlankOffTwoLightBlocks) {
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

// In free flight there is nothing to hold: the centre of mass stays.
TEST(Separation, HoldsNobodyInFreeFlight) {
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

// Pairs that do not overlap yet are looked at as soon as one of their bodies moves, whichever of the two is
// named first: flat contact needs one geometry only.
TEST(Separation, SeesAtOnceWhatABodyIsPushedInto) {
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

// A box a millimetre in the second link of a chain. The chain gives way as its joints let it, to first order:
// what they are off by then is of the order of the overlap's square over a link's length. By itself the link
// leaves them behind by a good part of the overlap.
TEST(Separation, MovesLinkedBodiesAsTheirJointsLetThem) {
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
    ASSERT_TRUE(linked.prepare(chain.bodies, joints, false, chain.contacts));
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
