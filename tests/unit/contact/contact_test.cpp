// Tests of contact as a whole: candidates, the contact graph, the contact solve and interpenetration
// resolution together.
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

// Returns a difference of velocities that is zero for all bodies.
VelocityState no_difference(const Bodies& bodies) {
  VelocityState state;
  store_velocities(bodies, state);
  for (Vec3& v : state.particle) v.setZero();
  for (Vec3& v : state.rigid) v.setZero();
  for (Vec3& v : state.rotation) v.setZero();
  return state;
}

// Finds the contact candidates of a step of `dt` (s).
ContactSet candidates(const Bodies& bodies, double dt) {
  ContactSet contacts;
  find_candidates(bodies, {}, dt, no_difference(bodies), contacts);
  return contacts;
}

// Applies an impulse at the contact and expects that it keeps linear and angular momentum, and that the
// relative velocity changes by K times the impulse.  The bounds are rounding.
void expect_equal_and_opposite(Bodies& bodies, const ContactPoint& contact) {
  const Momentum before = momentum(bodies);
  const Vec3 velocity = relative_velocity(bodies, contact), impulse(3, -5, 7);
  apply_impulse(bodies, contact, impulse);
  const Momentum after = momentum(bodies);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-11);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-11);
  EXPECT_LT((relative_velocity(bodies, contact) - velocity - contact.response.K * impulse).norm(), 1e-12);
}

// Impulses at all contacts of a stack of rigid and soft boxes act on both sides, equal and opposite, at one
// place. Arms to two different places would change the angular momentum.
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

// Expects that a contact at an edge or face of a deformable guest is found again from what the contact cache
// keeps of it (its names and its EdgePoint), as in the next step.
void expect_the_same_anew(const Bodies& bodies, const ContactPoint& contact) {
  ContactPoint again;
  again.host = contact.host;
  again.feature = contact.feature;
  again.edge = contact.edge;
  put_on_surface(bodies, again);
  update_geometry(bodies, again);
  EXPECT_NEAR(again.gap, contact.gap, 1e-15) << "the place has been found anew, to rounding";
  EXPECT_LT((again.response.K - contact.response.K).norm(), 1e-14 * contact.response.K.norm());
}

// A soft block lies over the edge of a beam. Contacts where its own edges cross that edge act between the
// particles of the block's edges, in the plane of both edges, and the contact cache restores them in the next
// step. The block's underside is 5 mm below the beam's edge, hence the gap.
TEST(ContactPoint, SoftEdgeContactsActWhereEdgesCross) {
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
  EXPECT_GE(told, 4);  // edges are 1 m apart, and diagonals cross their squares
  // The penetration that is reported is that of the edge contacts: the surface points of the block's edges,
  // 25 cm apart, are above the beam. On a slope of 1/sqrt(2) the gap of 5 mm is a distance of 5 mm / sqrt(2).
  // The search finds a place to a hundredth of 25 cm, so up to half of that along the slope is missing.
  EXPECT_NEAR(max_penetration(bodies, {}), 0.005 / std::sqrt(2), 0.25 * 0.005 / 2);
}

