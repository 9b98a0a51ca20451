#include "sim/contact/graph/pair_coloring.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "tests/support/crowd.h"
#include <gtest/gtest.h>

namespace duet::pair_coloring_test {
namespace {

using test::Crowd;
using test::random_crowd;

// The number of waves is the length of the longest chain of pairs each of which shares a movable body with
// the one before.
TEST(PairColoring, HoldsEveryPairOnceInTheCountedWaves) {
  PairColoring schedule;  // one object for all seeds: nothing of an earlier crowd may stay
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Crowd crowd = random_crowd(seed, 40 + 50 * static_cast<int>(seed % 3), 200);
    schedule.build(crowd.bodies, crowd.contacts, crowd.pairs);
    std::vector<int> all(schedule.order().begin(), schedule.order().end());
    std::vector<int> wave(crowd.bodies.rigid.size() + crowd.bodies.deformable.size(), 0);
    int last = 0;
    for (const int p : all) {
      int here = 0;
      for (const std::size_t node : crowd.nodes(p)) here = std::max(here, wave[node]);
      EXPECT_GE(here + 1, last) << "wave after wave";
      last = here + 1;
      for (const std::size_t node : crowd.nodes(p)) wave[node] = last;
    }
    EXPECT_EQ(schedule.waves(), last);
    std::sort(all.begin(), all.end());
    std::vector<int> expected = crowd.pairs;
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(all, expected);
  }
}

// Each body sees its pairs in the order of their levels, as shock propagation needs it.
TEST(PairColoring, EveryBodyMeetsItsPairsUpTheLevels) {
  const Crowd crowd = random_crowd(11, 60, 250);
  PairColoring schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs);
  std::vector<int> last(crowd.bodies.rigid.size() + crowd.bodies.deformable.size(), 0);
  for (const int p : schedule.order())
    for (const std::size_t node : crowd.nodes(p)) {
      const int level = crowd.contacts.pairs[as_index(p)].level;
      EXPECT_GE(level, last[node]);
      last[node] = level;
    }
}

// The order contains the given pairs and no others, and is empty without pairs.
TEST(PairColoring, OnlyTheGivenPairsTakePart) {
  Crowd crowd = random_crowd(13, 60, 250);
  crowd.pairs.resize(100);
  PairColoring schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs);
  EXPECT_EQ(std::set<int>(schedule.order().begin(), schedule.order().end()),
            std::set<int>(crowd.pairs.begin(), crowd.pairs.end()));
  schedule.build(crowd.bodies, crowd.contacts, {});
  EXPECT_EQ(schedule.order().size(), 0u);
  EXPECT_EQ(schedule.waves(), 0);
}

// Pairs between neighbors of a row take two waves, every second pair at a time. A static body, as host or
// guest, is not movable and orders nothing: bodies on it take one wave, and a row of them three.
TEST(PairColoring, ARowTakesTwoWavesAndAStaticBodyNone) {
  Crowd row, table, ceiling, row_on_table;
  row.bodies = test::loose_bodies(101);
  table.bodies = ceiling.bodies = row_on_table.bodies = test::loose_bodies(101, {0});
  for (int i = 1; i <= 100; ++i) {
    test::add_pair(row.contacts, i - 1, i, Vec3::UnitX());
    test::add_pair(table.contacts, 0, i, Vec3::UnitY());
    test::add_pair(ceiling.contacts, i, 0, Vec3::UnitY());
    test::add_pair(row_on_table.contacts, 0, i, Vec3::UnitY());
  }
  for (int i = 1; i < 100; ++i) test::add_pair(row_on_table.contacts, i, i + 1, Vec3::UnitX());
  const auto waves = [](Crowd& crowd) {
    crowd.pairs.resize(crowd.contacts.pairs.size());
    std::iota(crowd.pairs.begin(), crowd.pairs.end(), 0);
    PairColoring schedule;
    schedule.build(crowd.bodies, crowd.contacts, crowd.pairs);
    return schedule.waves();
  };
  EXPECT_EQ(waves(row), 2);
  EXPECT_EQ(waves(table), 1);
  EXPECT_EQ(waves(ceiling), 1);
  EXPECT_EQ(waves(row_on_table), 3);
}

}  // namespace
}  // namespace duet::pair_coloring_test
