// Self-repulsions (paper sections 3 and 7, steps I.3 and V.4; Bridson et al. 2002): impulses between parts of
// deformable surfaces, of one body or of several, that are nearer to each other than their thickness h.
#pragma once

#include <utility>

#include "sim/deformable/contact_impulses.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/deformable/particle_mask.h"
#include "sim/deformable/particles.h"
#include "sim/deformable/self_contact/collision_candidates.h"
#include "sim/deformable/support_point.h"

namespace duet {

/// The normal velocities that a projection gives to the rows of its constraints.
enum class ProjectTo {
  targets,  ///< The target of each row.
  zero      ///< Zero: the projection is linear.
};

/// The nearest points of two elements, as a constraint on particle velocities.
///
/// The speed at which the points separate is n . sum w_i v_i, with the unit normal n and the weights w_i.
struct RepulsionPair {
  std::array<int, 4> particle{};  ///< the particles of the first element, then those of the second
  /// barycentric weights of the nearest points, negative for the second element
  std::array<double, 4> weight{};
  Vec3 normal = Vec3::Zero();  ///< unit, from the second element to the first
  double distance = 0,         ///< m, along the normal
      thickness = 0;           ///< m, the distance h that the pair keeps
  double friction = 0;         ///< Coulomb coefficient
  int first = 1;               ///< number of particles of the first element: 1 for a point, 2 for an edge
  double mass = 0;             ///< kg, effective mass 1/(sum of w_i^2 / m_i); 0 if all particles are held
  double row_mass = 0;         ///< kg, effective mass in the inner product that sweep() works in
  double target = 0;           ///< m/s, smallest normal velocity at mid-step that a solve aims at
  bool may_be_row = true;      ///< whether activate_rows() may activate the pair
  bool active = false;         ///< whether the pair is a row (constraint) of a solve
};

/// Returns sum w_i v_i, the velocity of the first nearest point relative to the second, m/s.
Vec3 relative_velocity(const RepulsionPair& pair, const std::vector<Vec3>& v);
/// Applies an impulse (N s) to a pair: velocities change by w_i j / m_i.
///
/// This keeps linear momentum, and angular momentum too if the impulse is along the normal.
void apply_impulse(const RepulsionPair& pair, const Vec3& impulse, const std::vector<double>& inverse_mass,
                   std::vector<Vec3>& v);

/// Fraction of its distance from h that a pair covers in a step, if it is nearer than h or a row of a solve
/// (Bridson et al. 2002, section 7.2).
inline constexpr double parted_share = 0.1;
/// Returns the smallest normal velocity (m/s) of a pair with which it comes no nearer than h within `dt` (s),
/// or, for a row of a solve, closes no more than a tenth of its gap to h.
double min_speed(const RepulsionPair& pair, double dt);

/// Repulsions between deformable surfaces, as impulses and as constraints of a velocity solve.
class SelfRepulsion {
 public:
  /// Finds the pairs that are nearer than repulsion_range h at the positions `x` (m), where `candidates` have
  /// been updated.
  ///
  /// `inverse_mass` is in 1/kg. `around` lists for each particle the `triangles` of the boundaries of
  /// volumes. On such boundaries the nearest points must be support points toward each other. Otherwise the
  /// rim of a box that slides over another one would be pushed along by the surface ahead of it, to which it
  /// is also near.
  void find(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
            const std::vector<double>& inverse_mass, const ElementLists& around,
            const std::vector<Triangle>& triangles);

  /// Finds the pairs that are nearer than repulsion_range h at `x` (m), or come so near within `dt` (s) when
  /// `v` (m/s) moves the particles.
  ///
  /// It also tries the motion of one element alone, because contact may hold the other one. A pair has the
  /// weights and the normal of the moment of meeting, and the distance along that normal at `x`. Its masses
  /// are left at 0, so it cannot be passed to apply(). `around` and `triangles` are those of find().
  void find_approaching(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
                        const std::vector<Vec3>& v, double dt, const ElementLists& around,
                        const std::vector<Triangle>& triangles);

