// Contact inside a velocity solve: the impulses of contacts are unknowns of the solve, together with the
// velocities.
#pragma once

#include <array>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/contact_projection.h"
#include "sim/solve/response_row.h"
#include "sim/state/islands.h"

namespace duet {

/// Force that a pair of deformable surfaces held in a solve.
struct PairForce {
  std::array<int, 4> particle{};  ///< the particles that name the pair, see RepulsionPair
  Vec3 force = Vec3::Zero();      ///< N, mean over the time of the solve
};
static_assert(sizeof(PairForce) == 4 * sizeof(int) + sizeof(Vec3),
              "written as it lies in memory: no padding");

/// Forces of pairs, sorted by their particles.
using PairForces = std::vector<PairForce>;

/// Impulses of contacts as functions of their relative velocity v (m/s), by the method of multipliers:
///   normal    p_n = max(0, l_n + k_n (w - n.v))
///   friction  p_t = l_t - k_t v_t, cut to |p_t| <= bound,
/// with the unit normal n, the target w (m/s), the multiplier l (N s) and the stiffnesses k (kg). Both are
/// gradients of convex functions of v, so that a velocity solve with them minimizes a potential. In the limit
/// of infinite k, or of multipliers that equal the impulses, a contact closes no faster than its target,
/// pushes only if it does not separate, and slides only at the bound of friction. That bound is mu p_n at the
/// last set_bounds() (Hestenes 1969; Rockafellar 1973).
class ContactForces {
 public:
  /// Takes the contacts of the active pairs of `graph` on searched `islands`, with the geometry and the
  /// targets that they hold. The multipliers start at `factor` times the impulses of the contacts. `own` has
  /// the inverse of the diagonal block of every particle in the solve without contact, 1/kg. Stiffnesses are
  /// a hundred times the mass that a contact moves, so that with an unknown multiplier it closes by at most a
  /// hundredth of the velocity that it takes up.
  void build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph,
             const Islands& islands, double factor, const std::vector<SymmetricBlock>& own);
  /// Adds pairs of deformable surfaces on searched `islands`. A pair may come as near as its thickness h
  /// within `seconds` (s). A pair that is nearer than h has to separate in that time by the fraction
  /// `part_share` of what it lacks. The multipliers start at the impulses of `forces` in `duration` (s), the
  /// time of the solve. The impulses of a pair act at its two points; a rotation of its particles as a whole
  /// keeps angular momentum.
  void add_pairs(const Bodies& bodies, const std::vector<RepulsionPair>& pairs, const Islands& islands,
                 double seconds, double part_share, const PairForces& forces, double duration,
                 const std::vector<SymmetricBlock>& own);
  /// Adds to `forces` those of the pairs of surfaces in a solve for `duration` (s). A later solve with the
  /// same pairs starts with them: step III with those of the last step, step V with those of step III.
  void store_pairs(double duration, PairForces& forces) const;
  /// Removes all contacts and pairs.
  void clear() {
    rows_.clear();
    out_of_reach_.clear();
  }
  /// Returns the mass (kg) of the heaviest body of each island, of the last build().
  const std::vector<double>& heaviest() const { return heaviest_; }
  /// Returns whether there are no contacts and pairs that can act.
  bool empty() const { return rows_.empty(); }

