#include "sim/base/disjoint_sets.h"

#include <random>

#include <gtest/gtest.h>

namespace duet::disjoint_sets_test {

TEST(DisjointSets, AreKnownByTheirSmallestMember) {
  DisjointSets sets(6);
  EXPECT_EQ(sets.size(), 6U);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(sets.first(i), i);
  EXPECT_TRUE(sets.join(5, 3));
  EXPECT_TRUE(sets.join(3, 4));
  EXPECT_FALSE(sets.join(4, 5));
  EXPECT_TRUE(sets.join(1, 5));
  const int expected[] = {0, 1, 2, 1, 1, 1};
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(sets.first(i), expected[i]) << i;
    EXPECT_EQ(std::as_const(sets).first(i), expected[i]) << i;
  }
  sets.reset(3);
  EXPECT_EQ(sets.size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sets.first(i), i);
}

// Random graphs of 200 nodes, against labels that spread along the edges until nothing changes.
TEST(DisjointSets, AreTheConnectedPartsOfAnyGraphInAnyOrder) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    constexpr int nodes = 200;
    std::minstd_rand random(seed + 1);
    std::vector<std::pair<int, int>> edges;
    for (unsigned e = 0; e < seed * 5; ++e)
      edges.emplace_back(static_cast<int>(random() % nodes), static_cast<int>(random() % nodes));

    std::vector<int> label(nodes);
    std::iota(label.begin(), label.end(), 0);
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [a, b] : edges) {
        const int least = std::min(label[as_index(a)], label[as_index(b)]);
        changed |= label[as_index(a)] != least || label[as_index(b)] != least;
        label[as_index(a)] = label[as_index(b)] = least;
      }
    }

    DisjointSets forward(nodes), backward(nodes);
    int joins = 0;
    for (const auto& [a, b] : edges) joins += forward.join(a, b) ? 1 : 0;
    for (auto e = edges.rbegin(); e != edges.rend(); ++e) backward.join(e->second, e->first);
    int parts = 0;
    for (int i = 0; i < nodes; ++i) {
      EXPECT_EQ(std::as_const(forward).first(i), label[as_index(i)]) << "seed " << seed;
      EXPECT_EQ(backward.first(i), label[as_index(i)]) << "seed " << seed;
      parts += label[as_index(i)] == i ? 1 : 0;
    }
    EXPECT_EQ(parts, nodes - joins) << "seed " << seed;
  }
}

}  // namespace duet::disjoint_sets_test
