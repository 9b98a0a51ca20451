#include "sim/coupling/pair_schedule.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "tests/support/crowd.h"
#include <gtest/gtest.h>

namespace duet {
namespace {

using test::as_index;
using test::Crowd;
using test::random_crowd;

// The pairs of the waves [first, last).
std::vector<int> pairs_of_waves(const PairSchedule& schedule, int first, int last) {
  std::vector<int> pairs;
  schedule.largest(first, last, [&](int p) {
    pairs.push_back(p);
    return 0.0;
  });
  return pairs;
}

class PairSchedules : public testing::Test {
 protected:
  PairSchedules() { set_thread_count(1); }
  ~PairSchedules() override { set_thread_count(0); }
};

TEST_F(PairSchedules, WavesShareNoMovableBodyAndHoldEveryPairOnce) {
  PairSchedule schedule;  // one for all: nothing of an earlier crowd may stay
  for (unsigned seed = 0; seed < 8; ++seed)
    for (const bool levels_apart : {false, true}) {
      const Crowd crowd = random_crowd(seed, 40 + 50 * static_cast<int>(seed % 3), 200);
      schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, levels_apart);
      std::vector<int> all;
      for (int w = 0; w < schedule.waves(); ++w) {
        std::set<std::size_t> taken;
        const std::vector<int> wave = pairs_of_waves(schedule, w, w + 1);
        EXPECT_FALSE(wave.empty());
        for (const int p : wave)
          for (const std::size_t node : crowd.nodes(p)) EXPECT_TRUE(taken.insert(node).second);
        all.insert(all.end(), wave.begin(), wave.end());
      }
      EXPECT_TRUE(std::equal(all.begin(), all.end(), schedule.order().begin(), schedule.order().end()));
      std::sort(all.begin(), all.end());
      std::vector<int> expected = crowd.pairs;
      std::sort(expected.begin(), expected.end());
      EXPECT_EQ(all, expected);
    }
}

TEST_F(PairSchedules, EveryBodyMeetsItsPairsUpTheLevels) {
  const Crowd crowd = random_crowd(11, 60, 250);
  PairSchedule schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, false);
  std::vector<int> last(crowd.bodies.rigid.size() + crowd.bodies.deformable.size(), 0);
  for (const int p : schedule.order())
    for (const std::size_t node : crowd.nodes(p)) {
      const int level = crowd.contacts.pairs[as_index(p)].level;
      EXPECT_GE(level, last[node]);
      last[node] = level;
    }
}

TEST_F(PairSchedules, LevelsApartAreRangesOfWaves) {
  const Crowd crowd = random_crowd(12, 60, 250);
  PairSchedule schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, true);
  ASSERT_EQ(schedule.levels(), 6);
  EXPECT_EQ(schedule.first_wave(0), 0);
  EXPECT_EQ(schedule.first_wave(6), schedule.waves());
  std::vector<std::size_t> count;
  for (int level = 0; level < 6; ++level) {
    const auto pairs = pairs_of_waves(schedule, schedule.first_wave(level), schedule.first_wave(level + 1));
    for (const int p : pairs) EXPECT_EQ(crowd.contacts.pairs[as_index(p)].level, level);
    count.push_back(pairs.size());
  }
  EXPECT_EQ(count[0], 0u);
  EXPECT_EQ(count[3], 0u);
  EXPECT_EQ(count[1] + count[2] + count[4] + count[5], 250u);
}

TEST_F(PairSchedules, OnlyTheGivenPairsTakePart) {
  Crowd crowd = random_crowd(13, 60, 250);
  crowd.pairs.resize(100);
  PairSchedule schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, false);
  EXPECT_EQ(std::set<int>(schedule.order().begin(), schedule.order().end()),
            std::set<int>(crowd.pairs.begin(), crowd.pairs.end()));
  schedule.build(crowd.bodies, crowd.contacts, {}, true);
  EXPECT_EQ(schedule.order().size(), 0u);
  EXPECT_EQ(schedule.waves(), 0);
}

// Pairs between neighbours of a row, every second one at once; a static body, host or guest, orders nothing:
// bodies on it need one wave, and a row of them three.
TEST_F(PairSchedules, ARowTakesTwoWavesAndAStaticBodyNone) {
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
    PairSchedule schedule;
    schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, false);
    return schedule.waves();
  };
  EXPECT_EQ(waves(row), 2);
  EXPECT_EQ(waves(table), 1);
  EXPECT_EQ(waves(ceiling), 1);
  EXPECT_EQ(waves(row_on_table), 3);
}

// Every pair mixes the numbers of its bodies in a way that depends on which came first. The waves hold some
// hundred pairs, many times what one thread takes at a time.
TEST_F(PairSchedules, GiveTheBitsOfOnePairAfterTheOtherOnAnyNumberOfThreads) {
  const Crowd crowd = random_crowd(14, 3000, 4000);
  PairSchedule schedule;
  schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, false);
  ASSERT_LT(schedule.waves(), 40);
  std::vector<double> expected = crowd.numbers();
  double most = 0;
  for (const int p : schedule.order()) most = std::max(most, crowd.mix(expected, p));
  std::vector<double> reversed = crowd.numbers();
  for (auto p = crowd.pairs.rbegin(); p != crowd.pairs.rend(); ++p) crowd.mix(reversed, *p);
  EXPECT_NE(reversed, expected) << "the operation must depend on the order to tell anything";
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    for (int run = 0; run < 10; ++run) {
      std::vector<double> value = crowd.numbers();
      schedule.for_each([&](int p) { crowd.mix(value, p); });
      EXPECT_EQ(value, expected) << threads << " threads";
      value = crowd.numbers();
      EXPECT_EQ(schedule.largest(0, schedule.waves(), [&](int p) { return crowd.mix(value, p); }), most);
      EXPECT_EQ(value, expected) << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace duet