  /// Computes the impulses at `velocity`, and their derivatives. Returns their potential, J.
  double evaluate(const GeneralizedVelocity& velocity);
  /// Sets the bounds of friction to mu p_n with the normal impulses of the last evaluate().
  void set_bounds();
  /// Sets the bounds of friction at the start of a search: from the impulses of contacts, as set_bounds(),
  /// but from the multipliers of pairs of surfaces. There are so many pairs that with unknown impulses each
  /// would at first give what all together should give.
  void begin_bounds();
  /// Chooses the derivative of sliding friction. The exact one (`careful` false) is zero along the direction
  /// of sliding, because sliding friction keeps its size; Newton steps with it overshoot when bodies come to
  /// a stop. The careful one is the same in all tangential directions, and an upper bound of what friction
  /// loses along the step.
  void set_careful(bool careful) { is_careful_ = careful; }
  /// Adds to `out` `factor` M^-1 times the impulses of all contacts and pairs.
  void add_velocities(double factor, GeneralizedVelocity& out) const;
  /// Adds to `out` `factor` M^-1 times the impulses that store() gives to contacts, without those of pairs of
  /// surfaces.
  void add_stored_velocities(double factor, GeneralizedVelocity& out) const;
  /// Returns what held particles give to others by the impulses of pairs of surfaces.
  Momentum impulse_of_pins(const Particles& particles) const;
  /// Adds the impulses of pairs of surfaces to the sums of their particles.
  void add_pair_impulses(ContactImpulses& out) const;
  /// Adds to `out` M^-1 times the decrease of the impulses by `change` of the velocity.
  void add_differentials(const GeneralizedVelocity& change, GeneralizedVelocity& out) const;
  /// Adds the derivatives of the impulses to the diagonal blocks of every particle (kg) and of every rigid
  /// body (kg, kg m, kg m^2).
  void add_blocks(std::vector<SymmetricBlock>& particle, std::vector<Mat6>& rigid) const;
  /// Appends the derivatives of the impulses, row by row.
  void append_rows(std::vector<ResponseRow>& rows) const;
  /// Sets the multipliers to the impulses.
  void update_multipliers();
  /// Sets the impulses of contacts to `factor` times the impulses here. Sets those of contacts out of reach
  /// to zero, which would otherwise keep the impulse of an earlier solve.
  void store(double factor, ContactSet& contacts) const;
  /// Sets the targets of contacts to those that they had at build().
  void restore_targets(ContactSet& contacts) const;

 private:
  // A contact, or a pair of deformable surfaces.
  struct Row {
    int contact = -1;                 // index into ContactSet::points; -1: a pair of surfaces
    int pair = -1;                    // index into pair_maps_; -1: a contact
    int host = -1, guest_rigid = -1;  // rigid bodies; -1: none
    bool moves_host = false;
    SurfacePoint point;                             // of a deformable guest, or the four particles of a pair
    Vec3 normal,                                    // unit
        host_arm, guest_arm,                        // m
        path_velocity;                              // m/s, see ContactPoint
    double target = 0,                              // m/s
        friction = 0;                               // Coulomb coefficient
    double normal_mass = 0, tangential_mass = 0;    // kg, the stiffnesses k_n and k_t
    Vec3 multiplier = Vec3::Zero();                 // N s
    double bound = 0;                               // N s, of friction
    Vec3 impulse = Vec3::Zero();                    // N s, on the guest
    double normal_slope = 0, tangential_slope = 0;  // kg, decrease of the impulses per velocity
    Vec3 sliding = Vec3::Zero();  // unit, the direction of friction at its bound; zero: it sticks
  };
  // Returns the relative velocity of a row, m/s, without its path velocity.
  Vec3 velocity_of(const Row& row, const GeneralizedVelocity& v) const;
  Vec3 slope(const Row& row, const Vec3& velocity) const;
  // Returns the matrix of slope(), kg.
  Mat3 slope(const Row& row) const;
  // Adds M^-1 times an impulse on the guest and its opposite on the host.
  void push(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;

  // Fills heaviest_.
  void find_heaviest(const Islands& islands);
  // Returns the velocity of a point of a rigid body per impulse there, 1/kg, for the choice of a stiffness.
  Mat3 rigid_response(int body, const Vec3& arm, const Islands& islands) const;
  // Sets the stiffnesses of a row by its `response` (1/kg) and adds it, unless nothing can move along its
  // normal.
  void add_row(Row& row, const Mat3& response);

  const Bodies* bodies_ = nullptr;
  std::vector<Row> rows_;
  std::vector<int> out_of_reach_;               // contacts with the target minus infinity
  std::vector<std::array<Mat3, 4>> pair_maps_;  // for each pair of surfaces: A_i of v_rel = sum of A_i v_i
  std::vector<double> heaviest_;                // kg, for each island: the mass of its heaviest body
  bool is_careful_ = true;
};

}  // namespace duet
