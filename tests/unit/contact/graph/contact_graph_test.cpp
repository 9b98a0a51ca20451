#include "sim/contact/graph/contact_graph.h"

#include <algorithm>
#include <cmath>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

namespace duet::contact_graph_test {
namespace {

using test::add_pair;
using test::loose_bodies;
using Levels = std::vector<int>;
using Flags = std::vector<char>;

const Vec3 gravity(0, -9.8, 0), up(0, 1, 0), sideways(1, 0, 0);

// Builds the contact graph for the gravity `g` (m/s^2).
ContactGraph graph_of(const Bodies& bodies, ContactSet& contacts, const Vec3& g = gravity) {
  ContactGraph graph;
  build_contact_graph(bodies, g, RigidPairs::are_active, contacts, graph);
  return graph;
}

// In a tower every box is one level above the one below. The boxes are listed from the top down, so that no
// order of the list gives the levels.
TEST(ContactGraph, EveryBoxOfATowerHasALevelOfItsOwn) {
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < 5; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 4.5 - i, 0), Vec3(1, 1, 1), 1);
  const test::ContactScene tower(scene, 1e-3);
  EXPECT_EQ(tower.graph.level, (Levels{5, 4, 3, 2, 1, 0}));
  EXPECT_EQ(tower.graph.supported, (Flags{1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(tower.graph.island, (Levels{0, 0, 0, 0, 0, 5}));
}

// Body 0 leans on 1, 1 on 2 and 2 on 0; body 2 also stands on the ground (4), and 3 on 1. The ring is one
// strongly connected component and shares a level.
TEST(ContactGraph, ARingOfBodiesThatSupportEachOtherSharesALevel) {
  const Bodies bodies = loose_bodies(5, {4});
  const Vec3 slope = Vec3(1, 0.5, 0).normalized();
  ContactSet contacts;
  add_pair(contacts, 0, 1, -slope);
  add_pair(contacts, 1, 2, -slope);
  add_pair(contacts, 0, 2, slope);
  add_pair(contacts, 1, 3, up);
  const ContactGraph floating = graph_of(bodies, contacts);
  EXPECT_EQ(floating.level, (Levels{1, 1, 1, 2, 0}));
  EXPECT_EQ(floating.supported, (Flags{0, 0, 0, 0, 1})) << "they hold each other, and nothing holds them";

  add_pair(contacts, 4, 2, up);
  const ContactGraph standing = graph_of(bodies, contacts);
  EXPECT_EQ(standing.level, (Levels{1, 1, 1, 2, 0}));
  EXPECT_EQ(standing.supported, (Flags{1, 1, 1, 1, 1}));
  std::vector<int> pair_levels;
  for (const ContactPair& pair : contacts.pairs) pair_levels.push_back(pair.level);
  EXPECT_EQ(pair_levels, (Levels{1, 1, 1, 2, 1}));
}

// The ring 1, 2, 3 is on top of 0, which stands on the ground (6). Bodies 4 and 5 make a ring on top of that
// one.
TEST(ContactGraph, RingsAreOneLevelAboveTheirSupport) {
  const Bodies bodies = loose_bodies(7, {6});
  const Vec3 slope = Vec3(1, 0.5, 0).normalized();
  ContactSet contacts;
  add_pair(contacts, 1, 2, slope);
  add_pair(contacts, 2, 3, slope);
  add_pair(contacts, 1, 3, -slope);
  add_pair(contacts, 6, 0, up);
  add_pair(contacts, 0, 3, up);
  add_pair(contacts, 4, 5, slope);
  add_pair(contacts, 5, 4, slope);
  add_pair(contacts, 1, 5, up);
  const ContactGraph graph = graph_of(bodies, contacts);
  EXPECT_EQ(graph.level, (Levels{1, 2, 2, 2, 3, 3, 0}));
  EXPECT_EQ(graph.supported, (Flags{1, 1, 1, 1, 1, 1, 1}));
}

// A level is the longest chain of supports down to the ground and not the shortest: body 2 stands on the
// ground and on 1.
TEST(ContactGraph, LevelsFollowTheLongestPath) {
  const Bodies bodies = loose_bodies(4, {3});
  ContactSet contacts;
  add_pair(contacts, 2, 3, -up);  // the ground as guest
  add_pair(contacts, 1, 2, up);
  add_pair(contacts, 0, 1, up);
  add_pair(contacts, 3, 0, up);
  EXPECT_EQ(graph_of(bodies, contacts).level, (Levels{1, 2, 3, 0}));
}

// A body is supported only if a chain of contacts against gravity leads down to a static body. Bodies on a
// falling body, below a static one or beside it are not, and shock propagation must not act on them.
TEST(ContactGraph, WhatHangsFreeIsNotSupported) {
  const Bodies bodies = loose_bodies(5, {4});
  ContactSet contacts;
  add_pair(contacts, 0, 1, up);        // 1 on 0, which falls
  add_pair(contacts, 4, 2, -up);       // 2 below the static body
  add_pair(contacts, 4, 3, sideways);  // 3 beside it
  const ContactGraph graph = graph_of(bodies, contacts);
  EXPECT_EQ(graph.level, (Levels{1, 2, 1, 1, 0}));
  EXPECT_EQ(graph.supported, (Flags{0, 0, 0, 0, 1}));
}

// A contact supports if the vertical component of its normal is at least a tenth: 0.09 does not, 0.11 does.
TEST(ContactGraph, WallsCarryFromASlopeOfATenthOn) {
  const Bodies bodies = loose_bodies(3, {2});
  ContactSet contacts;
  add_pair(contacts, 2, 0, Vec3(std::sqrt(1 - 0.09 * 0.09), 0.09, 0));
  add_pair(contacts, 2, 1, Vec3(std::sqrt(1 - 0.11 * 0.11), 0.11, 0));
  EXPECT_EQ(graph_of(bodies, contacts).supported, (Flags{0, 1, 1}));
}

// Without gravity no body supports another. A changed gravity changes supports, because the graph follows its
// direction.
TEST(ContactGraph, WithoutGravityNothingRestsOnAnything) {
  const Bodies bodies = loose_bodies(3, {2});
  ContactSet contacts;
  add_pair(contacts, 2, 0, up);
  add_pair(contacts, 0, 1, up);
  const ContactGraph graph = graph_of(bodies, contacts, Vec3::Zero());
  EXPECT_EQ(graph.level, (Levels{1, 1, 0}));
  EXPECT_EQ(graph.supported, (Flags{0, 0, 1}));
  // Along another gravity the same contacts are walls or ceilings.
  EXPECT_EQ(graph_of(bodies, contacts, Vec3(3, 0, 0)).supported, (Flags{0, 0, 1}));
  EXPECT_EQ(graph_of(bodies, contacts, Vec3(0, 5, 0)).level, (Levels{2, 1, 0}));
}

// Kinematic bodies have level 0 and support others, and join no islands.
TEST(ContactGraph, KinematicBodiesCarryLikeStaticOnes) {
  Bodies bodies = loose_bodies(4, {2, 3});
  bodies.rigid.properties[2].is_kinematic = true;
  ContactSet contacts;
  add_pair(contacts, 2, 0, up);
  add_pair(contacts, 3, 1, up);
  add_pair(contacts, 3, 2, up);  // a kinematic body that stands on something stays at level 0
  const ContactGraph graph = graph_of(bodies, contacts);
  EXPECT_EQ(graph.level, (Levels{1, 1, 0, 0}));
  EXPECT_EQ(graph.supported, (Flags{1, 1, 1, 1}));
  EXPECT_EQ(graph.island, (Levels{0, 1, 2, 3}));
}

// The contacts of a pair can be found from either body. The one that overlaps most says which body supports
// the other.
TEST(ContactGraph, TheDeepestContactOfAPairDecides) {
  const Bodies bodies = loose_bodies(3, {2});
  ContactSet contacts;
  add_pair(contacts, 2, 0, up);
  ContactPair& pair = add_pair(contacts, 0, 1, sideways);
  contacts.points.back().gap = 0.01;
  ContactPoint reversed = contacts.points.back();
  reversed.host = 1;
  reversed.guest_rigid = 0;
  reversed.normal = -up;  // outward of body 1, down to body 0
  reversed.gap = -0.02;
  contacts.points.push_back(reversed);
  pair.end = 3;
  EXPECT_EQ(graph_of(bodies, contacts).level, (Levels{1, 2, 0}));
  contacts.points[2].gap = 0.02;  // the contact with the horizontal normal is now the nearer one
  EXPECT_EQ(graph_of(bodies, contacts).level, (Levels{1, 1, 0}));
  contacts.points[2].gap = -0.02;
  contacts.points[2].normal = up;  // body 0 now rests on body 1
  EXPECT_EQ(graph_of(bodies, contacts).level, (Levels{2, 1, 0}));
}

// Bodies 0, 1 and 2, 3 are towers on the ground (5), which joins no islands. Body 4 is a bridge that does.
TEST(ContactGraph, TowersAreIslandsUntilABridgeJoinsThem) {
  const Bodies bodies = loose_bodies(6, {5});
  ContactSet contacts;
  add_pair(contacts, 5, 0, up);
  add_pair(contacts, 0, 1, up);
  add_pair(contacts, 5, 2, up);
  add_pair(contacts, 2, 3, up);
  const ContactGraph apart = graph_of(bodies, contacts);
  EXPECT_EQ(apart.island, (Levels{0, 0, 2, 2, 4, 5}));
  Levels of_pairs;
  for (const ContactPair& pair : contacts.pairs) of_pairs.push_back(apart.island_of(bodies, pair));
  EXPECT_EQ(of_pairs, (Levels{0, 0, 2, 2}));

  add_pair(contacts, 3, 4, up);
  add_pair(contacts, 4, 1, -up);
  const ContactGraph joined = graph_of(bodies, contacts);
  EXPECT_EQ(joined.island, (Levels{0, 0, 0, 0, 0, 5}));
  for (const ContactPair& pair : contacts.pairs) EXPECT_EQ(joined.island_of(bodies, pair), 0);
  EXPECT_EQ(joined.level, (Levels{1, 2, 1, 2, 3, 0}));
}

// Each pair is listed for both of its bodies.
TEST(ContactGraph, ListsThePairsOfEveryBody) {
  const Bodies bodies = loose_bodies(4, {3});
  ContactSet contacts;
  add_pair(contacts, 3, 0, up);
  add_pair(contacts, 0, 1, up);
  add_pair(contacts, 3, 1, up);
  const ContactGraph graph = graph_of(bodies, contacts);
  const auto pairs_of = [&](std::size_t body) {
    std::vector<int> pairs(graph.pair_of_body.begin() + graph.first_pair[body],
                           graph.pair_of_body.begin() + graph.first_pair[body + 1]);
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  };
  EXPECT_EQ(pairs_of(0), (Levels{0, 1}));
  EXPECT_EQ(pairs_of(1), (Levels{1, 2}));
  EXPECT_EQ(pairs_of(2), Levels{});
  EXPECT_EQ(pairs_of(3), (Levels{0, 2}));
}

// Without the effect of rigid contact, rigid pairs are inactive and neither support nor join bodies.
TEST(ContactGraph, WithoutTheEffectRigidPairsAreLeftOut) {
  const Bodies bodies = loose_bodies(3, {2});
  ContactSet contacts;
  add_pair(contacts, 2, 0, up);
  add_pair(contacts, 0, 1, up);
  ContactGraph graph;
  build_contact_graph(bodies, gravity, RigidPairs::are_left_out, contacts, graph);
  EXPECT_TRUE(graph.pairs.empty());
  EXPECT_EQ(graph.schedule.order().size(), 0u);
  EXPECT_EQ(graph.supported, (Flags{0, 0, 1}));
  EXPECT_EQ(graph.island, (Levels{0, 1, 2}));
  for (const ContactPair& pair : contacts.pairs) EXPECT_FALSE(pair.active);
}

}  // namespace
}  // namespace duet::contact_graph_test
