// The order in which Gauss-Seidel sweeps visit pairs of bodies, and the numbering of bodies that it uses.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Pair coloring: an order of pairs, from low to high levels of the contact graph, in which neighbors share
/// no movable body as far as possible. Such neighbors can be visited at the same time, with the same bits as
/// one after the other.
class PairColoring {
 public:
  /// Orders `pairs` (indices into contacts.pairs). The order is first by ContactPair::level, within a level
  /// by a greedy coloring that keeps chains of dependent pairs short. Then pairs are gathered into waves: the
  /// pairs of a wave share no movable body, and each belongs to the first wave after all earlier pairs of its
  /// bodies.
  void build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs);

  /// Returns the ordered pair indices, wave after wave.
  std::span<const int> order() const { return order_; }
  /// Returns the number of waves.
  int waves() const { return waves_; }

 private:
  void sort_by_level_and_color(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs);

  std::vector<int> order_;  // pair indices, wave after wave
  int waves_ = 0;
  std::vector<std::uint64_t> used_;        // for each body: bit set of the colors of its pairs
  std::vector<int> last_;                  // for each body: the last wave so far that has a pair of it
  std::vector<int> key_, sorted_, begin_;  // scratch of the sorts
};

/// Returns the number of a pair's guest among all bodies: rigid ones first, then deformable ones.
inline std::size_t guest_node(const Bodies& bodies, const ContactPair& pair) {
  return pair.guest_rigid >= 0 ? static_cast<std::size_t>(pair.guest_rigid)
                               : bodies.rigid.size() + static_cast<std::size_t>(pair.guest_deformable);
}

/// Returns the numbers of the two bodies that a visit of a pair moves, the host first. A body of a jointed
/// group is replaced by the first member, because articulated response moves the whole group.
inline std::array<std::size_t, 2> moved_nodes(const Bodies& bodies, const ContactPair& pair) {
  const auto node = [&](std::size_t body) {
    return body < bodies.linked.size() && bodies.linked[body] >= 0
               ? static_cast<std::size_t>(bodies.linked[body])
               : body;
  };
  return {node(static_cast<std::size_t>(pair.host)), node(guest_node(bodies, pair))};
}

}  // namespace duet
