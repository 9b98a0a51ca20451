// Steps III.3 and V.4: contact with friction between rigid and deformable bodies alike.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/contact/response/island_solver.h"

namespace duet {

struct ContactSolveSettings {
  int iterations = 20;             // Gauss-Seidel sweeps, up the graph
  int cold_iterations = 0;         // further ones of islands of which no impulse is known to begin with
  int repeats = 8;                 // of every pair in a sweep
  double tolerance = 1e-6;         // m/s, stop when no sweep changes a relative velocity by more
  bool whole_islands = true;       // solves small islands that the sweeps do not settle, see island_solver.h
  bool angular_friction = false;   // effect rolling_friction
  bool shocks_everywhere = false;  // and not only in islands that carry them
  double fall = std::numeric_limits<double>::infinity();  // m/s, what gravity gives in the step
};

/// What solve_contact works with, kept from step to step so that nothing is allocated.
struct ContactSolveScratch {
  std::vector<double> change;                 // m/s, of every pair: by its last visit
  std::vector<double> island_change;          // m/s, of every island: the largest of its pairs
  std::vector<char> is_settled;               // of every island: no visit changes more than the tolerance
  std::vector<char> is_jointed;               // of every island, where contact knows joints
  std::vector<char> is_solved;                // of every island: as a whole, after the sweeps
  std::vector<std::array<int, 2>> unsettled;  // islands, and places of their pairs in the graph's order
  std::vector<int> island_pairs;              // of one of these islands
  IslandSolver island_solver;
};

// Changes the velocities so that no contact closes faster than its target: v_rel.n >= target, complementary
// to its impulse, with Coulomb friction on the *accumulated* impulse of every contact (so a later sweep can
// take back what an earlier one gave too much). Starts from the impulses the contacts hold, which must have
// been applied already. Islands of a few rigid bodies that the sweeps leave unsettled, and that hardly slide,
// are solved as a whole. Rolling and spinning friction slow the relative rotation of rigid pairs by a moment
// of at most their coefficient (m) times the normal force. Returns the number of sweeps. `linked` is what
// prepared the contacts, or null.
int solve_contact(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                  ContactSet& contacts, ContactSolveScratch& scratch, ArticulatedResponse* linked = nullptr);

// Shock propagation (Guendelman et al. 2003): level by level, what the sweeps left is taken up by the upper
// bodies alone, as if the lower ones were fixed. Only rigid pairs whose lower body is supported take part, so
// that bodies in free flight keep their momentum, and only those of islands that carry shocks. Where the
// surface of a lower body rolls or moves along the normal, faster than by 0.02 settings.fall, it would lead
// the upper one about, as if a light body had any amount of energy: below what rolls, as a slab on a log, it
// acts along the normal alone, and where the lower body moves towards the upper one or away from it not at
// all.
void propagate_shocks(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                      ContactSet& contacts);

int count_active(const ContactSet& contacts, const ContactGraph& graph);  // contacts with an impulse

}  // namespace duet
