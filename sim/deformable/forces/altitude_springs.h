// Altitude springs: what keeps the tets of a mass-spring body from collapsing (Molino, Bridson, Teran, Fedkiw
// 2003; Selle, Lentine, Fedkiw 2008). Of a tet's seven altitudes, from a vertex to the opposite face and
// between opposite edges, the shortest one carries a spring. Altitudes are signed: that of an inverted tet is
// negative, so that its spring turns it right side out again.
//
//   psi = k/2 (h - H)^2,  h = n . sum w_i x_i,  n the unit normal of the face or of the two edges
//
// with the weights w of the foot of the altitude, k = modulus / H. The forces are the gradient of this
// energy: as sum w_i x_i = h n, they need no derivative of the weights.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/block_sums.h"
#include "sim/deformable/forces/dashpots.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

class AltitudeSprings {
 public:
  // Adds the springs of a body's tets (global particle indices) at their rest positions. `modulus`: N, the
  // force of a spring at 100 % strain; `damping`: of critical damping.
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest, double modulus, double damping);
  // To be called once after the last add(): lays out the batches.
  void finalize(const std::vector<double>& inverse_mass);

  std::size_t size() const { return tets_.size(); }
  // See BlockSums.
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  // Gives every tet the spring of its shortest altitude at `x`: the one across its largest face or pair of
  // edges. Between two choices the forces have an energy.
  void choose(const std::vector<Vec3>& x);
  // `sideways` as of Springs, for altitudes that are longer or shorter than at rest: k |h - H| / max(|h|, H).
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                          std::vector<double>& sideways);
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
    add_dashpot_forces(dashpots_, sums_, v, force);
  }
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);  // see InternalForces
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  double energy(const std::vector<Vec3>& x) const;  // J, with the springs that choose(x) chooses

  // See InternalForces::finalize: the weights of a foot add up to 1 on its own side and on the other.
  void add_stiffness(std::vector<double>& stiffness) const;
  double max_squared_frequency(const std::vector<double>& squared_rate) const;
  double rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                         std::vector<double>& kept) const;

 private:
  static constexpr std::size_t altitudes =
      7;  // of the vertices 0 to 3, of the edges at 0 to the opposite one

  void add_stiffness_of(std::size_t t, std::vector<double>& stiffness) const;
  double squared_frequency(std::size_t t, const std::vector<double>& squared_rate) const;

  struct RestTet {
    std::array<double, altitudes> length;  // m
    double modulus, damping;
  };
  struct Batch {
    std::array<PackIndex, 4> particle;
    std::array<BlockSums::Slot, 4> slot;
    std::array<Pack, altitudes> rest_length, viscosity;
    Pack modulus;  // zero, as is the viscosity, in the lanes that pad the last batch
  };
  // The springs of a batch that choose() has chosen, with the tets' corners as altitude() takes them.
  struct Chosen {
    std::array<BlockSums::Slot, 4> slot;
    PackMask between_edges;  // or else from the first corner to the face of the others
    Pack rest_length, stiffness, viscosity;
    std::array<Pack, 4> weight;  // of the last add_elastic_forces, as is the normal
    PackVector normal;
  };
  struct Altitude {
    std::array<Pack, 4> weight;
    PackVector normal;
    Pack length;
  };
  // Returns the square of the largest base: six volumes over it are the altitude.
  static Pack choose(const Batch& batch, const std::array<PackVector, 4>& corner, Chosen& chosen);
  static Altitude altitude(const Chosen& chosen, const Quad* rows);
  static PackVector difference(const Chosen& chosen, const Quad* rows);
  template <class Force>
  void add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of);

  std::vector<Tet> tets_;
  std::vector<RestTet> rest_;
  std::vector<Batch> batches_;
  std::vector<Chosen> chosen_;         // of each batch
  std::vector<Dashpots<4>> dashpots_;  // of each batch
  BlockSums sums_;
};

}  // namespace duet
