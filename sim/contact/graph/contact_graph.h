// Step III.1: the contact graph, which says which bodies rest on which (paper section 5; Guendelman, Bridson,
// Fedkiw 2003), with the orders and schedules of contact that follow from it.
#pragma once

#include <vector>

#include "sim/base/disjoint_sets.h"
#include "sim/contact/graph/gauss_seidel_pipeline.h"
#include "sim/contact/graph/pair_coloring.h"
#include "sim/contact/graph/shock_layers.h"

namespace duet {

/// The contact graph. Bodies are numbered as by guest_node(): rigid ones first, then deformable ones. A body
/// is supported by the bodies that it touches from above, against gravity. Static and kinematic bodies have
/// level 0. The level of another body is one more than that of its highest support, and the bodies of a
/// strongly connected component, which support each other in a circle, share one level.
struct ContactGraph {
  std::vector<int> level;       ///< For each body: its level.
  std::vector<char> supported;  ///< For each body: 1 if it, or one that it rests on, is static or kinematic.
  /// For each body: its contact island, named by the lowest number among its bodies. Static and kinematic
  /// bodies are alone in theirs.
  std::vector<int> island;
  DisjointSets joined;  ///< Scratch: the bodies, joined by the pairs that touch.
  /// For each island, indexed by its name: whether shock propagation acts on it. 0: no, because joints, flesh
  /// or deformable bodies belong to it, which shocks would take apart; 1: yes, all bodies are rigid and
  /// separate; 2: yes, and a moving kinematic body touches one of them.
  std::vector<char> carries_shocks;
  /// For each island: whether a joint holds one of its dynamic bodies, or a bone of its flesh.
  std::vector<char> is_jointed;
  std::vector<char> has_joint;  ///< For each rigid body: whether it is dynamic and has a joint.
  PairColoring schedule;        ///< The order in which sweeps visit the pairs, from low to high levels.
  GaussSeidelPipeline sweeps;   ///< Parallel sweeps over the pairs in the order of `schedule`.
  ShockLayers shock_layers;  ///< Pairs with a supported lower body, level by level; see build_shock_layers().
  bool shock_layers_current = false;  ///< True if `shock_layers` is up to date.

  std::vector<int> pairs;       ///< Indices into ContactSet::pairs of the pairs that take part.
  std::vector<int> first_pair;  ///< Pairs of rigid body b: pair_of_body[first_pair[b] ... first_pair[b + 1]).
  std::vector<int> pair_of_body;  ///< Pair indices of all rigid bodies, body after body.

  /// Returns the island of a pair: that of its host, or of its guest if the host is static or kinematic.
  int island_of(const Bodies& bodies, const ContactPair& pair) const;

  std::vector<int> first_support,  ///< Scratch: supports of body b are support[first_support[b] ...).
      support,                     ///< Scratch: supporting bodies, body after body.
      above,                       ///< Scratch: upper body of each edge of the graph.
      below;                       ///< Scratch: lower body of each edge of the graph.
  std::vector<int> number,         ///< Scratch of Tarjan's search: order of discovery of each body; -1: none.
      lowest,                      ///< Scratch of Tarjan's search: lowest number that each body reaches.
      next,                        ///< Scratch of Tarjan's search: next support of each body to look at.
      path,                        ///< Scratch of Tarjan's search: bodies from the root to the present one.
      component;                   ///< Scratch of Tarjan's search: stack of bodies without a component yet.
  std::vector<char> open;          ///< Scratch of Tarjan's search: whether each body is on `component`.
  /// Scratch of the warm start, for each island: product of the impulses with the velocities before them, J.
  std::vector<double> power_before,
      power_after;  ///< Scratch of the warm start, for each island: the product with the velocities after
                    ///< them, J.
};

/// What a contact graph does with pairs of two rigid bodies.
enum class RigidPairs {
  are_active,   ///< They are contacts as all others: the effect rigid_contact.
  are_left_out  ///< They are no part of the graph.
};

/// Builds the graph of `contacts` for `gravity` (m/s^2). Without gravity no body supports another, and all
/// have level 1. Sets ContactPair::active and ContactPair::level of every pair. Pairs of two
/// rigid bodies that are left out are inactive. Everything but `shock_layers` is
/// filled.
void build_contact_graph(const Bodies& bodies, const Vec3& gravity, RigidPairs rigid_pairs,
                         ContactSet& contacts, ContactGraph& graph);
/// Fills `shock_layers` of a graph that build_contact_graph() has built. Does nothing if it is up to date.
void build_shock_layers(const ContactSet& contacts, ContactGraph& graph);

}  // namespace duet
