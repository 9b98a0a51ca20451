#include "sim/contact/graph/shock_layers.h"

#include <algorithm>
#include <mutex>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

namespace duet::shock_layers_test {
namespace {

using Groups = std::vector<std::vector<int>>;

// Returns the groups in the order in which one thread solves them.
Groups groups_of(const ShockLayers& levels) {
  set_thread_count(1);
  Groups groups;
  levels.for_each([&](std::span<const int> pairs) { groups.emplace_back(pairs.begin(), pairs.end()); });
  set_thread_count(0);
  return groups;
}

// Body 0 carries 1 and 2. These two carry 3 together, 4 and 5 carry each other on 2, and 6 rests on 7, which
// is in free flight.
struct Pile {
  ContactSet contacts;
  std::vector<int> level{0, 1, 1, 2, 2, 2, 2, 1};
  std::vector<char> supported{1, 1, 1, 1, 1, 1, 0, 0};

  Pile() {
    for (const auto& [host, guest] :
         {std::pair(3, 2), {0, 1}, {0, 2}, {1, 3}, {5, 4}, {6, 7}, {2, 4}, {2, 5}})
      test::add_pair(contacts, host, guest, Vec3::UnitY());
  }
  ShockLayers groups(const std::vector<int>& pairs) const {
    ShockLayers result;
    result.build(contacts, pairs, level, supported);
    return result;
  }
};

// Groups are the pairs of one upper body, or of upper bodies that carry each other; the pair on the flying
// body 7 is in no group.
TEST(ShockLayers, GroupPairsByTheirUpperBodies) {
  const Pile pile;
  EXPECT_EQ(groups_of(pile.groups({0, 1, 2, 3, 4, 5, 6, 7})), (Groups{{1}, {2}, {0, 3}, {4, 6, 7}}));
}

// Within a group the pairs keep their given order, which decides the bits of the result.
TEST(ShockLayers, KeepTheOrderOfTheGivenPairs) {
  const Pile pile;
  EXPECT_EQ(groups_of(pile.groups({7, 3, 2, 0, 4, 1, 6})), (Groups{{1}, {2}, {3, 0}, {7, 4, 6}}));
  EXPECT_EQ(groups_of(pile.groups({5})), Groups{});
  EXPECT_EQ(groups_of(pile.groups({})), Groups{});
}

// Pairs with deformable bodies are in no group.
TEST(ShockLayers, LeaveOutDeformableBodies) {
  Pile pile;
  pile.contacts.pairs[1].guest_deformable = 0;
  pile.contacts.pairs[1].guest_rigid = -1;
  EXPECT_EQ(groups_of(pile.groups({1, 2})), (Groups{{2}}));
}

// Forty towers of five boxes: on any number of threads, no level begins before all groups of the level below
// have ended.
TEST(ShockLayers, AreSolvedLevelAfterLevelOnAnyNumberOfThreads) {
  constexpr int towers = 40, height = 5;
  ContactSet contacts;
  std::vector<int> level{0}, pairs;
  for (int tower = 0; tower < towers; ++tower)
    for (int i = 1; i <= height; ++i) {
      const int body = static_cast<int>(level.size());
      pairs.push_back(static_cast<int>(pairs.size()));
      test::add_pair(contacts, i == 1 ? 0 : body - 1, body, Vec3::UnitY());
      level.push_back(i);
    }
  ShockLayers groups;
  groups.build(contacts, pairs, level, std::vector<char>(level.size(), 1));
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::mutex mutex;
    std::vector<int> levels;
    groups.for_each([&](std::span<const int> group) {
      const std::lock_guard lock(mutex);
      for (const int p : group) levels.push_back(level[as_index(contacts.pairs[as_index(p)].guest_rigid)]);
    });
    EXPECT_EQ(levels.size(), pairs.size());
    EXPECT_TRUE(std::is_sorted(levels.begin(), levels.end()));
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace duet::shock_layers_test
