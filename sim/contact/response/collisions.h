// Step II.1: collisions, on time-n velocities with re-predicted positions (paper section 4; Guendelman et al.
// 2003). Unlike there, the impulses of all points that meet at once are found together.
#pragma once

#include <vector>

#include "sim/contact/graph/gauss_seidel_pipeline.h"
#include "sim/contact/graph/pair_coloring.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/rigid/orientation_update.h"

namespace duet {

struct CollisionSettings {
  int iterations = 5;  // rounds of blows are at most four times as many
  OrientationUpdate orientation = OrientationUpdate::exact;
  bool rigid_pairs = true;  // effect rigid_collision; without it rigid pairs go straight to contact
};

// Predicted poses x* = x^n + dt (v_*^n + D), kept up to date while impulses change v_*^n.
struct CollisionScratch {
  std::vector<Pose> predicted;
  std::vector<char> stale;
  // How often impulses have changed a body (numbered as in guest_node), and what that count was for both
  // bodies of a pair when a look at the pair found nothing to do.
  std::vector<int> version;
  struct Seen {
    int host = -1, guest = -1;
  };
  std::vector<Seen> seen;
  // Of every contact point: whether it takes part in the blow of this round, its relative velocity (m/s)
  // before the blow, and its impulse (N s) of the rounds before.
  std::vector<char> takes_part;
  std::vector<Vec3> velocity_before, impulse_before;
  std::vector<char> struck;  // whether a pair takes part in the blow
  std::vector<int> blow;     // these pairs
  GaussSeidelPipeline blow_sweeps;
  std::vector<int> parent;  // of every rigid body, in a tree of those that the blow connects
  struct Island {           // of bodies that the blow connects, at its root
    double tolerance = 0;   // m/s, for the change of a relative velocity in the last sweep
    double largest = 0;     // of the last sweep, over the tolerance
    bool is_settled = false;
    double linear = 0, quadratic = 0;  // J, what the blow does to its kinetic energy: Collider::keep_energy
  };
  std::vector<Island> islands;
  std::vector<std::size_t> island;  // of every pair of the blow
  std::vector<double> change;       // of the last visit of every such pair, over the tolerance
  std::vector<int> pairs;
  PairColoring schedule;
  GaussSeidelPipeline sweeps;
};

// `bodies` holds positions and velocities of time n, `difference` is D = v~^{n+1/2} - v^n. Changes the
// velocities to v_*^n and marks the pairs that were found overlapping, approaching or not, as collided:
// contact later looks at no other rigid pairs, so that elastic bodies bounce before contact stops them. What
// closes no faster than forces make it in a step is left to contact.
//
// Rigid bodies meet in rounds. In a round, all points that would overlap at the predicted positions and
// approach form one blow: impulses j >= 0 along the normals after which
//   v_n+ >= -e v_n-,  complementary to j,
// with friction on Coulomb's cone (Moreau's law; without friction it takes (1 - e^2) of the energy that a
// blow with e = 0 takes, so it never gives any). Bodies that this brings together are the next round's: a row
// of balls passes a blow on from one to the next, and a face that lands level leaves level (Smith, Kaufman,
// Vouga, Tamstorf, Grinspun 2012, "Reflections on simultaneous impact").
//
// `linked` (or null) is what prepared the contacts: a blow on a body that joints hold moves all that they
// hold together, as the joints let it. Joints put right after a blow on the body alone would take energy
// away: of a ball of radius r on a rod of length l the fraction 2/5 (r/l)^2.
void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ArticulatedResponse* linked, ContactSet& contacts,
                        CollisionScratch& scratch);

}  // namespace duet
