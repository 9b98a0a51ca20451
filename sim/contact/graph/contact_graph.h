// Step III.1: which bodies rest on which (paper section 5; Guendelman, Bridson, Fedkiw 2003).
#pragma once

#include <vector>

#include "sim/contact/graph/gauss_seidel_pipeline.h"
#include "sim/contact/graph/pair_coloring.h"
#include "sim/contact/graph/shock_layers.h"

namespace duet {

// Bodies are numbered as in guest_node: rigid ones first, then deformable ones. A body is supported by those
// that it touches from above, against gravity. Static and kinematic bodies have level 0; another body's level
// is one more than the highest that supports it, and bodies that support each other in a circle (a strongly
// connected component of the graph) share theirs.
struct ContactGraph {
  std::vector<int> level;       // of every body
  std::vector<char> supported;  // whether its supports lead down to a static or kinematic body
  std::vector<int> island;      // of every movable body: the first body of those it is connected with
  // Of every island, by its first body: 1 if all that it is made of are rigid bodies by themselves, as shocks
  // would take apart what joints or flesh hold together; 2 if a kinematic body that moves touches them.
  std::vector<char> carries_shocks;
  PairColoring schedule;       // the pairs that contact processes, up the graph
  GaussSeidelPipeline sweeps;  // over the pairs in the order of `schedule`
  ShockLayers by_level;        // those that rest on something, level by level; see separate_levels
  bool levels_apart = false;   // by_level is up to date

  std::vector<int> pairs;       // indices of the pairs that take part
  std::vector<int> first_pair;  // pairs of rigid body b: pair_of_body[first_pair[b], first_pair[b + 1])
  std::vector<int> pair_of_body;

  // The island of a pair's movable bodies.
  int island_of(const Bodies& bodies, const ContactPair& pair) const;

  // Scratch: the graph's edges from a body to its supports, and Tarjan's search; sums of every island.
  std::vector<int> first_support, support, above, below;
  std::vector<int> number, lowest, next, path, component;
  std::vector<char> open;
  std::vector<double> power_before, power_after;
};

// Ranks the bodies and the pairs for `gravity` (m/s^2). Without `rigid_pairs` (effect rigid_contact) rigid
// pairs are left out.
void build_contact_graph(const Bodies& bodies, const Vec3& gravity, bool rigid_pairs, ContactSet& contacts,
                         ContactGraph& graph);
// Fills `by_level` of a graph that is otherwise built, once.
void separate_levels(const ContactSet& contacts, ContactGraph& graph);

}  // namespace duet
