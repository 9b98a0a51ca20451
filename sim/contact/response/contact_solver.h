// Steps III.3 and V.4: contact with friction between rigid and deformable bodies alike.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/contact/response/island_solver.h"

namespace duet {

/// Settings of solve_contact() and propagate_shocks().
struct ContactSolveSettings {
  int iterations = 20;  ///< Gauss-Seidel sweeps at most, from low to high levels of the contact graph.
  int jointed_iterations = 20;  ///< The same for islands in which a joint holds a body.
  int cold_iterations = 0;  ///< Further sweeps of islands without a cached impulse, see ContactSet::is_cold.
  int repeats = 8;          ///< Passes over the contacts of a pair at each visit, at most.
  double tolerance = 1e-6;  ///< Change of a relative velocity below which an island has converged, m/s.
  bool whole_islands = true;  ///< True if IslandSolver takes over small islands that sweeps leave unsettled.
  bool angular_friction = false;   ///< Effect rolling_friction: rolling and spinning friction of rigid pairs.
  bool shocks_everywhere = false;  ///< True if shocks act in all islands, see ContactGraph::carries_shocks.
  /// The velocity that gravity gives in the step, |g| dt, m/s: the scale for what counts as being at rest.
  double fall = std::numeric_limits<double>::infinity();
};

/// Scratch of solve_contact(), kept from step to step so that nothing is allocated. Islands are those of
/// ContactGraph.
struct ContactSolveScratch {
  std::vector<double> change;  ///< For each pair: change of a relative velocity by its last visit, m/s.
  std::vector<double> island_change;    ///< For each island: the largest `change` of its pairs, m/s.
  std::vector<char> multipliers_final;  ///< For each island: whether sweeps pass over it.
  std::vector<char> is_solved;  ///< For each island: whether it was solved as a whole after the sweeps.
  /// Unsettled islands, and the places of their pairs in ContactGraph::pairs; sorted.
  std::vector<std::array<int, 2>> unsettled;
  std::vector<int> island_pairs;  ///< Pair indices of one unsettled island.
  IslandSolver island_solver;     ///< Solver of whole islands.
};

/// Solves for contact with friction: changes the velocities so that v_rel.n >= target, complementary to the
/// impulse, at every contact of active pairs. Coulomb friction acts on the *accumulated* impulse of every
/// contact, so that a later sweep can take back what an earlier one gave too much. Starts from the impulses
/// that the contacts hold, which the velocities must contain already. Islands of a few rigid bodies that the
/// sweeps leave unsettled, and that hardly slide, are solved as a whole. Rolling and spinning friction slow
/// the relative rotation of rigid pairs by a moment of at most their coefficient (m) times the normal force.
/// `linked` is the articulated response that prepared the contacts, or null. Returns the number of sweeps;
/// contacts may still be off after the last one.
int solve_contact(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                  ContactSet& contacts, ContactSolveScratch& scratch, ArticulatedResponse* linked = nullptr);

/// Propagates shocks (Guendelman et al. 2003): level by level, the upper bodies alone take up what the sweeps
/// left, as if the lower ones were fixed. Only rigid pairs whose lower body is supported take part, so that
/// bodies in free flight keep their momentum, and only in islands that carry shocks.
/// ContactGraph::shock_layers must be up to date.
///
/// A lower body whose surface moves would lead the upper one as if it had unlimited energy. Unless a
/// kinematic body drives the island, the pass is therefore limited: if the surface of the lower body rolls
/// faster than 0.02 settings.fall, as a log below a slab, shocks act along the normal alone, and if it moves
/// along the normal faster than that, they do not act.
void propagate_shocks(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                      ContactSet& contacts);

/// Returns the number of contacts in the graph that hold an impulse.
int count_active(const ContactSet& contacts, const ContactGraph& graph);

}  // namespace duet
