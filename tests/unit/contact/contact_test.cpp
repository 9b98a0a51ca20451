// Contact candidates, the contact graph, the contact solve and push-out.
#include <algorithm>
#include <set>
#include <vector>

#include "tests/support/meshes.h"
#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/detection/edge_contacts.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/max_penetration.h"
#include "sim/contact/push_out/push_out.h"
#include "sim/contact/response/contact_solver.h"
#include "sim/contact/response/warm_start.h"

namespace duet::contact_test {
namespace {

using test::add_ball;
using test::add_box;
using test::add_soft_box;

VelocityState no_difference(const Bodies& bodies) {
  VelocityState state;
  store_velocities(bodies, state);
  for (Vec3& v : state.particle) v.setZero();
  for (Vec3& v : state.rigid) v.setZero();
  for (Vec3& v : state.rotation) v.setZero();
  return state;
}

ContactSet candidates(const Bodies& bodies, double dt) {
  ContactSet contacts;
  find_candidates(bodies, {}, dt, no_difference(bodies), contacts);
  return contacts;
}

// Of an impulse at the contact; K is what it does to the relative velocity.
void expect_equal_and_opposite(Bodies& bodies, const ContactPoint& contact) {
  const Momentum before = momentum(bodies);
  const Vec3 velocity = relative_velocity(bodies, contact), impulse(3, -5, 7);
  apply_impulse(bodies, contact, impulse);
  const Momentum after = momentum(bodies);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-11);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-11);
  EXPECT_LT((relative_velocity(bodies, contact) - velocity - contact.response.K * impulse).norm(), 1e-12);
}

TEST(ContactPoint, ImpulsesAreEqualAndOppositeAtOnePlace) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  const ContactSet contacts = candidates(bodies, 0.1);
  ASSERT_GT(contacts.points.size(), 50u);
  for (const ContactPoint& contact : contacts.points) {
    if (!bodies.rigid.properties[static_cast<std::size_t>(contact.host)].is_dynamic()) continue;
    expect_equal_and_opposite(bodies, contact);
  }
}

// As a step later, from what is remembered of a place on a deformable guest's edge or face.
void expect_the_same_anew(const Bodies& bodies, const ContactPoint& contact) {
  ContactPoint again;
  again.host = contact.host;
  again.guest_point = contact.guest_point;
  again.edge = contact.edge;
  put_on_surface(bodies, again);
  update_geometry(bodies, again);
  EXPECT_NEAR(again.gap, contact.gap, 1e-15) << "the place has been found anew, to rounding";
  EXPECT_LT((again.response.K - contact.response.K).norm(), 1e-14 * contact.response.K.norm());
}

// A block over the edge of a beam: what its own edges touch there acts between their particles, in the plane
// of both edges, and stays the same when a step later it is built anew from what is remembered.
TEST(ContactPoint, OfSoftEdgesActWhereTheyCross) {
  scene::Scene scene = test::free_space();
  add_box(scene, "beam", Vec3::Zero(), Vec3(1, 1, 5), 10).placement.orientation =
      Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY())) * Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitZ()));
  add_soft_box(scene, "block", Vec3(0.13, std::sqrt(0.5) + 0.495, 0.21), Vec3(2, 1, 2), 2);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  int told = 0;
  for (const ContactPoint& contact : candidates(bodies, 1e-3).points) {
    if (!contact.is_on_edge()) continue;
    ++told;
    ASSERT_FALSE(contact.is_rigid_pair());
    EXPECT_NEAR(contact.gap, -0.005, 1e-12);
    EXPECT_LT((contact.normal - Vec3::UnitY()).norm(), 1e-12);
    expect_equal_and_opposite(bodies, contact);
    expect_the_same_anew(bodies, contact);
  }
  EXPECT_GE(told, 4);  // of edges 1 m apart, and across their squares
  // The overlap that is told is that of the edges: their points, 25 cm apart, are above. A place is found to
  // half a hundredth of that way, on a slope of one half.
  EXPECT_NEAR(max_penetration(bodies, {}), 0.005 / std::sqrt(2), 0.25 * 0.005 / 2);
}