// A cube stands on one corner and presses another one into a block above it. Both corners are 5 mm deep in
// the middle of a face, where no surface point is near. The contact acts on the three particles of the face,
// its depth is the penetration that is reported, and the two contacts have names of their own that stay the
// same from step to step.
TEST(ContactPoint, VertexFaceContactsActOnTheirFaces) {
  scene::Scene scene = test::free_space();
  const double half = std::sqrt(0.75);
  add_box(scene, "cube", Vec3::Zero(), Vec3(1, 1, 1), 10).placement.orientation =
      shortest_rotation(Vec3(1, 1, 1), Vec3::UnitY());
  add_soft_box(scene, "upper", Vec3(0.17, half + 0.495, 0.29), Vec3(2, 1, 2), 2);
  add_soft_box(scene, "lower", Vec3(0.17, -half - 0.495, 0.29), Vec3(2, 1, 2), 2);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  std::set<FeatureId> names;
  for (const ContactPoint& contact : candidates(bodies, 1e-3).points) {
    ASSERT_TRUE(contact.is_on_edge());  // no surface point of a block is near
    const double side = contact.on_surface.particle[0] < bodies.deformable[1].first_particle ? 1 : -1;
    EXPECT_EQ(contact.on_surface.count, 3);
    EXPECT_NEAR(contact.gap, -0.005, 1e-12);
    EXPECT_LT((contact.normal - side * Vec3::UnitY()).norm(), 1e-12);
    EXPECT_LT((touch(bodies, contact).position - side * Vec3(0, half - 0.005, 0)).norm(), 1e-12);
    expect_equal_and_opposite(bodies, contact);
    names.insert(contact.feature);
    expect_the_same_anew(bodies, contact);
  }
  EXPECT_EQ(names.size(), 2U);
  EXPECT_NEAR(max_penetration(bodies, {}), 0.005, 1e-12);
}

// A ball flies at 10 m/s towards a soft box 0.5 m away. There are no candidates in a step in which it cannot
// reach the box, and only points of the face ahead of it in a longer one.
TEST(ContactCandidates, AreWhatCanTouchWithinTheStep) {
  scene::Scene scene = test::free_space();
  add_soft_box(scene, "soft", Vec3(0, 0, 0), Vec3(2, 2, 2), 4);
  add_ball(scene, "ball", Vec3(0, 2.5, 0), 1, 10).placement.velocity = Vec3(0, -10, 0);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  // In 0.01 s the ball closes 0.1 m of the gap of 0.5 m.
  EXPECT_TRUE(candidates(bodies, 0.01).points.empty());
  const ContactSet near = candidates(bodies, 0.06);
  ASSERT_EQ(near.pairs.size(), 1u);
  for (const ContactPoint& contact : near.points) {
    // The points are on the face below the ball and not on the far ones.
    EXPECT_NEAR(touch(bodies, contact).position.y(), 1, 1e-14);
    // The speculative margin is 1.5 dt v, and a little for bodies at rest.
    EXPECT_LT(contact.gap, 1.5 * 0.06 * 10 + 0.01);
  }
}

// A soft block hangs over the edge of a beam, turns and stretches, so that the ends of its edges move at
// different speeds. Every edge contact whose own point can reach the beam within the step is a candidate,
// also where an end of the edge is too slow to. `expected` counts them by a direct search with the
// interpolated velocity; a margin from one end alone would miss more than 50 of them.
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
    std::set<FeatureId> found;
    for (const ContactPoint& contact : candidates(bodies, dt).points) found.insert(contact.feature);
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
        continue;  // the beam is beside the edge and not below it
      ++expected;
      of_one_end += !(near->distance < dt * std::min(at_a.norm(), at_b.norm()) / 2);
      EXPECT_TRUE(found.contains(FeatureId::edge(e))) << i << ' ' << e;
    }
  }
  EXPECT_GT(expected, 200);
  EXPECT_GT(of_one_end, 50);
}

// A ball that overlaps the ground by 1 mm has one contact, at its support point, with that gap.
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

// The level of a body in the contact graph is the length of the chain of supports down to the ground, also
// through deformable bodies.
TEST(ContactGraph, LevelsCountSoftBodiesToo) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 1e-3);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
  // rigid: box2, box4, ground; deformable: soft1, soft3
  EXPECT_EQ(graph.level, (std::vector<int>{2, 4, 0, 1, 3}));
  int last = 0;
  for (int p : graph.schedule.order()) {
    EXPECT_GE(contacts.pairs[static_cast<std::size_t>(p)].level, last);
    last = contacts.pairs[static_cast<std::size_t>(p)].level;
  }
  EXPECT_EQ(last, 4);
}

