// Incompressible bodies (Irving, Schroeder, Fedkiw 2007): volume is kept around every particle.
#pragma once

#include <array>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// Volumes of the one-rings of all incompressible bodies, and their derivatives. A particle's one-ring holds a
// quarter of every tet around it, so that the one-rings of a body add up to its volume. One constraint a
// particle, where one a tet would leave hardly any freedom to bend ("locking"). Particles on the boundary are
// no exception: the volume around them is as constant as elsewhere.
//
// The divergence D v is the rate of the volumes, with dV_t/dx from the cofactors of the tet's edge matrix;
// the gradient D^T turns pressures into forces. Translations and rotations change no volume, hence the forces
// of any pressures add up to zero, and so do their moments, to rounding.
class OneRings {
 public:
  // Adds the tets of a body (global particle indices), whose volumes at `rest` are to be kept.
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest);
  // To be called once after the last add(), with the same `rest`. Particles without inverse mass do not move.
  void finalize(const std::vector<double>& inverse_mass, const std::vector<Vec3>& rest);

  std::size_t size() const { return particle_.size(); }  // number of one-rings
  int particle(std::size_t ring) const { return particle_[ring]; }
  double rest_volume(std::size_t ring) const { return rest_volume_[ring]; }  // m^3

  // Takes volumes and derivatives at the positions `x` (m); what follows is of the last call.
  void linearize(const std::vector<Vec3>& x);
  double volume(std::size_t ring) const { return volume_[ring]; }      // m^3
  double diagonal(std::size_t ring) const { return diagonal_[ring]; }  // of D M^-1 D^T, m^4/kg
  double rest_diagonal(std::size_t ring) const { return rest_diagonal_[ring]; }
  // rate = D v, m^3/s.
  void divergence(const std::vector<Vec3>& v, std::vector<double>& rate) const;
  // The same of D at the positions `x`, for a single v: leaves the derivatives as they are.
  void divergence_at(const std::vector<Vec3>& x, const std::vector<Vec3>& v, std::vector<double>& rate);
  // v = M^-1 D^T q for the particles of one-rings (others stay): m/s for pressures times time, Pa s.
  void pressure_velocity(const std::vector<double>& q, std::vector<Vec3>& v) const;

  // Largest |V/V_0 - 1| over the incompressible bodies; 0 without any.
  double volume_error(const std::vector<Vec3>& x) const;

 private:
  struct Entry {      // of one particle's row, for a particle of its one-ring
    Vec3 divergence;  // m^2, of the row's volume by the particle's position
    Vec3 gradient;    // m^2, of the particle's volume by the row's position
    int ring, particle;
  };
  struct Incidence {  // of a tet around a particle
    int tet, corner;
    std::array<int, 4> entry;  // of the tet's particles, counted from the row's first
  };
  struct Body {
    std::size_t first_tet, end_tet;
    double rest_volume;  // m^3
  };

  std::vector<Tet> tets_;
  std::vector<Body> bodies_;
  std::vector<int> particle_;
  std::vector<double> inverse_mass_, rest_volume_, volume_, diagonal_, rest_diagonal_;
  std::vector<int> row_start_, incidence_start_;
  std::vector<Entry> entries_;
  std::vector<Incidence> incidences_;
  std::vector<std::array<Vec3, 4>> tet_gradient_;  // m^2, of a quarter of the tet's volume
  std::vector<double> tet_volume_;                 // m^3, a quarter of the tet's
  std::vector<double> tet_rate_;                   // m^3/s, of that
};

}  // namespace duet
