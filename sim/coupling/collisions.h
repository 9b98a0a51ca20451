// Step II.1: collisions, on time-n velocities with re-predicted positions (paper section 4; Guendelman et al.
// 2003).
#pragma once

#include <vector>

#include "sim/coupling/pair_schedule.h"
#include "sim/coupling/sweep_pipeline.h"

namespace duet {

struct CollisionSettings {
  int iterations = 5;  // Gauss-Seidel sweeps over all pairs
  int repeats = 20;    // impulses per rigid pair and sweep
  OrientationUpdate orientation = OrientationUpdate::exact;
  bool rigid_pairs = true;  // effect rigid_collision; without it rigid pairs go straight to contact
};

// Predicted poses x* = x^n + dt (v_*^n + D), kept up to date while impulses change v_*^n.
struct CollisionScratch {
  std::vector<Pose> predicted;
  std::vector<char> stale;
  // How often impulses have changed a body (numbered as in guest_node), and what that count was for both
  // bodies of a pair when a visit of the pair changed nothing.
  std::vector<int> version;
  struct Seen {
    int host = -1, guest = -1;
  };
  std::vector<Seen> seen;
  std::vector<int> pairs;
  PairSchedule schedule;
  SweepPipeline sweeps;
};

// `bodies` holds positions and velocities of time n, `difference` is D = v~^{n+1/2} - v^n. Changes the
// velocities to v_*^n and marks the pairs that were found overlapping, approaching or not, as collided:
// contact later looks at no other rigid pairs, so that elastic bodies bounce before contact stops them.
void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ContactSet& contacts, CollisionScratch& scratch);

}  // namespace duet
