// The order in which Gauss-Seidel sweeps visit pairs of bodies.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/contact/detection/contact_point.h"

namespace duet {

// An order up the levels in which pairs that follow each other share no movable body, as far as that can be:
// several of them can be visited at the same time, with the same bits as one after the other.
class PairColoring {
 public:
  // Orders `pairs` (indices of contacts.pairs) by level, lowest first, and within a level by a coloring of
  // their bodies that keeps the chains of dependent pairs short; then by waves, of which each holds what may
  // follow the waves before it.
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs);

  std::span<const int> order() const { return order_; }
  int waves() const { return waves_; }

 private:
  void sort_by_level_and_color(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs);

  std::vector<int> order_;  // pair indices, wave after wave
  int waves_ = 0;
  std::vector<std::uint64_t> used_;        // colors taken, of every body
  std::vector<int> last_;                  // last wave of every body
  std::vector<int> key_, sorted_, begin_;  // scratch of the sorts
};

// Index of a pair's guest among all bodies: rigid ones first, then deformable ones.
inline std::size_t guest_node(const Bodies& bodies, const ContactPair& pair) {
  return pair.guest_rigid >= 0 ? static_cast<std::size_t>(pair.guest_rigid)
                               : bodies.rigid.size() + static_cast<std::size_t>(pair.guest_deformable);
}

// The bodies that a visit of a pair moves, its host's first, each standing for those that are linked with it.
inline std::array<std::size_t, 2> moved_nodes(const Bodies& bodies, const ContactPair& pair) {
  const auto node = [&](std::size_t body) {
    return body < bodies.linked.size() && bodies.linked[body] >= 0
               ? static_cast<std::size_t>(bodies.linked[body])
               : body;
  };
  return {node(static_cast<std::size_t>(pair.host)), node(guest_node(bodies, pair))};
}

}  // namespace duet
