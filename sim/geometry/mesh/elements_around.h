// For each node of a mesh the elements that contain it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace duet {

// Lists of different lengths in one array: those of node i are items[first[i]] to items[first[i + 1]].
struct ElementLists {
  std::vector<int> first, items;
  std::span<const int> of(int node) const {
    const auto i = static_cast<std::size_t>(node);
    return {items.data() + first[i], items.data() + first[i + 1]};
  }
};

// In their order; nodes_of(element) is an array of nodes below `nodes`.
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

// Of elements that are arrays of nodes.
template <class Elements>
ElementLists elements_around(std::size_t nodes, const Elements& elements) {
  return elements_around(
      nodes, elements, [](const auto& element) -> const auto& { return element; });
}

}  // namespace duet