// A cube stands on a corner that has pressed in a face of two blocks at once, one above and one below:
// contact acts there on the face's particles, as the overlap that is told, and from step to step it has the
// same name.
TEST(ContactPoint, OfCornersActOnTheFacesThatTheyPressIn) {
  scene::Scene scene = test::free_space();
  const double half = std::sqrt(0.75);
  add_box(scene, "cube", Vec3::Zero(), Vec3(1, 1, 1), 10).placement.orientation =
      shortest_rotation(Vec3(1, 1, 1), Vec3::UnitY());
  add_soft_box(scene, "upper", Vec3(0.17, half + 0.495, 0.29), Vec3(2, 1, 2), 2);
  add_soft_box(scene, "lower", Vec3(0.17, -half - 0.495, 0.29), Vec3(2, 1, 2), 2);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  std::set<int> names;
  for (const ContactPoint& contact : candidates(bodies, 1e-3).points) {
    ASSERT_TRUE(contact.is_on_edge());  // no point is near
    const double side = contact.on_surface.particle[0] < bodies.deformable[1].first_particle ? 1 : -1;
    EXPECT_EQ(contact.on_surface.count, 3);
    EXPECT_NEAR(contact.gap, -0.005, 1e-12);
    EXPECT_LT((contact.normal - side * Vec3::UnitY()).norm(), 1e-12);
    EXPECT_LT((touch(bodies, contact).position - side * Vec3(0, half - 0.005, 0)).norm(), 1e-12);
    expect_equal_and_opposite(bodies, contact);
    names.insert(contact.guest_point);
    expect_the_same_anew(bodies, contact);
  }
  EXPECT_EQ(names.size(), 2U);
  EXPECT_NEAR(max_penetration(bodies, {}), 0.005, 1e-12);
}

TEST(ContactCandidates, FindWhatCanTouchWithinTheStepAndNothingElse) {
  scene::Scene scene = test::free_space();
  add_soft_box(scene, "soft", Vec3(0, 0, 0), Vec3(2, 2, 2), 4);
  add_ball(scene, "ball", Vec3(0, 2.5, 0), 1, 10).placement.velocity = Vec3(0, -10, 0);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  EXPECT_TRUE(candidates(bodies, 0.01).points.empty());  // 0.1 m of a gap of 0.5 m
  const ContactSet near = candidates(bodies, 0.06);
  ASSERT_EQ(near.pairs.size(), 1u);
  for (const ContactPoint& contact : near.points) {
    EXPECT_NEAR(touch(bodies, contact).position.y(), 1, 1e-14);  // the face below the ball, not the far ones
    EXPECT_LT(contact.gap, 0.06 * (1.5 * 10 + 0.1));             // the margin is half the motion
  }
}