  /// Applies inelastic impulses with Coulomb friction at the positions `x` (m), so that pairs do not come
  /// nearer than h within `dt` (s).
  ///
  /// Pairs that are active rows of a solve may close a tenth of their gap to h. Linear and angular momentum
  /// are kept. Sets `friction` (N s) to the friction impulses on all particles, and adds all impulses to
  /// `tally` unless it is null.
  void apply(double dt, const std::vector<Vec3>& x, const std::vector<double>& inverse_mass,
             std::vector<Vec3>& v, std::vector<Vec3>& friction, ContactImpulses* tally = nullptr);
  /// Applies elastic impulses: pairs that are nearer than h separate by a tenth of what they lack within `dt`
  /// (s).
  void apply_elastic(double dt, const std::vector<double>& inverse_mass, std::vector<Vec3>& v);

  /// Calls may_be_row(pair) for all pairs and stores the results in them; all may be rows after find().
  template <class Predicate>
  void choose_rows_among(Predicate&& may_be_row) {
    for (RepulsionPair& pair : pairs_) pair.may_be_row = may_be_row(std::as_const(pair));
  }
  /// Activates the pairs that are to be rows (constraints) of the projection in the conjugate gradients
  /// (paper section 7.1), and sets their targets.
  ///
  /// A pair becomes active if it is nearer than 1.001 h and would come nearer than h within `dt` (s) if its
  /// velocity went from `start` (m/s) at the beginning of the step by way of `velocity` (m/s) at the fraction
  /// `at` of it. Its target lets it approach h by a tenth of its gap by the end of the step, which apply()
  /// keeps to. Returns whether all pairs that may and are near enough became active.
  bool activate_rows(double dt, double at, const std::vector<Vec3>& start, const std::vector<Vec3>& velocity);
  /// The same for the pairs that are not active, at another `velocity`. Returns whether any became active.
  bool activate_more_rows(double dt, double at, const std::vector<Vec3>& start,
                          const std::vector<Vec3>& velocity);
  /// Deactivates the pairs that the velocity change `change` (m/s) separates faster than by `tolerance`
  /// (m/s). Returns whether there were any.
  bool deactivate_rows(const std::vector<Vec3>& change, double tolerance);
  /// Deactivates all pairs.
  void deactivate_all_rows();
  /// Makes sweep() work in the inner product of other masses than those of the particles; null goes back to
  /// these.
  ///
  /// `inverse_mass` (1/kg) has a 3x3 block for each particle. It is not copied and must live as long as it is
  /// in use.
  void use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass);
  /// Restricts sweep() and use_inverse_masses() to the pairs whose first particle is in `mask` until the next
  /// call; null removes the restriction.
  void limit_to(const ParticleMask* mask) { mask_ = mask; }
  /// Projects `v` (m/s) onto the active rows, one after the other forward and backward, which is self-adjoint
  /// in the mass inner product.
  ///
  /// `goal` says to which normal velocities. `inverse_mass` (1/kg) is used unless use_inverse_masses() has
  /// set other masses.
  void sweep(ProjectTo goal, const std::vector<double>& inverse_mass, std::vector<Vec3>& v) const;

  /// Returns the pairs of the last find() or find_approaching().
  const std::vector<RepulsionPair>& pairs() const { return pairs_; }

 private:
  // Sums of the impulses that a pair has received in a call of apply() or apply_elastic(), N s.
  struct PairImpulse {
    double normal = 0;
    Vec3 friction = Vec3::Zero();  // along the surface
  };
  // Calls visit(pair, its impulses), which returns the change of a velocity (m/s), for all pairs with mass
  // until the impulses have settled.
  template <class Visit>
  void sweep_impulses(Visit&& visit);

  std::vector<PairImpulse> impulses_;  // of the pairs
  CollectScratch<RepulsionPair> ranges_;
  std::vector<RepulsionPair> pairs_;
  // Returns whether a pair takes part in sweep().
  bool takes(const RepulsionPair& pair) const {
    return pair.active && (!mask_ || mask_->has(static_cast<std::size_t>(pair.particle[0])));
  }

  const ParticleMask* mask_ = nullptr;
  const std::vector<SymmetricBlock>* row_inverse_mass_ = nullptr;
};

}  // namespace duet
