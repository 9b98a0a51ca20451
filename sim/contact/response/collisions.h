// Step II.1: collisions, on time-n velocities with re-predicted positions (paper section 4; Guendelman et al.
// 2003). Unlike in these, the impulses of all points that meet at once are found together.
#pragma once

#include <limits>
#include <vector>

#include "sim/base/disjoint_sets.h"
#include "sim/contact/graph/gauss_seidel_pipeline.h"
#include "sim/contact/graph/pair_coloring.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/rigid/orientation_update.h"

namespace duet {

/// Settings of process_collisions().
struct CollisionSettings {
  int iterations =
      5;  ///< Rounds of rigid/deformable collisions at most; rigid impacts have four times as many.
  OrientationUpdate orientation = OrientationUpdate::exact;  ///< How predicted orientations are advanced.
  bool rigid_pairs = true;  ///< Effect rigid_collision. If false, rigid pairs go straight to contact.
};

/// Scratch of process_collisions(), kept from step to step so that nothing is allocated.
struct CollisionScratch {
  /// For each rigid body: the predicted pose, x* = x^n + dt (v_*^n + D) for its position.
  std::vector<Pose> predicted;
  /// For each rigid body: the part of D that nothing holds up, m/s, see find_falls().
  std::vector<Vec3> fall;
  std::vector<char> is_held;  ///< For each rigid body: whether it is fixed, or something below holds it up.
  std::vector<int> holding;   ///< Indices of the contacts that may hold a body up.
  std::vector<char> stale;    ///< For each rigid body: whether impulses have changed it since `predicted`.
  std::vector<int> version;   ///< For each body, numbered as by guest_node(): how often impulses changed it.
  /// Versions of the bodies of a pair when the pair was looked at last; -1: never.
  struct Seen {
    int host = -1,   ///< Version of the host.
        guest = -1;  ///< Version of the guest.
  };
  /// For each pair. If both versions are the same as now, a look would find nothing new.
  std::vector<Seen> seen;
  std::vector<char>
      takes_part;  ///< For each contact point: whether it takes part in the impact of this round.
  /// For each contact point that takes part: when it meets, s from the beginning of the step.
  std::vector<double> time;
  /// For each contact point that takes part: whether its impulse acts when it meets, see impact_delay.h.
  std::vector<char> acts_later;
  /// kg m^2/s: what bodies that are not dynamic have given by such impulses, see delayed_moment().
  Vec3 delayed_moment = Vec3::Zero();
  std::vector<Vec3> velocity_before,  ///< For each contact point: relative velocity before the impact, m/s.
      impulse_before;                 ///< For each contact point: its impulse of earlier rounds, N s.
  std::vector<char> is_hit;           ///< For each pair: whether it takes part in the impact.
  std::vector<int> impact;            ///< Indices of the pairs that take part in the impact.
  GaussSeidelPipeline impact_sweeps;  ///< Sweeps over `impact`.
  DisjointSets joined;                ///< The rigid bodies, joined to the impact's islands.
  /// The bodies that an impact connects.
  struct Island {
    double tolerance = 0;  ///< Largest change of a relative velocity in a sweep that ends the sweeps, m/s.
    double largest = 0;    ///< Largest change of a relative velocity in the last sweep, over `tolerance`, 1.
    bool multipliers_final = false;  ///< True if `largest` is below 1, so that sweeps pass over the island.
    /// When the impulses that act later act, s from the beginning of the step.
    double meeting = std::numeric_limits<double>::infinity();
    double linear = 0,  ///< Change of kinetic energy by the impact: linear term in its scale, J.
        quadratic = 0;  ///< Change of kinetic energy by the impact: quadratic term in its scale, J.
  };
  std::vector<Island> islands;      ///< For each rigid body; used at the first body of each island.
  std::vector<std::size_t> island;  ///< For each pair of the impact: index into `islands`.
  /// For each pair of the impact: change by its last visit, over the tolerance, 1.
  std::vector<double> change;
  std::vector<int> pairs;      ///< Indices of all pairs.
  PairColoring schedule;       ///< Order of all pairs.
  GaussSeidelPipeline sweeps;  ///< Sweeps over all pairs.
};

/// Processes the collisions of a step: changes the velocities v^n of `bodies` to v_*^n. `bodies` holds
/// positions and velocities of time n, and `difference` is D = v~^{n+1/2} - v^n. Marks pairs that overlap at
/// predicted positions, approaching or not, as ContactPair::collided: contact later looks at no other rigid
/// pairs, so that elastic bodies bounce before contact stops them. Contacts that close no faster than the
/// forces of one step make them are left to contact. The impulses add up in ContactPoint::impulse.
///
/// Rigid bodies meet in rounds. In a round, those points of each pair that meet first, of all that would
/// overlap at the predicted positions and approach, form one impact: impulses j >= 0 along the normals after
/// which
///   v_n+ >= -e v_n-,  complementary to j,
/// with friction on Coulomb's cone (Moreau's law). Without friction it takes (1 - e^2) of the energy that a
/// impact with e = 0 takes, so that it never adds energy. Bodies that an impact brings together belong to the
/// next round: a row of balls passes an impact on from one to the next, and a face that lands level leaves
/// level (Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012, "Reflections on simultaneous impact").
///
/// Points of deformable bodies collide one after the other (paper section 4). Their restitution is 0, because
/// deformable bodies store and return energy by themselves.
///
/// `linked` is the articulated response that prepared the contacts, or null: an impact on a jointed body
/// moves its whole group as the joints allow. A joint solve after an impact on the body alone would take
/// energy away: for a ball of radius r on a rod of length l the fraction 2/5 (r/l)^2.
void process_collisions(Bodies& bodies, const VelocityState& difference, double dt,
                        const CollisionSettings& settings, ArticulatedResponse* linked, ContactSet& contacts,
                        CollisionScratch& scratch);

}  // namespace duet
