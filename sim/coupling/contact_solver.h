// Steps III and V.4: contact with friction between rigid and deformable bodies alike.
#pragma once

#include <vector>

#include "sim/coupling/contact_point.h"

namespace duet {

// The order of contact: distance in bodies from the nearest static one, over pairs that touch. Impulses
// travel upward, away from what stands still.
struct ContactGraph {
  std::vector<int> level;  // of every rigid body, then of every deformable body
  std::vector<int> order;  // indices of the pairs that contact processes, lowest level first
};

// Ranks the bodies and the pairs. Rigid pairs that step II did not find overlapping are left out, all of them
// if `rigid_pairs` is false (effect rigid_contact).
void build_contact_graph(const Bodies& bodies, bool rigid_pairs, ContactSet& contacts, ContactGraph& graph);

struct ContactSolveSettings {
  int iterations = 20;      // Gauss-Seidel sweeps, up the graph
  double tolerance = 1e-6;  // m/s, stop when no sweep changes a relative velocity by more
};

// Changes the velocities so that no contact closes by more than its gap within `dt`: v_rel.n >= -max(gap, 0)
// / dt, complementary to its impulse, with Coulomb friction on the *accumulated* impulse of every contact (so
// a later sweep can take back what an earlier one gave too much). Starts from the impulses the contacts hold,
// which must have been applied already. Returns the number of sweeps.
int solve_contact(Bodies& bodies, const ContactGraph& graph, double dt, const ContactSolveSettings& settings,
                  ContactSet& contacts);

int count_active(const ContactSet& contacts, const ContactGraph& graph);  // contacts with an impulse

}  // namespace duet
