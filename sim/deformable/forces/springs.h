// Springs between two points, each of which moves with some particles: with d = sum w_i x_i (the weights sum
// to zero), a spring of stiffness k, rest length L and viscosity c stores and exerts
//
//   psi = k/2 (|d| - L)^2            f_i = -w_i (k (|d| - L) + c u . d') u,   u = d / |d|
//
// The weights (1, -1) make the ordinary spring on an edge; those of a discrete Laplacian, with L the
// curvature at rest, make a bending element. Every force acts along d, so angular momentum is kept exactly.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/block_sums.h"
#include "sim/deformable/forces/dashpots.h"
#include "sim/deformable/materials/symmetric_block.h"

namespace duet {

template <std::size_t N>
struct Spring {
  std::array<int, N> particle;
  std::array<double, N> weight;
  double rest_length = 0;  // m times the weights' unit
  double stiffness = 0;    // N/m
  double viscosity = 0;    // N s/m
};

// N particles a spring: 2 or 4.
template <std::size_t N>
class Springs {
 public:
  void add(const Spring<N>& spring) { springs_.push_back(spring); }
  // To be called once after the last add(): lays out the batches.
  void finalize(std::size_t particle_count);

  std::size_t size() const { return springs_.size(); }
  // See BlockSums.
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  // Adds the elastic forces at `x` to `force` (N) and keeps the directions for the other two. Where a spring
  // is crushed below a thousandth of its rest length its direction, and with it the force, fades out.
  // Adds to every particle's entry of `sideways`, unless that is empty, its part (see
  // InternalForces::finalize) of the stiffness of stretched springs across their direction, k (1 - L / |d|),
  // which their viscosity does not hold, N/m.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                          std::vector<double>& sideways);
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
    std::vector<double> none;
    add_elastic_forces(x, force, none);
  }
  // Linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // The same in single precision.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
    add_dashpot_forces(dashpots_, sums_, v, force);
  }
  // See InternalForces.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  // Adds the change of the elastic forces with a displacement `dx` (m), less what of it would destabilize:
  // the pull of compressed springs to the side. Linear, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  double energy(const std::vector<Vec3>& x) const;  // J

  // See InternalForces::finalize.
  void add_stiffness(std::vector<double>& stiffness) const;
  double max_squared_frequency(const std::vector<double>& squared_rate) const;
  double rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                         std::vector<double>& kept) const;

 private:
  double squared_frequency(const Spring<N>& spring, const std::vector<double>& squared_rate) const;

  struct Batch {
    std::array<PackIndex, N> particle;
    std::array<BlockSums::Slot, N> slot;
    std::array<Pack, N> weight;
    Pack rest_length, stiffness, viscosity;  // the last two are zero in the lanes that pad the last batch
    PackVector direction;                    // u of the last add_elastic_forces
    Pack sideways;                           // its stiffness across u, k (1 - L / |d|), if not negative
  };
  // sum w_i of the values of all particles, or of those at the batch's slots.
  static PackVector difference(const Batch& batch, const std::vector<Vec3>& values);
  static PackVector difference(const Batch& batch, const Quad* rows);
  template <class Force>
  void add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of);

  std::vector<Spring<N>> springs_;
  std::vector<Batch> batches_;
  std::vector<Dashpots<N>> dashpots_;  // of each batch
  BlockSums sums_;
};

extern template class Springs<2>;
extern template class Springs<4>;

// The viscosity at which a spring of stiffness `k` (N/m) on the particles of the given masses (kg) is damped
// `fraction` times critically: 2 f sqrt(k m), 1/m = sum w_i^2 / m_i. Particles of infinite mass have mass 0.
template <std::size_t N>
double critical_viscosity(double fraction, double k, const std::array<double, N>& weight,
                          const std::array<double, N>& inverse_mass);

extern template double critical_viscosity(double, double, const std::array<double, 2>&,
                                          const std::array<double, 2>&);
extern template double critical_viscosity(double, double, const std::array<double, 4>&,
                                          const std::array<double, 4>&);

}  // namespace duet
