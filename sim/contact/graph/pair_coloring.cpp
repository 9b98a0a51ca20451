#include "sim/contact/graph/pair_coloring.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace duet {
namespace {

// Sorts `items` by their keys in [0, keys), stably. On return `begin[k]` is the first position of key k in
// `sorted`, and its last entry is the number of items.
void counting_sort(std::span<const int> items, const std::vector<int>& key, int keys, std::vector<int>& begin,
                   std::vector<int>& sorted) {
  begin.assign(as_index(keys) + 1, 0);
  for (std::size_t i = 0; i < items.size(); ++i) ++begin[as_index(key[i]) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  sorted.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) sorted[as_index(begin[as_index(key[i])]++)] = items[i];
  std::rotate(begin.begin(), begin.end() - 1, begin.end());
  begin[0] = 0;
}

}  // namespace

void PairColoring::build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs) {
  const std::size_t rigid = bodies.rigid.size();
  const auto movable = [&](std::size_t node) {
    return node >= rigid || bodies.rigid.properties[node].is_dynamic();
  };
  sort_by_level_and_color(bodies, contacts, pairs);

  // A pair goes into the first wave after all earlier pairs of its movable bodies.
  last_.assign(used_.size(), -1);
  waves_ = 0;
  for (std::size_t i = 0; i < sorted_.size(); ++i) {
    const ContactPair& pair = contacts.pairs[as_index(sorted_[i])];
    const auto [a, b] = moved_nodes(bodies, pair);
    int wave = 0;
    if (movable(a)) wave = std::max(wave, last_[a] + 1);
    if (movable(b)) wave = std::max(wave, last_[b] + 1);
    last_[a] = last_[b] = key_[i] = wave;
    waves_ = std::max(waves_, wave + 1);
  }
  counting_sort(sorted_, key_, waves_, begin_, order_);
}

void PairColoring::sort_by_level_and_color(const Bodies& bodies, const ContactSet& contacts,
                                           std::span<const int> pairs) {
  constexpr int colors = 64;
  const std::size_t rigid = bodies.rigid.size();
  const auto taken = [&](std::size_t node) {
    const bool shared = node < rigid && !bodies.rigid.properties[node].is_dynamic();
    return shared ? std::uint64_t{0} : used_[node];
  };
  used_.assign(rigid + bodies.deformable.size(), 0);
  key_.resize(pairs.size());
  int keys = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = contacts.pairs[as_index(pairs[i])];
    const auto [a, b] = moved_nodes(bodies, pair);
    const int color = std::min(std::countr_one(taken(a) | taken(b)), colors - 1);
    used_[a] |= std::uint64_t{1} << color;
    used_[b] |= std::uint64_t{1} << color;
    key_[i] = pair.level * colors + color;
    keys = std::max(keys, key_[i] + 1);
  }
  counting_sort(pairs, key_, keys, begin_, sorted_);
}

}  // namespace duet
