// Impulses on groups of bodies that joints connect.
#include "sim/contact/response/articulated_response.h"

#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::articulated_response_test {
namespace {

// A row of three dynamic boxes and a static one, joined to each other, and a box on the first one without a
// joint.
class Links : public ::testing::Test {
 protected:
  explicit Links(bool controls = false) : scene_(test::free_space()), simulation_(build(controls)) {}
  Simulation build(bool controls) {
    for (int i = 0; i < 4; ++i) {
      scene::RigidBody& box =
          test::add_box(scene_, "box" + std::to_string(i), Vec3(i, 0, 0), Vec3(0.9, 0.4, 0.5), 1 + 10 * i);
      if (i == 3) box.mass.reset();
      box.is_static = i == 3;
    }
    test::add_box(scene_, "load", Vec3(0, 0.4, 0), Vec3(0.4, 0.4, 0.4), 1000);
    for (int i = 0; i < 3; ++i) {
      scene::Joint joint;
      joint.name = "joint" + std::to_string(i);
      joint.type = i == 1 ? scene::JointType::hinge : scene::JointType::point;
      joint.parent = "box" + std::to_string(i);
      joint.child = "box" + std::to_string(i + 1);
      joint.world.position = Vec3(i + 0.5, 0.1, 0.05);
      joint.has_control = controls && i == 0;
      joint.control.gain = 100;
      scene_.joints.push_back(joint);
    }
    return Simulation(scene_, test::plan(scene_));
  }
  World& world() { return simulation_.world(); }
  // Prepares the response of the contacts where the load touches. Returns false if there are none.
  bool begin(ArticulatedResponse& linked) {
    simulation_.advance_frame();
    Bodies& bodies = world().bodies;
    StepContext& context = world().context;
    context.joints.solver.update(bodies.articulation, bodies.rigid);
    if (!linked.prepare(bodies, context.joints.solver, ControlledJoints::are_free, context.contact.contacts))
      return false;
    linked.begin(bodies.rigid);
    return true;
  }

