// For each node of a mesh, the elements that contain it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/base/assert.h"

namespace duet {

/// Lists of different lengths in one array: the list of node i is items[first[i]] to items[first[i + 1] - 1].
struct ElementLists {
  std::vector<int> first,  ///< Start of each list in `items`; one entry more than there are nodes.
      items;               ///< The element numbers of all lists, one list after the other.
  /// Returns the numbers of the elements around `node`, in ascending order.
  std::span<const int> of(int node) const {
    const auto i = static_cast<std::size_t>(node);
    DUET_ASSERT(first[i] <= first[i + 1] && static_cast<std::size_t>(first[i + 1]) <= items.size());
    return {items.data() + first[i], items.data() + first[i + 1]};
  }
};

/// Lists the elements around each of `nodes` nodes. nodes_of(element) returns a range of node numbers in [0,
/// nodes). Each list is in the order of `elements`.
template <class Elements, class NodesOf>
ElementLists elements_around(std::size_t nodes, const Elements& elements, NodesOf&& nodes_of) {
  ElementLists lists;
  lists.first.assign(nodes + 1, 0);
  for (const auto& element : elements)
    for (const int i : nodes_of(element)) ++lists.first[static_cast<std::size_t>(i) + 1];
  for (std::size_t i = 0; i < nodes; ++i) lists.first[i + 1] += lists.first[i];
  lists.items.resize(static_cast<std::size_t>(lists.first.back()));
  std::vector<int> next(lists.first.begin(), lists.first.end() - 1);
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const int i : nodes_of(elements[e]))
      lists.items[static_cast<std::size_t>(next[static_cast<std::size_t>(i)]++)] = static_cast<int>(e);
  return lists;
}

/// Lists the elements around each of `nodes` nodes, for elements that are arrays of node numbers.
template <class Elements>
ElementLists elements_around(std::size_t nodes, const Elements& elements) {
  return elements_around(
      nodes, elements, [](const auto& element) -> const auto& { return element; });
}

}  // namespace duet
