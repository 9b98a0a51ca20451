// Many bodies that touch each other at random, to test code that visits their pairs in some order or in
// parallel.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "tests/support/contacts.h"

namespace duet::test {

// Bodies and the pairs between them.
struct Crowd {
  Bodies bodies;        // rigid ones without distinct positions, then deformable ones that share one particle
  ContactSet contacts;  // pairs with one point each
  std::vector<int> pairs;  // places of all pairs in `contacts`, shuffled

  // Returns whether impulses can move the body of a node: rigid bodies come first, deformable ones follow.
  bool movable(std::size_t node) const {
    return node >= bodies.rigid.size() || bodies.rigid.properties[node].is_dynamic();
  }
  // Returns the nodes of the movable bodies of a pair.
  std::vector<std::size_t> nodes(int p) const {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    std::vector<std::size_t> result;
    for (const std::size_t node : {as_index(pair.host), guest_node(bodies, pair)})
      if (movable(node)) result.push_back(node);
    return result;
  }

  // Returns one number for every node, to begin with.
  std::vector<double> numbers() const {
    std::vector<double> value(bodies.rigid.size() + bodies.deformable.size());
    for (std::size_t i = 0; i < value.size(); ++i) value[i] = std::sin(static_cast<double>(i));
    return value;
  }
  // Changes the numbers of the movable bodies of pair `p` by those of both. The result depends on which pairs
  // of these bodies were visited before, so that equal results prove an equivalent order.
  double mix(std::vector<double>& value, int p) const {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const std::size_t a = as_index(pair.host), b = guest_node(bodies, pair);
    const double mean = (value[a] + 1.3 * value[b]) / 2;
    if (movable(a)) value[a] = std::sin(3 * mean + p);
    if (movable(b)) value[b] = std::cos(2 * mean - p);
    return std::abs(mean);
  }
};

// Makes `pair_count` pairs between `body_count` rigid bodies. Bodies 0 to 9 are static and belong to many
// pairs; in a tenth of the pairs, the guest is one of 20 deformable bodies. Pairs have the levels 1, 2, 4 and
// 5: level 3 is empty.
inline Crowd random_crowd(unsigned seed, int body_count, int pair_count) {
  Crowd crowd;
  crowd.bodies = loose_bodies(body_count, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  crowd.bodies.deformable.resize(20);  // they share one particle
  crowd.bodies.particles.x.resize(1, Vec3::Zero());
  std::mt19937 random(seed);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  std::set<std::pair<int, int>> known;
  while (static_cast<int>(crowd.contacts.pairs.size()) < pair_count) {
    const int host = below(3) == 0 ? below(10) : below(body_count), guest = 10 + below(body_count - 10);
    if (host == guest || !known.insert(std::minmax(host, guest)).second) continue;
    ContactPair& pair = add_pair(crowd.contacts, host, guest, Vec3::UnitY());
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

}  // namespace duet::test
