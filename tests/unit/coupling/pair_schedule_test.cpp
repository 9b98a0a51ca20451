#include "sim/coupling/pair_schedule.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

namespace duet {
namespace {

using test::as_index;

struct Crowd {
  Bodies bodies;
  ContactSet contacts;
  std::vector<int> pairs;  // all of them

  bool movable(std::size_t node) const {
    return node >= bodies.rigid.size() || bodies.rigid.properties[node].is_dynamic();
  }
  // The movable bodies of a pair.
  std::vector<std::size_t> nodes(int p) const {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    std::vector<std::size_t> result;
    for (const std::size_t node : {as_index(pair.host), guest_node(bodies, pair)})
      if (movable(node)) result.push_back(node);
    return result;
  }
};

// Rigid bodies 0 to 9 are static and in many pairs; some guests are deformable. Level 3 is empty.
Crowd random_crowd(unsigned seed, int body_count, int pair_count) {
  Crowd crowd;
  crowd.bodies = test::loose_bodies(body_count, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  crowd.bodies.deformable.resize(20);
  std::mt19937 random(seed);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  std::set<std::pair<int, int>> known;
  while (static_cast<int>(crowd.contacts.pairs.size()) < pair_count) {
    const int host = below(3) == 0 ? below(10) : below(body_count), guest = 10 + below(body_count - 10);
    if (host == guest || !known.insert(std::minmax(host, guest)).second) continue;
    ContactPair& pair = test::add_pair(crowd.contacts, host, guest, Vec3::UnitY());
    if (below(10) == 0) {
      pair.guest_rigid = -1;
      pair.guest_deformable = guest % 20;
    }
    pair.level = std::vector<int>{1, 2, 4, 5}[as_index(below(4))];
    crowd.pairs.push_back(static_cast<int>(crowd.pairs.size()));
  }
  std::shuffle(crowd.pairs.begin(), crowd.pairs.end(), random);
  return crowd;
}

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
  const auto start = [&] {
    std::vector<double> value(crowd.bodies.rigid.size() + crowd.bodies.deformable.size());
    for (std::size_t i = 0; i < value.size(); ++i) value[i] = std::sin(static_cast<double>(i));
    return value;
  };
  const auto mix = [&](std::vector<double>& value, int p) {
    const ContactPair& pair = crowd.contacts.pairs[as_index(p)];
    const std::size_t a = as_index(pair.host), b = guest_node(crowd.bodies, pair);
    const double mean = (value[a] + 1.3 * value[b]) / 2;
    if (crowd.movable(a)) value[a] = std::sin(3 * mean + p);
    if (crowd.movable(b)) value[b] = std::cos(2 * mean - p);
    return std::abs(mean);
  };
  std::vector<double> expected = start();
  double most = 0;
  for (const int p : schedule.order()) most = std::max(most, mix(expected, p));
  std::vector<double> reversed = start();
  for (auto p = crowd.pairs.rbegin(); p != crowd.pairs.rend(); ++p) mix(reversed, *p);
  EXPECT_NE(reversed, expected) << "the operation must depend on the order to tell anything";
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    for (int run = 0; run < 10; ++run) {
      std::vector<double> value = start();
      schedule.for_each([&](int p) { mix(value, p); });
      EXPECT_EQ(value, expected) << threads << " threads";
      value = start();
      EXPECT_EQ(schedule.largest(0, schedule.waves(), [&](int p) { return mix(value, p); }), most);
      EXPECT_EQ(value, expected) << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace duet