// Bodies that approach each other but have not collided yet stay inactive in the contact solve of stage V.4:
// otherwise it would stop them before the next collision stage could let them bounce. Pairs that touch, or
// that collided, are active.
TEST(WarmStart, LeavesApproachingRigidPairsInactive) {
  scene::Scene scene = test::on_ground();
  add_ball(scene, "falling", Vec3(0, 1.001, 0), 1, 10);
  add_ball(scene, "resting", Vec3(5, 1, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.1);
  ASSERT_EQ(contacts.pairs.size(), 2u);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
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

// The converged solution satisfies the conditions of contact: no contact closes faster than its gap allows,
// every impulse lies in its friction cone, and contacts that separate have none (Signorini and Coulomb). The
// sweeps end when one changes less than 1e-12 m/s, far below the bounds.
TEST(ContactSolve, ConvergesToTheConditionsOfContact) {
  const scene::Scene scene = test::small_stack();
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  for (Vec3& v : bodies.particles.v) v = Vec3(0.3, -1, 0);
  for (std::size_t i = 0; i < 2; ++i) bodies.rigid.state[i].velocity = Vec3(0.1, -1.2, 0.2);
  constexpr double dt = 1e-3;
  ContactSet contacts = candidates(bodies, dt);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
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

// An overlap of 0.1 m of free balls is removed by displacements in the inverse ratio of their masses: 30 x1 +
// 10 x2 = 19 kg m stays to rounding.
TEST(Interpenetration, KeepsThePairsCenterOfMass) {
  scene::Scene scene = test::free_space();
  add_ball(scene, "heavy", Vec3(0, 0, 0), 1, 30);
  add_ball(scene, "light", Vec3(1.9, 0, 0), 1, 10);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  for (ContactPair& pair : contacts.pairs) pair.collided = true;
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
  PushOutScratch scratch;
  EXPECT_GT(resolve_interpenetration(bodies, graph, {.iterations = 8}, contacts, scratch), 0);
  const double heavy = bodies.rigid.state[0].pose.position.x(),
               light = bodies.rigid.state[1].pose.position.x();
  EXPECT_NEAR(light - heavy, 2, 1e-5);  // the overlap tolerance of contact
  EXPECT_NEAR(30 * heavy + 10 * light, 19, 1e-12);
  EXPECT_LT(heavy, 0);
}

// A light ball lies between two heavy ones that overlap it by 5 %. With the light ball as the central body,
// one system sees both overlaps at once, and a single iteration leaves less than a thousandth of the overlap.
// Pairs one after the other would push it back and forth.
TEST(Interpenetration, OneSweepFreesALightBodyBetweenHeavyOnes) {
  scene::Scene scene = test::free_space();
  add_ball(scene, "left", Vec3(-1.9, 0, 0), 1, 1000);
  add_ball(scene, "middle", Vec3(0, 0, 0), 1, 1);
  add_ball(scene, "right", Vec3(1.9, 0, 0), 1, 1000);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  for (ContactPair& pair : contacts.pairs) pair.collided = true;
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
  PushOutScratch scratch;
  resolve_interpenetration(bodies, graph, {.iterations = 1}, contacts, scratch);
  EXPECT_LT(max_penetration(bodies, {}), 1e-3 * 0.1);
}

// A soft box that is sunk into the ground by 5 cm is lifted out to within the overlap tolerance of 1e-6 m,
// and no tetrahedron of it inverts.
TEST(Interpenetration, ASoftBoxIsLiftedOffTheGroundAndStaysWhole) {
  scene::Scene scene = test::on_ground();
  add_soft_box(scene, "soft", Vec3(0, 0.95, 0), Vec3(2, 2, 2), 2);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  ContactSet contacts = candidates(bodies, 0.01);
  ContactGraph graph;
  build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
  PushOutScratch scratch;
  resolve_interpenetration(bodies, graph, {}, contacts, scratch);
  EXPECT_LT(max_penetration(bodies, {}), 1.1e-6);
  EXPECT_EQ(bodies.forces.elements.strain(bodies.particles.x).inverted, 0);
}

}  // namespace
}  // namespace duet::contact_test
