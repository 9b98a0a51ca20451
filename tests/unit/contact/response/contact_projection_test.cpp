// The projection onto contact constraints: its active set, its symmetry, and what it keeps.
#include "sim/contact/response/contact_projection.h"

#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet::contact_projection_test {
namespace {

using test::random_velocity;

// Boxes on each other on the ground fall freely in the prediction, so that they do not approach each other,
// or, with rounding, part. Only the ground is violated at first; each box that it stops makes the contact
// above a violated one.
TEST(ActiveSet, GrowsFromTheGroundThroughAStackThatFallsFreely) {
  constexpr int boxes = 4;
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < boxes; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 0.5 + i, 0), Vec3(1, 1, 1), 10 + i);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 20; ++i) step(world, i * 1e-3, 1e-3);
  Bodies& bodies = world.bodies;
  ContactProjection projection;
  projection.build(bodies, world.context.contact.contacts, world.context.contact.graph, 1000);

  GeneralizedVelocity rest, fall;
  to_generalized(bodies, rest);
  for (std::vector<Vec3>* part : {&rest.linear, &rest.angular})
    for (Vec3& value : *part) value.setZero();
  fall = rest;
  std::vector<std::size_t> stack;  // from the lowest box up
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) stack.push_back(i);
  ASSERT_EQ(stack.size(), static_cast<std::size_t>(boxes));
  for (std::size_t i = 0; i < stack.size(); ++i)  // each a little slower than the one below
    fall.linear[stack[i]] = Vec3(0, -1 + 1e-9 * static_cast<double>(i), 0);

  EXPECT_FALSE(projection.choose(1e-3, 0.5, rest, fall));
  int rounds = 0;
  for (; rounds < boxes; ++rounds) {
    GeneralizedVelocity held = fall;
    projection.satisfy(held);
    for (int i = 0; i < boxes; ++i)
      EXPECT_NEAR(held.linear[stack[static_cast<std::size_t>(i)]].y(), i <= rounds ? 0 : -1, 1e-6)
          << "box " << i << ", round " << rounds;
    if (!projection.activate_violated(1e-3, 0.5, rest, held)) break;
  }
  EXPECT_EQ(rounds, boxes - 1);
  EXPECT_TRUE(projection.choose(1e-3, 0.5, rest, rest));  // at rest nothing separates
}

// Boxes that do separate stay inactive whatever the others do.
TEST(ActiveSet, LeavesOutWhatSeparates) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 10);
  test::add_box(scene, "upper", Vec3(0, 1.5, 0), Vec3(1, 1, 1), 10);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 20; ++i) step(world, i * 1e-3, 1e-3);
  ContactProjection projection;
  projection.build(world.bodies, world.context.contact.contacts, world.context.contact.graph, 100);
  GeneralizedVelocity rest, v;
  to_generalized(world.bodies, rest);
  for (std::vector<Vec3>* part : {&rest.linear, &rest.angular})
    for (Vec3& value : *part) value.setZero();
  v = rest;
  std::vector<std::size_t> stack;
  for (std::size_t i = 0; i < world.bodies.rigid.size(); ++i)
    if (world.bodies.rigid.properties[i].is_dynamic()) stack.push_back(i);
  v.linear[stack[0]] = Vec3(0, -1, 0);
  v.linear[stack[1]] = Vec3(0, 0.5, 0);
  EXPECT_FALSE(projection.choose(1e-3, 0.5, rest, v));
  GeneralizedVelocity held = v;
  projection.satisfy(held);
  EXPECT_FALSE(projection.activate_violated(1e-3, 0.5, rest, held));
  EXPECT_NEAR(held.linear[stack[0]].y(), 0, 1e-9);
  EXPECT_EQ(held.linear[stack[1]].y(), 0.5);
}

// Pairs of two soft bodies that repel each other are rows of the same projection, which stays symmetric.
TEST(RepulsionsInProjection, KeepItSymmetric) {
  scene::Scene scene = test::on_ground(0.4);
  test::add_soft_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "upper", Vec3(0.1, 1.54, 0.05), Vec3(1, 1, 1), 2);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 40; ++i) step(world, i * 1e-3, 1e-3);
  SelfRepulsion& repulsions = world.context.surfaces.repulsion;
  ASSERT_TRUE(std::any_of(repulsions.pairs().begin(), repulsions.pairs().end(),
                          [](const RepulsionPair& pair) { return pair.active; }));
  const auto fastest_row = [&](const GeneralizedVelocity& v) {
    double fastest = 0;
    for (const RepulsionPair& pair : repulsions.pairs())
      if (pair.active)
        fastest = std::max(fastest, std::abs(relative_velocity(pair, v.particle).dot(pair.normal)));
    return fastest;
  };
  ContactProjection projection;
  std::vector<Vec3> force;
  std::vector<Mat3> inertia;
  for (const int sweeps : {1, 1000}) {
    projection.build(world.bodies, world.context.contact.contacts, world.context.contact.graph, sweeps,
                     &repulsions);
    const VelocitySystem P(world.bodies, 1e-3, ImplicitForces::damping, &projection, force, inertia);
    const GeneralizedVelocity u = random_velocity(world.bodies, 7), v = random_velocity(world.bodies, 8);
    GeneralizedVelocity Pu = u, Pv = v;
    P.project(Pu);
    P.project(Pv);
    EXPECT_NEAR(P.inner(u, Pv), P.inner(v, Pu), 1e-12 * P.inner(u, u));
    EXPECT_LT(P.inner(Pu, Pu), 0.999 * P.inner(u, u));
    if (sweeps == 1) continue;
    // Particles that belong to many pairs make rows that almost repeat each other, so what is left decreases
    // slowly with the sweeps.
    EXPECT_LT(fastest_row(Pu), 0.01 * fastest_row(u));
  }
}