// A soft box hangs over the edge of a beam, and turns and stretches: the ends of its edges move at different
// speeds. What reaches the beam within the step is found, also where one end of its edge would not.
TEST(ContactCandidates, FindSoftEdgesOfWhichOnlyOneEndIsFast) {
  scene::Scene scene = test::free_space();
  auto& beam = add_box(scene, "beam", Vec3::Zero(), Vec3(1, 1, 5), 1);
  beam.is_static = true;
  beam.mass.reset();
  beam.placement.orientation =
      Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY())) * Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitZ()));
  add_soft_box(scene, "block", Vec3(0.13, 1.27, 0.21), Vec3(2, 1, 2), 4).shape.cells = Vec3i(4, 2, 4);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  const Pose& pose = bodies.rigid.state[0].pose;
  const DeformableBody& block = bodies.deformable[0];
  const std::vector<Vec3>& x = bodies.particles.x;
  std::vector<Vec3>& v = bodies.particles.v;
  constexpr double dt = 0.01;
  std::mt19937 random(31);
  std::vector<double> scratch;
  int expected = 0, of_one_end = 0;
  for (int i = 0; i < 200; ++i) {
    Mat3 gradient;  // 1/s
    for (int k = 0; k < 3; ++k) gradient.col(k) = 10 * test::random_vector(random);
    for (std::size_t p = 0; p < v.size(); ++p) v[p] = gradient * (x[p] - x[as_index(i) % x.size()]);
    std::set<int> found;
    for (const ContactPoint& contact : candidates(bodies, dt).points) found.insert(contact.guest_point);
    for (int e = block.first_edge; e < block.first_edge + block.edge_count; ++e) {
      const auto [a, b] = bodies.edges[as_index(e)].particle;
      const auto near = edge_contact_on(pose.to_body(x[as_index(a)]), pose.to_body(x[as_index(b)]),
                                        block.parts_per_edge, bodies.rigid.properties[0].shape, 1, scratch);
      if (!near) continue;
      const Vec3 at_a = v[as_index(a)], at_b = v[as_index(b)];
      const Vec3 velocity = near->edge.weight[0] * at_a + near->edge.weight[1] * at_b;
      if (!(near->distance < dt * velocity.norm())) continue;
      SurfacePoint place{.particle = {a, b, 0, 0}, .count = 2};
      std::copy_n(near->edge.weight.begin(), 2, place.weight.begin());
      if (!is_support_point(bodies, place, pose.to_world(near->edge.place),
                            pose.orientation * near->edge.normal))
        continue;  // the beam is beside it
      ++expected;
      of_one_end += !(near->distance < dt * std::min(at_a.norm(), at_b.norm()) / 2);
      EXPECT_TRUE(found.contains(static_cast<int>(bodies.points.size()) + e)) << i << ' ' << e;
    }
  }
  EXPECT_GT(expected, 200);
  EXPECT_GT(of_one_end, 50);
}

TEST(ContactCandidates, ABallTouchesAPlaneWithItsLowestPoint) {
  scene::Scene scene = test::on_ground();
  add_ball(scene, "ball", Vec3(3, 0.999, 2), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  const ContactSet contacts = candidates(simulation.world().bodies, 0.01);
  ASSERT_EQ(contacts.points.size(), 1u);
  EXPECT_NEAR(contacts.points[0].gap, -0.001, 1e-15);
  EXPECT_TRUE(contacts.points[0].guest_arm.isApprox(Vec3(0, -1, 0)));
  EXPECT_NEAR(max_penetration(simulation.world().bodies, {}), 0.001, 1e-15);
}

TEST(ContactGraph, LevelsAreDistancesFromTheGroundThroughSoftBodiesToo) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 1e-3);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  // rigid: box2, box4, ground; deformable: soft1, soft3
  EXPECT_EQ(graph.level, (std::vector<int>{2, 4, 0, 1, 3}));
  int last = 0;
  for (int p : graph.schedule.order()) {
    EXPECT_GE(contacts.pairs[static_cast<std::size_t>(p)].level, last);
    last = contacts.pairs[static_cast<std::size_t>(p)].level;
  }
  EXPECT_EQ(last, 4);
}

