// Zero-length springs between pairs of particles, the same in all directions: soft bindings of flesh to
// points that a bone carries (Sifakis, Shinar, Irving, Fedkiw 2007).
//
//     psi = k/2 d^2,   f_a = -k d - c d' = -f_b,   d = x_a - x_b
//
// k is the stiffness and c the viscosity. The forces keep angular momentum exactly if the force on b acts at
// x_a, as EmbeddedParticle::at says, and the velocity of b is that of its body at x_a.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/forces/particle_blocks.h"

namespace duet {

/// A zero-length spring between two particles.
struct ZeroLengthSpring {
  int a = 0,             ///< particle of the flesh; no particle is in two zero-length springs
      b = 0;             ///< particle that a bone carries
  double stiffness = 0;  ///< k, N/m
  double viscosity = 0;  ///< c, N s/m
};

/// Forces of all zero-length springs, and bounds on their frequencies.
class ZeroLengthSprings {
 public:
  /// Adds a zero-length spring, whose particles must not be in another one.
  void add(const ZeroLengthSpring& spring) { springs_.push_back(spring); }
  /// Does nothing; all forces have this function.
  void finalize(std::size_t) {}
  /// Returns the number of zero-length springs.
  std::size_t size() const { return springs_.size(); }
  /// Returns the zero-length springs in the order in which they were added.
  const std::vector<ZeroLengthSpring>& all() const { return springs_; }

  /// Adds the elastic forces at the positions `x` (m) to `force` (N).
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) const;
  /// Adds the viscous forces for the velocities `v` (m/s) to `force` (N).
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) const;
  /// Adds the change of the elastic forces for displacements `dx` (m) to `force` (N).
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) const;
  /// Appends the blocks of the matrix of these forces.
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Returns the elastic energy at the positions `x` (m), J.
  double energy(const std::vector<Vec3>& x) const;

  /// Adds the stiffness of each zero-length spring to the entries of its two particles in `stiffness` (N/m),
  /// see InternalForces::finalize().
  void add_stiffness(std::vector<double>& stiffness) const;
  /// Returns the highest omega^2 bound of a zero-length spring, rad^2/s^2, given the rates C_i / m_i of the
  /// particles (InternalForces::finalize()).
  double max_omega_squared(const std::vector<double>& squared_rate) const;
  /// Returns the omega^2 bound (rad^2/s^2) of the spring of each particle; 0 for particles without a spring.
  ///
  ///     k (1/m_a + 1/m_b)
  ///
  /// `inverse_mass` (1/kg) has one entry for each particle, 0 for infinite mass. The result is empty if there
  /// are no springs.
  std::vector<double> omega_squared_by_particle(const std::vector<double>& inverse_mass) const;

 private:
  // Adds the forces -f to particle a and f to particle b of each zero-length spring, where f is
  // factor_of(zero-length spring) times the difference of `values` at a and b.
  template <class Factor>
  void add(const std::vector<Vec3>& values, std::vector<Vec3>& force, Factor&& factor_of) const;

  std::vector<ZeroLengthSpring> springs_;
};

}  // namespace duet