  scene::Scene scene_;
  Simulation simulation_;
};

// Dynamic bodies that joints connect form one group; the static body, and the load without a joint, belong to
// none.
TEST_F(Links, AreTheDynamicBodiesThatJointsConnect) {
  const Bodies& bodies = world().bodies;
  EXPECT_EQ(bodies.linked, (std::vector<int>{0, 0, 0, -1, -1}));
  // A group of three bodies is larger than the limit of two.
  EXPECT_EQ(linked_bodies(bodies, 2), (std::vector<int>{-1, -1, -1, -1, -1}));
}

// The velocities that the response predicts for two impulses on the group are those that a joint solve makes
// of the same impulses.
TEST_F(Links, AnswerAsTheirJointsLetThem) {
  simulation_.advance_frame();  // the load touches from then on
  Bodies& bodies = world().bodies;
  StepContext& context = world().context;
  context.joints.solver.update(bodies.articulation, bodies.rigid);
  context.joints.solver.stabilize(bodies.rigid);
  ArticulatedResponse linked;
  ASSERT_TRUE(
      linked.prepare(bodies, context.joints.solver, ControlledJoints::are_free, context.contact.contacts));
  EXPECT_TRUE(linked.is_complete());
  linked.begin(bodies.rigid);
  const Vec3 before = bodies.rigid.state[2].velocity;
  linked.push(bodies.rigid, 0, wrench_of(Vec3(0.1, 0.2, -0.1), Vec3(3, -2, 5)));
  linked.push(bodies.rigid, 1, wrench_of(Vec3(-0.2, 0.2, 0), Vec3(1, 40, -7)));
  EXPECT_GT((bodies.rigid.state[2].velocity - before).norm(), 0.01);
  linked.finish(bodies.rigid);
  EXPECT_GT(context.joints.solver.stabilize(bodies.rigid), 0.1);
  test::expect_below(linked.difference(bodies.rigid), 1e-12, "difference, m/s");
}

class ControlledLinks : public Links {
 protected:
  ControlledLinks() : Links(true) {}
};

// With a controlled joint, which keeps its rate under impulses, the prediction agrees as well; a response
// without the control differs by more than 0.01 m/s.
TEST_F(ControlledLinks, AnswerAsTheirControlLetsThem) {
  simulation_.advance_frame();
  Bodies& bodies = world().bodies;
  StepContext& context = world().context;
  context.joints.solver.update(bodies.articulation, bodies.rigid);
  const auto settle = [&] {
    context.joints.solver.begin_impulses(bodies.articulation, 0.01);
    return context.joints.solver.stabilize_and_control(bodies.articulation, bodies.rigid);
  };
  settle();
  ArticulatedResponse linked;
  ASSERT_TRUE(
      linked.prepare(bodies, context.joints.solver, ControlledJoints::are_held, context.contact.contacts));
  linked.begin(bodies.rigid);
  linked.push(bodies.rigid, 0, wrench_of(Vec3(0.1, 0.2, -0.1), Vec3(3, -2, 5)));
  linked.finish(bodies.rigid);
  EXPECT_GT(settle(), 0.1);
  test::expect_below(linked.difference(bodies.rigid), 1e-12, "difference, m/s");
  linked.outdate();
  ASSERT_TRUE(
      linked.prepare(bodies, context.joints.solver, ControlledJoints::are_free, context.contact.contacts));
  linked.begin(bodies.rigid);
  linked.push(bodies.rigid, 0, wrench_of(Vec3(0.1, 0.2, -0.1), Vec3(3, -2, 5)));
  linked.finish(bodies.rigid);
  settle();
  test::expect_above(linked.difference(bodies.rigid), 0.01, "difference without control, m/s");
}

// An impulse at each contact of the group changes the relative velocity by the matrix K of the contact times
// the impulse.
TEST_F(Links, MakeTheResponseOfTheirContacts) {
  Bodies& bodies = world().bodies;
  ArticulatedResponse linked;
  ASSERT_TRUE(begin(linked));
  double off = 0;
  for (const ContactPoint& contact : world().context.contact.contacts.points) {
    ASSERT_TRUE(linked.takes_part(contact));
    const Vec3 before = relative_velocity(bodies, contact), impulse(0.3, 2, -0.7);
    linked.apply_impulse(bodies, contact, impulse);
    const Vec3 change = relative_velocity(bodies, contact) - before;
    off = std::max(off, (change - contact.response.K * impulse).norm() / change.norm());
  }
  test::expect_below(off, 1e-8, "response, relative");  // K is softened by 1e-9 so that it has an inverse
}

// A contact between two members of the group has the matrix K of the joints, too: each member moves the other
// one.
TEST_F(Links, MakeTheResponseOfContactsBetweenThem) {
  Bodies& bodies = world().bodies;
  ArticulatedResponse linked;
  ASSERT_TRUE(begin(linked));
  ContactPoint contact;
  contact.host = 0;
  contact.guest_rigid = 2;
  contact.normal = Vec3(1, 2, -2) / 3;
  contact.host_arm = Vec3(0.3, 0.2, 0.1);
  contact.guest_arm = Vec3(-0.3, 0.1, 0.2);
  contact.response = ContactResponse(Mat3::Identity(), contact.normal);
  const Mat3 K = linked.response(contact, bodies).K;
  const Vec3 before = relative_velocity(bodies, contact), impulse(0.3, 2, -0.7);
  linked.apply_impulse(bodies, contact, impulse);
  const Vec3 change = relative_velocity(bodies, contact) - before;
  // K is softened by 1e-9 here as well.
  test::expect_below((change - K * impulse).norm() / change.norm(), 1e-7, "response, relative");
}

}  // namespace
}  // namespace duet::articulated_response_test