// On the way to each other, bodies that have not collided must not be stopped by V.4: they shall bounce
// first.
TEST(WarmStart, LeavesRigidPairsThatNeitherCollidedNorTouchInactive) {
  scene::Scene scene = test::on_ground();
  add_ball(scene, "falling", Vec3(0, 1.001, 0), 1, 10);
  add_ball(scene, "resting", Vec3(5, 1, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.1);
  ASSERT_EQ(contacts.pairs.size(), 2u);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  EXPECT_EQ(graph.schedule.order().size(), 2u);
  bodies.rigid.state[1].velocity = Vec3(0, -1e-3, 0);
  find_speculative_targets(0.1, OrientationUpdate::exact, graph, bodies, contacts);
  ContactSolveScratch scratch;
  solve_contact(bodies, graph, {}, contacts, scratch);
  warm_start_again(2, graph, bodies, contacts);
  for (const ContactPair& pair : contacts.pairs) EXPECT_EQ(pair.active, pair.guest_rigid == 1);
  contacts.pairs[0].collided = contacts.pairs[1].collided = true;
  warm_start_again(2, graph, bodies, contacts);
  for (const ContactPair& pair : contacts.pairs) EXPECT_TRUE(pair.active);
}

// No contact closes faster than its gap allows, every impulse lies in its cone, and separating contacts have
// none.
TEST(ContactSolve, ConvergesToTheConditionsOfContact) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  for (Vec3& v : bodies.particles.v) v = Vec3(0.3, -1, 0);
  for (std::size_t i = 0; i < 2; ++i) bodies.rigid.state[i].velocity = Vec3(0.1, -1.2, 0.2);
  constexpr double dt = 1e-3;
  ContactSet contacts = candidates(bodies, dt);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  find_speculative_targets(dt, OrientationUpdate::exact, graph, bodies, contacts);
  ContactSolveScratch scratch;
  const int sweeps =
      solve_contact(bodies, graph, {.iterations = 2000, .tolerance = 1e-12}, contacts, scratch);
  EXPECT_LT(sweeps, 2000);
  EXPECT_GT(count_active(contacts, graph), 20);
  for (const ContactPoint& contact : contacts.points) {
    const Vec3 velocity = relative_velocity(bodies, contact);
    const double normal = velocity.dot(contact.normal), target = contact.target;
    const double along = contact.impulse.dot(contact.normal);
    EXPECT_GE(normal, target - 1e-9);
    EXPECT_LE((contact.impulse - along * contact.normal).norm(), contact.friction * along + 1e-9);
    if (normal > target + 1e-6) {
      EXPECT_TRUE(contact.impulse.isZero(0));
    }
  }
}

TEST(PushOut, SeparatesAnOverlappingPairAboutItsCentreOfMass) {
  scene::Scene scene = test::free_space();
  add_ball(scene, "heavy", Vec3(0, 0, 0), 1, 30);
  add_ball(scene, "light", Vec3(1.9, 0, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  for (ContactPair& pair : contacts.pairs) pair.collided = true;
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  PushOutScratch scratch;
  EXPECT_GT(resolve_interpenetration(bodies, graph, {.iterations = 8}, contacts, scratch), 0);
  const double heavy = bodies.rigid.state[0].pose.position.x(),
               light = bodies.rigid.state[1].pose.position.x();
  EXPECT_NEAR(light - heavy, 2, 1e-5);  // touching, up to what contact takes for touching
  EXPECT_NEAR(30 * heavy + 10 * light, 19, 1e-12);
  EXPECT_LT(heavy, 0);
}

// A light ball between two heavy ones that overlap it by 5 %: the central body sees both at once.
TEST(PushOut, OneSweepFreesALightBodyBetweenHeavyOnes) {
  scene::Scene scene = test::free_space();
  add_ball(scene, "left", Vec3(-1.9, 0, 0), 1, 1000);
  add_ball(scene, "middle", Vec3(0, 0, 0), 1, 1);
  add_ball(scene, "right", Vec3(1.9, 0, 0), 1, 1000);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  for (ContactPair& pair : contacts.pairs) pair.collided = true;
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  PushOutScratch scratch;
  resolve_interpenetration(bodies, graph, {.iterations = 1}, contacts, scratch);
  EXPECT_LT(max_penetration(bodies, {}), 1e-3 * 0.1);
}

TEST(PushOut, ASoftBoxIsLiftedOffTheGroundAndStaysWhole) {
  scene::Scene scene = test::on_ground();
  add_soft_box(scene, "soft", Vec3(0, 0.95, 0), Vec3(2, 2, 2), 2);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, true, contacts, graph);
  PushOutScratch scratch;
  resolve_interpenetration(bodies, graph, {}, contacts, scratch);
  EXPECT_LT(max_penetration(bodies, {}), 1.1e-6);
  EXPECT_EQ(bodies.forces.elements.strain(bodies.particles.x).inverted, 0);
}

}  // namespace
}  // namespace duet::contact_test