// Contacts of rigid with rigid bodies, of rigid with soft ones, and repulsions of soft bodies are rows of one
// projection; each kind is present.
TEST(ProjectionOfAllContacts, IsSymmetricAndPositiveSemidefinite) {
  scene::Scene scene = test::on_ground(0.4);
  test::add_soft_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "upper", Vec3(0.1, 1.54, 0.05), Vec3(1, 1, 1), 2);
  test::add_box(scene, "load", Vec3(0, 2.54, 0), Vec3(1, 1, 1), 500);
  test::add_box(scene, "top", Vec3(0.1, 3.54, 0), Vec3(1, 1, 1), 500);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 60; ++i) step(world, i * 1e-3, 1e-3);
  const ContactSet& contacts = world.context.contact.contacts;
  SelfRepulsion& repulsions = world.context.surfaces.repulsion;
  const auto holds = [&](bool rigid_pair) {
    return std::any_of(contacts.points.begin(), contacts.points.end(), [&](const ContactPoint& contact) {
      return contact.is_rigid_pair() == rigid_pair && !contact.impulse.isZero(0);
    });
  };
  ASSERT_TRUE(holds(true)) << "rigid on rigid";
  ASSERT_TRUE(holds(false)) << "rigid on soft";
  ASSERT_TRUE(std::any_of(repulsions.pairs().begin(), repulsions.pairs().end(),
                          [](const RepulsionPair& pair) { return pair.active; }))
      << "soft on soft";
  double asymmetry = 0, min_curvature = 1e9, max_kept = 0;
  std::vector<Vec3> force;
  std::vector<Mat3> inertia;
  ContactProjection projection;
  for (const int sweeps : {1, 2, 7}) {
    projection.build(world.bodies, contacts, world.context.contact.graph, sweeps, &repulsions);
    VelocitySystem A(world.bodies, 1e-3, ImplicitForces::damping, &projection, force, inertia);
    for (unsigned seed = 1; seed < 4; ++seed) {
      const GeneralizedVelocity u = random_velocity(world.bodies, seed),
                                v = random_velocity(world.bodies, seed + 50);
      const auto operate = [&](GeneralizedVelocity x) {  // P A P
        GeneralizedVelocity out;
        A.project(x);
        A.apply(x, out);
        A.project(out);
        return out;
      };
      GeneralizedVelocity Pu = u, Pv = v;
      A.project(Pu);
      A.project(Pv);
      asymmetry = std::max(asymmetry, std::abs(A.inner(u, Pv) - A.inner(v, Pu)) / A.inner(u, u));
      max_kept = std::max(max_kept, A.inner(Pu, Pu) / A.inner(u, u));
      const GeneralizedVelocity PAPu = operate(u), PAPv = operate(v);
      const double curvature = A.inner(u, PAPu);
      asymmetry = std::max(asymmetry, std::abs(A.inner(u, PAPv) - A.inner(v, PAPu)) / curvature);
      min_curvature = std::min(min_curvature, curvature / A.inner(u, u));
    }
  }
  test::expect_below(asymmetry, 1e-12, "asymmetry of P and of P A P, relative");
  test::expect_above(min_curvature, 0, "least <u, P A P u> / <u, u>");

  test::expect_below(max_kept, 0.999, "largest <P u, P u> / <u, u>");

  // After many sweeps P P = P. Repulsions are left out here: their rows are more than they can determine and
  // almost repeat each other. The test above shows how fast they converge.
  projection.build(world.bodies, contacts, world.context.contact.graph, 4000, nullptr);
  VelocitySystem P(world.bodies, 1e-3, ImplicitForces::damping, &projection, force, inertia);
  GeneralizedVelocity once = random_velocity(world.bodies, 3);
  P.project(once);
  GeneralizedVelocity twice = once, difference;
  P.project(twice);
  VelocitySystem::subtract(twice, once, difference);
  test::expect_below(std::sqrt(P.inner(difference, difference) / P.inner(once, once)), 1e-6,
                     "|P P u - P u| / |P u|");
}

