// Contacts inside a velocity solve: their impulses are unknowns of it, together with the velocities.
#pragma once

#include <array>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/contact_projection.h"
#include "sim/state/islands.h"

namespace duet {

// The impulse of a contact is a function of its relative velocity v (m/s), by the method of multipliers
// (Hestenes 1969; Rockafellar 1973), for the normal n, the least normal velocity w that is asked for, the
// multiplier l (N s) and stiffnesses k (kg):
//   normal    max(0, l_n + k_n (w - n.v))
//   friction  l_t - k_t v_t, cut off at the bound of Coulomb's law
// Both are gradients of convex functions of v, so that a velocity solve with them is one for the least of a
// potential. With k infinitely large, or with multipliers that are the impulses, a contact never closes
// faster than asked, pushes only where it does not part, and slides only at the bound of its friction. That
// bound is the one for the normal impulse at the last set_bounds().
class ContactForces {
 public:
  // Takes the contacts of the active pairs of `graph` on the islands of `islands` that are searched, at the
  // geometry and the targets they hold. Their impulses are the multipliers, `factor` times. `own` holds the
  // inverses of the particles' own blocks of the solve, 1/kg. Stiffnesses are a hundred times the mass that a
  // contact moves, so that where its multiplier is unknown it closes by no more than a hundredth of the
  // velocity that it takes up.
  void build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph,
             const Islands& islands, double factor, const std::vector<SymmetricBlock>& own);
  // Adds the pairs of deformable surfaces on those islands. `seconds` are those in which the pairs may come
  // as near as their thickness h: less than that apart, they part by `part_share` of what they lack in that
  // time. The impulses of a pair act at its two points; by a turn of its particles as one they keep angular
  // momentum.
  void add_pairs(const Bodies& bodies, const std::vector<RepulsionPair>& pairs, const Islands& islands,
                 double seconds, double part_share, double factor, const std::vector<SymmetricBlock>& own);
  // The impulses of pairs, for solves in which the same pairs take part: step V begins with those of step
  // III.
  void forget_pairs() { remembered_.clear(); }
  void remember_pairs();
  void clear() {
    rows_.clear();
    out_of_reach_.clear();
  }
  bool empty() const { return rows_.empty(); }

  // Finds the impulses at `velocity`, and how they change. Returns their potential, J.
  double evaluate(const GeneralizedVelocity& velocity);
  // The bounds of friction from the normal impulses of the last evaluate().
  void set_bounds();
  // The same where a search begins, but for pairs of surfaces: they come in such numbers that where their
  // impulses are unknown each would at first give what all together are to. Theirs are those of the
  // multipliers.
  void begin_bounds();
  // Sliding friction keeps its size, so that it falls with the velocity only across its direction. A search
  // that goes by that overshoots where bodies come to a stop. If careful, it takes friction to fall in all
  // directions: no less than it ever does along the way, whatever the velocity becomes.
  void set_careful(bool careful) { is_careful_ = careful; }
  // out += factor M^-1 of the impulses.
  void add_velocities(double factor, GeneralizedVelocity& out) const;
  // The same of those impulses that store() gives to contacts.
  void add_stored_velocities(double factor, GeneralizedVelocity& out) const;
  // What held particles give to others by the impulses of pairs of surfaces, about the origin.
  Momentum impulse_of_pins(const Particles& particles) const;
  // out += M^-1 of what the impulses lose with `change` of the velocity.
  void add_differentials(const GeneralizedVelocity& change, GeneralizedVelocity& out) const;
  // The particles' and bodies' own blocks of that, kg.
  void add_blocks(std::vector<SymmetricBlock>& particle, std::vector<Mat6>& rigid) const;
  // The impulses become the multipliers.
  void settle();
  // Gives the contacts `factor` times the impulses, and none to those out of reach, which would else keep
  // what an earlier solve gave them; or the targets that they had when this was built.
  void store(double factor, ContactSet& contacts) const;
  void restore_targets(ContactSet& contacts) const;

 private:
  struct Row {
    int contact = -1;  // in the set; -1 for pairs of surfaces, which have no host
    int pair = -1;     // in pair_maps_
    int host = -1, guest_rigid = -1;
    bool moves_host = false;
    SurfacePoint point;  // of a deformable guest
    Vec3 normal, host_arm, guest_arm, path_velocity;
    double target = 0, friction = 0;
    double normal_mass = 0, tangential_mass = 0;    // kg, the stiffnesses
    Vec3 multiplier = Vec3::Zero();                 // N s
    double bound = 0;                               // N s, of friction
    Vec3 impulse = Vec3::Zero();                    // N s, on the guest
    double normal_slope = 0, tangential_slope = 0;  // kg, by which the impulses fall with the velocity
    Vec3 sliding = Vec3::Zero();                    // unit, the tangent along which friction does not change
  };
  struct PairImpulse {
    std::array<int, 4> particle;
    Vec3 impulse;  // N s
  };
  Vec3 remembered_impulse(const RepulsionPair& pair) const;
  Vec3 velocity_of(const Row& row, const GeneralizedVelocity& v) const;
  Vec3 slope(const Row& row, const Vec3& velocity) const;
  void push(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;

  void find_heaviest(const Islands& islands);
  // Velocity of a point of a rigid body per impulse there, 1/kg.
  Mat3 rigid_response(int body, const Vec3& arm, const Islands& islands) const;
  void add_row(Row& row, const Mat3& response);

  const Bodies* bodies_ = nullptr;
  std::vector<Row> rows_;
  std::vector<int> out_of_reach_;               // contacts without a target
  std::vector<std::array<Mat3, 4>> pair_maps_;  // A_i of v_rel = sum of A_i v_i, of pairs of surfaces
  std::vector<PairImpulse> remembered_;         // in order of their particles
  std::vector<double> heaviest_;                // kg, of every island
  bool is_careful_ = true;
};

}  // namespace duet
