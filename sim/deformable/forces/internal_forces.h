// The sum of all forces that deformable bodies exert on themselves. The time step and its solves see only
// this sum, whatever a body is made of.
#pragma once

#include <optional>
#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/forces/altitude_springs.h"
#include "sim/deformable/forces/finite_elements.h"
#include "sim/deformable/forces/membranes.h"
#include "sim/deformable/forces/springs.h"
#include "sim/deformable/forces/zero_length_springs.h"

namespace duet {

/// Sum of all internal forces of deformable bodies, and bounds on the frequencies that they cause.
///
/// Springs, membranes and bending may share particles. A particle of finite elements belongs to none of them,
/// but may have a zero-length spring. The bounds are the larger one of that of the elements, with the
/// zero-length springs on their particles, and that of all other forces.
class InternalForces {
 public:
  FiniteElements elements;                ///< elasticity of volumes
  Membranes membranes;                    ///< stretching of shells
  Springs<2> edge_springs;                ///< stretching of mass-spring volumes, shells and rods
  AltitudeSprings altitude_springs;       ///< keeps the tetrahedra of mass-spring volumes from collapsing
  Springs<2> bending_springs;             ///< bending of shells and rods, by springs between particles
  Springs<4> rod_bending;                 ///< bending of rods, by springs on their curvature
  Springs<12, 3> shell_bending;           ///< bending of shells, by springs on their curvature
  ZeroLengthSprings zero_length_springs;  ///< soft bindings of flesh to bones

  /// Lays out all forces and computes the bounds at rest. Must be called once after everything has been
  /// added.
  ///
  /// All arguments have one entry for each particle. `mass` (kg) and `inverse_mass` (1/kg) are the inertia
  /// that a force on it meets; the inverse mass is 0 for those that never move. `own_mass` (kg) is the mass
  /// of the material around it (FiniteElements::finalize()).
  void finalize(const std::vector<double>& mass, const std::vector<double>& inverse_mass,
                const std::vector<double>& own_mass);
  /// Returns whether there is no force at all.
  bool empty() const;
  /// Restricts forces and damping blocks to the particles of `mask` until the next call; null removes the
  /// restriction.
  ///
  /// Zero-length springs and mass-proportional damping are not restricted.
  void limit_to(const ParticleMask* mask);

  /// Selects the altitude springs for the positions `x` (m).
  ///
  /// To be called at x^n, and in semi-implicit steps at x^{n+1/2} as well. Springs that are chosen a moment
  /// too late are not the ones that store the energy: a body of springs without damping gained a thousandth
  /// of its energy in every step.
  void choose_altitudes(const std::vector<Vec3>& x) { altitude_springs.choose(x); }
  /// Adds the elastic forces at the positions `x` (m) to `force` (N), keeps the state of deformation for
  /// damping and differentials, and updates max_omega_squared().
  ///
  /// Unless `turn` is null, it also prepares add_kept_turn_forces() for it.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force, const Turn* turn = nullptr);
  /// Adds the viscous forces for the velocities `v` (m/s) in the state of the last add_elastic_forces() to
  /// `force` (N): linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds the change of the viscous forces between the state of the last add_elastic_forces() and `seconds`
  /// later, for particles that keep the velocities `v` (m/s), to `force` (N).
  ///
  /// A solve finds velocities at a later time than that of the state. These turn with the body, and their
  /// viscous forces alone would resist the turn as a contraction: a body that spins would grow, and gain
  /// energy while it does. Zero-length springs and mass-proportional damping have no such part. Springs on
  /// curvatures are left out: these may be almost zero, and then have no direction that turns.
  void add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force);
  /// Adds the forces of add_turn_forces() for the `turn` of the last add_elastic_forces(), most of which that
  /// has computed, to `force` (N).
  void add_kept_turn_forces(const Turn& turn, std::vector<Vec3>& force);
  /// Adds the viscous forces like add_damping_forces(), in single precision except those of membranes and
  /// zero-length springs.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Returns whether the viscous forces on a body can have a resultant or a moment, from bones (zero-length
  /// springs) or a medium (mass-proportional damping).
  bool turn_bodies() const { return zero_length_springs.size() > 0 || elements.brakes(); }
  /// Adds each particle's own 3x3 block of minus the operator of add_damping_forces() to `blocks`, kg/s,
  /// without membranes and zero-length springs.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  /// Lets damping hold stiff elements and springs instead of the time step following them, see
  /// FiniteElements::rely_on_damping().
  ///
  /// Springs on edges and altitudes are treated as elements are: if their viscosity is tau times their
  /// stiffness, they do not lower the stability limit below `relaxation` times tau. `cfl` is the fraction of
  /// the limit that steps take.
  void rely_on_damping(double cfl, double relaxation);
  /// Sets the time step (s) of the evaluations to come, see FiniteElements::set_time_step().
  void set_time_step(double dt, std::optional<double> at = {}) { elements.set_time_step(dt, at); }
  /// Sets a damping time (s) that is added to that of the finite elements.
  void set_added_damping(double seconds) { elements.set_added_damping(seconds); }
  /// Adds the change of the elastic forces for displacements `dx` (m) from the state of the last
  /// add_elastic_forces() to `force` (N).
  ///
  /// linearize() must have been called for that state. The part that would destabilize an implicit solve is
  /// left out: linear in dx, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  /// Appends the blocks of minus the derivative of `factors` times these forces: of add_damping_forces() and
  /// add_force_differentials(), whose matrix they add up to.
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Prepares add_force_differentials() for the state of the last add_elastic_forces().
  void linearize();
  /// Returns the elastic energy at the positions `x` (m), J.
  double energy(const std::vector<Vec3>& x) const;

  /// Returns an upper bound on the square of the highest angular frequency in the state of the last
  /// add_elastic_forces(), or at rest before the first, rad^2/s^2.
  double max_omega_squared() const { return max_omega_squared_; }
  /// Returns an upper bound on the square of the highest angular frequency at rest, rad^2/s^2.
  double rest_omega_squared() const { return rest_omega_squared_; }
  /// Returns the bound of rest_omega_squared() without the help of damping, rad^2/s^2.
  double elastic_omega_squared() const;
  /// Sets the bound of max_omega_squared() for a resumed run, whose next step size depends on it.
  void set_max_omega_squared(double value) { max_omega_squared_ = value; }

 private:
  // Returns the omega^2 bound of all forces but the finite elements, rad^2/s^2. Takes the sums C_i (N/m) in
  // `rate` and turns them into C_i / m_i (rad^2/s^2), see finalize().
  double lattice_bound(std::vector<double>& rate) const;
  // Returns the bound of lattice_bound() without the stiffness that damping holds, with the geometric
  // stiffness of the last add_elastic_forces().
  double relaxed_bound() const;
  // Sets the bounds to those at rest.
  void bound_at_rest();

  double lattice_omega_squared_ = 0;  // rad^2/s^2, bound of all but the finite elements, at rest
  double relaxed_omega_squared_ = 0;  // rad^2/s^2, bound of the springs that damping holds
  std::vector<double> inverse_mass_;  // 1/kg
  // N/m, by particle: sum of the undamped stiffness around it, which damping does not hold; empty if it holds
  // nothing.
  std::vector<double> undamped_stiffness_;
  // N/m, by particle: sum of the geometric stiffness of edge and altitude springs around it; empty as kept_
  // is.
  std::vector<double> geometric_stiffness_;
  std::vector<double> squared_rate_;                       // rad^2/s^2, C_i / m_i by particle, see finalize()
  double max_omega_squared_ = 0, rest_omega_squared_ = 0;  // rad^2/s^2
};

}  // namespace duet