// A soft box slides over a rigid one, both free. The friction of the projection acts on both, so momentum and
// angular momentum stay.
TEST(FrictionOfTheProjection, GivesTheHostWhatItTakesFromTheGuest) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "host", Vec3(0, -0.5, 0), Vec3(2, 1, 2), 50).friction = 0.4;
  test::add_soft_box(scene, "guest", Vec3(0.2, 0.5, 0), Vec3(1, 1, 1), 2).placement.velocity =
      Vec3(1, -0.5, 0.3);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 5; ++i) step(world, i * 1e-3, 1e-3);
  ContactProjection projection;
  projection.build(world.bodies, world.context.contact.contacts, world.context.contact.graph, 1);
  GeneralizedVelocity v;
  to_generalized(world.bodies, v);
  for (std::vector<Vec3>* part : {&v.particle, &v.linear, &v.angular})
    for (Vec3& value : *part) value.setZero();
  EXPECT_TRUE(projection.choose(1, 0.5, v, v));
  projection.add_friction(1, v);
  const Bodies& bodies = world.bodies;
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
    linear += bodies.particles.mass[p] * v.particle[p];
    angular += bodies.particles.x[p].cross(bodies.particles.mass[p] * v.particle[p]);
  }
  const double given = linear.norm(), turned = angular.norm();
  EXPECT_LT(linear.x(), 0);  // against the sliding
  const RigidState& host = bodies.rigid.state[0];
  const Vec3 impulse = bodies.rigid.properties[0].mass * v.linear[0];
  linear += impulse;
  angular += host.pose.position.cross(impulse) + host.inverse_inertia.inverse() * v.angular[0];
  test::expect_below(linear.norm() / given, 1e-13, "momentum, relative");
  test::expect_below(angular.norm() / turned, 1e-12, "angular momentum, relative");
}

// A soft box and a rigid one are on two light plates, which are joined to each other and to a post. Impulses
// on the plates keep the joints (articulated response), so that one joint solve before the sweeps is enough.
TEST(ProjectionOfJointedBodies, IsSymmetricAndKeepsTheJoints) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene::RigidBody& post = test::add_box(scene, "post", Vec3(-1.5, 0, 0), Vec3(0.9, 0.2, 1), 1);
  post.mass.reset();
  post.is_static = true;
  test::add_box(scene, "near", Vec3(-0.5, 0, 0), Vec3(0.9, 0.2, 1), 2);
  test::add_box(scene, "far", Vec3(0.5, 0, 0), Vec3(0.9, 0.2, 1), 1);
  const auto join = [&](const std::string& parent, const std::string& child, double x) {
    scene::Joint joint;
    joint.name = parent + "-" + child;
    joint.type = scene::JointType::hinge;
    joint.parent = parent;
    joint.child = child;
    joint.world.position = Vec3(x, 0, 0);
    joint.world.axis = Vec3::UnitZ();
    scene.joints.push_back(joint);
  };
  join("post", "near", -1);
  join("near", "far", 0);
  test::add_soft_box(scene, "soft", Vec3(0.1, 0.5, 0), Vec3(0.8, 0.8, 0.8), 2);
  test::add_box(scene, "load", Vec3(-0.6, 0.3, 0), Vec3(0.4, 0.4, 0.4), 100);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 10; ++i) step(world, i * 1e-3, 1e-3);
  StepContext& context = world.context;
  for (ContactPoint& contact : context.contact.contacts.points) update_geometry(world.bodies, contact);
  context.joints.response.outdate();
  const ArticulatedResponse* linked = context.joints.response.prepare(
      world.bodies, context.joints.solver, ControlledJoints::are_free, context.contact.contacts);
  ASSERT_TRUE(linked && linked->is_complete());
  context.joints.solver.prepare_projection(world.bodies.rigid);
  ContactProjection projection;
  std::vector<Vec3> force;
  std::vector<Mat3> inertia;
  double asymmetry = 0, max_kept = 0, off = 0;
  for (const int sweeps : {1, 3}) {
    projection.build(world.bodies, context.contact.contacts, context.contact.graph, sweeps, nullptr, linked);
    projection.add_joints(context.joints.solver);
    const VelocitySystem P(world.bodies, 1e-3, ImplicitForces::damping, &projection, force, inertia);
    for (unsigned seed = 1; seed < 4; ++seed) {
      const GeneralizedVelocity u = random_velocity(world.bodies, seed),
                                v = random_velocity(world.bodies, seed + 50);
      GeneralizedVelocity Pu = u, Pv = v;
      P.project(Pu);
      P.project(Pv);
      asymmetry = std::max(asymmetry, std::abs(P.inner(u, Pv) - P.inner(v, Pu)) / P.inner(u, u));
      max_kept = std::max(max_kept, P.inner(Pu, Pu) / P.inner(u, u));
      std::vector<Vec3> linear = Pu.linear, angular = Pu.angular;
      context.joints.solver.project(world.bodies.rigid, linear, angular);
      for (std::size_t i = 0; i < linear.size(); ++i)
        off = std::max({off, (linear[i] - Pu.linear[i]).norm(), (angular[i] - Pu.angular[i]).norm()});
    }
  }
  test::expect_below(asymmetry, 1e-12, "asymmetry, relative");
  test::expect_below(max_kept, 0.999, "largest <P u, P u> / <u, u>");
  test::expect_below(off, 1e-12, "what the joints lack, m/s or rad/s");
}

}  // namespace
}  // namespace duet::contact_projection_test
