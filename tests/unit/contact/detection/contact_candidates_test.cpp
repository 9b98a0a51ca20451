// Contact candidates of whole scenes: which points take part in the patches of flat faces, and how far the
// speculative margin reaches.
#include "sim/contact/detection/contact_candidates.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/contacts.h"
#include "tests/support/meshes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace duet::contact_candidates_test {
namespace {

Vec3 position(const Bodies& bodies, const ContactPoint& contact) {
  return bodies.rigid.state[as_index(contact.host)].pose.position + contact.host_arm;
}

// Numbers of the contact points of a scene that are no samples but lie in the plane of a patch.
struct InPlane {
  int members = 0, strangers = 0;  // those that are points of the patch, and those that are not
};

// Counts the points that lie in the plane of a patch's points, on the same host and with the same normal.
InPlane count_in_planes(const test::ContactScene& scene) {
  InPlane result;
  const std::vector<ContactPoint>& points = scene.contacts.points;
  for (const ContactPair& pair : scene.contacts.pairs)
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& point = points[as_index(i)];
      if (point.is_sample()) continue;
      result.members += point.patch >= 0;
      const auto holds = [&](const ContactPoint& other) {
        return other.patch >= 0 && other.host == point.host && (other.normal - point.normal).norm() < 1e-9 &&
               std::abs(point.normal.dot(position(scene.bodies, point) - position(scene.bodies, other))) <
                   1e-9;
      };
      const auto begin = points.begin() + pair.begin, end = points.begin() + pair.end;
      result.strangers += point.patch < 0 && std::any_of(begin, end, holds);
    }
  return result;
}

// A box and a can stand beside the wall of a step, and a box stands on the edge of another, a little above
// the face, on it or a little in it. Points against several faces of a mesh and places where edges pass the
// end of a face are points of the patch that they lie in, whatever the gap is.
TEST(ContactCandidates, PointsInThePlaneOfAPatchBelongToIt) {
  for (const std::string kind : {"box in a corner", "can in a corner", "box over an edge"}) {
    scene::Scene scene = test::free_space();
    const bool is_corner = kind != "box over an edge";
    scene::RigidBody& step =
        is_corner ? test::add_mesh(scene, "step", std::make_shared<TriangleMesh>(test::l_mesh()), 1, 1)
                  : test::add_box(scene, "step", Vec3(0.3, 0.5, 0.5), Vec3(2, 1, 0.6), 1);
    step.shape.cells = 16;
    step.is_static = true;
    step.mass.reset();
    scene::RigidBody& body = test::add_box(scene, "body", Vec3(1.22, 1.2, 0.5), Vec3(0.4, 0.4, 0.4), 1);
    if (kind == "can in a corner")
      body.shape = {.kind = scene::ShapeKind::cylinder, .radius = 0.2, .length = 0.4};
    test::ContactScene found(scene, 0.01);
    for (const double gap : {-1e-4, 0.0, 1e-4}) {
      found.state(1).pose.position = Vec3(is_corner ? 1.2 + gap : 1.22, 1.2 + gap, 0.5);
      found.find(0.01);
      const InPlane count = count_in_planes(found);
      EXPECT_EQ(count.strangers, 0) << kind << ", gap " << gap;
      EXPECT_GT(count.members, 0) << kind << ", gap " << gap;
    }
  }
}

// Returns the numbers of the guest's points that can touch within a step of `dt` (s), if forces changed the
// velocities by `change`.
std::vector<FeatureId> names(const Bodies& bodies, double dt, const VelocityState& change) {
  ContactSet contacts;
  find_candidates(bodies, {}, dt, change, contacts);
  std::vector<FeatureId> result;
  for (const ContactPoint& contact : contacts.points) result.push_back(contact.feature);
  return result;
}

// The end of a beam whose prescribed motion starts to turn it within the step reaches a body that is 1 cm
// away, be it rigid or soft.
TEST(ContactCandidates, CountTheSpinThatAMotionAddsInTheStep) {
  for (const bool is_soft : {false, true}) {
    scene::Scene scene = test::free_space();
    scene::RigidBody& beam = test::add_box(scene, "beam", Vec3::Zero(), Vec3(2, 0.1, 0.1), 1);
    beam.is_kinematic = true;
    beam.mass.reset();
    const Vec3 place(0.8, 0.16, 0), size(0.2, 0.2, 0.2);
    if (is_soft)
      test::add_soft_box(scene, "guest", place, size, 2);
    else
      test::add_box(scene, "guest", place, size, 1);
    const Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    VelocityState change = test::no_change(bodies);
    EXPECT_TRUE(names(bodies, 0.01, change).empty()) << is_soft;
    change.rotation[0] = Vec3(0, 0, 2);  // rad/s
    EXPECT_FALSE(names(bodies, 0.01, change).empty()) << is_soft;
  }
}

// Bodies fall side by side, a few thousandths of their size apart. Contact with a third one may stop one of
// them in the step, so that the other meets it.
TEST(ContactCandidates, IncludeBodiesThatFallTogether) {
  for (const bool is_soft : {false, true}) {
    scene::Scene scene = test::free_space();
    test::add_box(scene, "lower", Vec3::Zero(), Vec3(0.1, 0.1, 0.1), 1);
    if (is_soft)
      test::add_soft_box(scene, "upper", Vec3(0, 0.102, 0), Vec3(0.1, 0.1, 0.1), 2);
    else
      test::add_box(scene, "upper", Vec3(0, 0.102, 0), Vec3(0.1, 0.1, 0.1), 1);
    const Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const double dt = 1.0 / 48;
    VelocityState change = test::no_change(bodies);
    EXPECT_TRUE(names(bodies, dt, change).empty()) << is_soft;
    for (Vec3& v : change.rigid) v.y() -= 9.8 * dt / 2;
    for (Vec3& v : change.particle) v.y() -= 9.8 * dt / 2;
    EXPECT_FALSE(names(bodies, dt, change).empty()) << is_soft;
  }
}

}  // namespace
}  // namespace duet::contact_candidates_test
