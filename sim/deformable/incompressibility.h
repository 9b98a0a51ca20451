// Incompressible bodies: volume is kept around every particle (Irving, Schroeder, Fedkiw 2007).
#pragma once

#include <array>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Nodal volumes ("one-rings") of all incompressible bodies, and their derivatives by the particles'
/// positions.
///
/// The one-ring of a particle holds a quarter of the volume of every tetrahedron around it, so the one-rings
/// of a body add up to its volume. There is one constraint for each particle; one for each tetrahedron would
/// leave hardly any freedom to bend ("locking"). Particles on the boundary have a constraint like all others.
///
/// The divergence D v is the rate of the volumes for particle velocities v, with dV_t/dx from the cofactors
/// of the tetrahedron's edge matrix; the gradient D^T turns pressures into forces. Translations and rotations
/// change no volume. Hence the forces of any pressures add up to zero, and so do their moments, up to
/// rounding. Source: Irving, Schroeder, Fedkiw 2007.
class NodalVolumes {
 public:
  /// Adds the tetrahedra of a body (global particle indices); the volumes at `rest` (m, positions of all
  /// particles so far) are to be kept.
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest);
  /// Builds the rows of D. Must be called once after the last add().
  ///
  /// `inverse_mass` (1/kg) and `rest` (m) have one entry for each particle. Particles with inverse mass 0 do
  /// not move.
  void finalize(const std::vector<double>& inverse_mass, const std::vector<Vec3>& rest);

  /// Returns the number of one-rings.
  std::size_t size() const { return particle_.size(); }
  /// Returns the particle at the center of a one-ring.
  int particle(std::size_t ring) const { return particle_[ring]; }
  /// Returns the volume that a one-ring is to keep, m^3.
  double rest_volume(std::size_t ring) const { return rest_volume_[ring]; }

  /// Computes volumes and derivatives at the positions `x` (m of all particles).
  ///
  /// volume(), diagonal(), divergence() and pressure_velocity() refer to the last call.
  void linearize(const std::vector<Vec3>& x);
  /// Returns the volume of a one-ring, m^3.
  double volume(std::size_t ring) const { return volume_[ring]; }
  /// Returns the diagonal entry of D M^-1 D^T of a one-ring, m^4/kg.
  double diagonal(std::size_t ring) const { return diagonal_[ring]; }
  /// Returns the diagonal entry of D M^-1 D^T of a one-ring at rest, m^4/kg.
  double rest_diagonal(std::size_t ring) const { return rest_diagonal_[ring]; }
  /// Computes rate = D v, the rate of each one-ring's volume, m^3/s; `v` (m/s) has one entry for each
  /// particle.
  void divergence(const std::vector<Vec3>& v, std::vector<double>& rate) const;
  /// Computes rate = D v (m^3/s) with D at the positions `x` (m), without changing the derivatives of
  /// linearize().
  ///
  /// It is cheaper than linearize() followed by divergence() for a single `v` (m/s). It overwrites scratch of
  /// the object.
  void divergence_at(const std::vector<Vec3>& x, const std::vector<Vec3>& v, std::vector<double>& rate);
  /// Computes v = M^-1 D^T q, the velocity changes (m/s) for pressures times time `q` (Pa s, one entry for
  /// each one-ring).
  ///
  /// It overwrites the entries of `v` for particles that have a one-ring and leaves the others.
  void pressure_velocity(const std::vector<double>& q, std::vector<Vec3>& v) const;
  /// Computes the impulses D^T q (N s) of pressures times time `q` on particles with inverse mass 0, which
  /// pins or bones hold.
  ///
  /// It overwrites the entries of `impulse` for such particles that have a one-ring and leaves the others.
  void impulses_on_held(const std::vector<double>& q, std::vector<Vec3>& impulse) const;

  /// Returns the largest |V/V_0 - 1| over the incompressible bodies at the positions `x` (m); 0 without any.
  double volume_error(const std::vector<Vec3>& x) const;

 private:
  // Returns the impulse D^T q on the particle at the center of a one-ring, N s.
  Vec3 impulse_on(std::size_t ring, const std::vector<double>& q) const;

  // Nonzero of the row of D of one one-ring, for a particle of that one-ring.
  struct Entry {
    Vec3 divergence;  // m^2, derivative of the row's volume by the particle's position
    Vec3 gradient;    // m^2, derivative of the particle's volume by the position of the row's center
    int ring, particle;
  };
  // A tetrahedron around a particle.
  struct Incidence {
    int tet, corner;           // `corner`: 0 to 3, the corner at which the particle is
    std::array<int, 4> entry;  // for each corner of the tetrahedron, its entry counted from the row's first
  };
  // An incompressible body.
  struct Body {
    std::size_t first_tet, end_tet;  // range of tets_
    double rest_volume;              // m^3
  };

  std::vector<Tet> tets_;
  std::vector<Body> bodies_;
  std::vector<int> particle_;  // by one-ring
  // For each one-ring, in this order: 1/kg, m^3, m^3, m^4/kg, m^4/kg. Between add() and finalize() the rest
  // volumes are those of particles.
  std::vector<double> inverse_mass_, rest_volume_, volume_, diagonal_, rest_diagonal_;
  std::vector<int> row_start_, incidence_start_;
  std::vector<Entry> entries_;
  std::vector<Incidence> incidences_;
  // In m^2, by tetrahedron: derivative of a quarter of its volume by each corner.
  std::vector<std::array<Vec3, 4>> tet_gradient_;
  std::vector<double> tet_volume_;  // m^3, a quarter of the tetrahedron's volume
  std::vector<double> tet_rate_;    // m^3/s, rate of a quarter of the tetrahedron's volume; scratch
};

}  // namespace duet
