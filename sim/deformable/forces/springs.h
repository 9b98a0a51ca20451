// Springs between two points, each of which moves with some particles. With d = sum w_i x_i, where the
// weights add up to zero, a spring of stiffness k, rest length L and viscosity c stores and exerts
//
//     psi = k/2 (|d| - L)^2            f_i = -w_i (k (|d| - L) + c u . d') u,   u = d / |d|
//
// The weights (1, -1) make the ordinary spring on an edge. The weights of a discrete Laplacian, with the
// curvature at rest as L, make a bending element. Every force acts along d, so angular momentum is kept
// exactly. Springs that share all of their particles, as those on the components of a curvature do, form a
// group: their particles are read and written once.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/forces/dashpots.h"
#include "sim/deformable/forces/particle_blocks.h"
#include "sim/deformable/forces/turn.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/deformable/scatter_add.h"

namespace duet {

/// A spring on `N` particles.
template <std::size_t N>
struct Spring {
  std::array<int, N> particle;   ///< indices of the particles
  std::array<double, N> weight;  ///< weights of their positions in d; they add up to zero
  double rest_length = 0;        ///< L, m times the unit of the weights
  double stiffness = 0;          ///< k, N/m for weights without unit
  double viscosity = 0;          ///< c, N s/m for weights without unit
};

/// Springs on `N` particles each, in groups of `R` that share their particles, and bounds on their
/// frequencies.
template <std::size_t N, std::size_t R = 1>
class Springs {
 public:
  /// Adds a spring that is a group of its own.
  void add(const Spring<N>& spring) requires(R == 1) { springs_.push_back(spring); }
  /// Adds a group. All springs must have the particles of the first one; a spring without effect has the
  /// stiffness 0.
  void add(const std::array<Spring<N>, R>& group) {
    springs_.insert(springs_.end(), group.begin(), group.end());
  }
  /// Lays out the batches. Must be called once after the last add().
  void finalize(std::size_t particle_count);

  /// Returns the number of springs.
  std::size_t size() const { return springs_.size(); }
  /// Returns the springs in the order in which they were added, group by group.
  const std::vector<Spring<N>>& all() const { return springs_; }
  /// Restricts the sums below to the particles of `mask` until the next call; null removes the restriction
  /// (ScatterAdd::limit_to()).
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  /// Adds the elastic forces at the positions `x` (m) to `force` (N) and keeps the directions for damping and
  /// differentials.
  ///
  /// The direction of a spring that is compressed below a thousandth of its rest length fades out, and with
  /// it the force.
  ///
  /// Unless `geometric_stiffness` is empty, adds to each particle's entry its part (see
  /// InternalForces::finalize()) of the geometric stiffness k (1 - L / |d|) (N/m) of stretched springs. It
  /// acts across their direction, where their viscosity does not hold it.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                          std::vector<double>& geometric_stiffness, const Turn* turn = nullptr);
  /// Adds the elastic forces at the positions `x` (m) to `force` (N), without the geometric stiffness.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force, const Turn* turn = nullptr) {
    std::vector<double> none;
    add_elastic_forces(x, force, none, turn);
  }
  /// Adds the viscous forces for the velocities `v` (m/s) in the directions of the last add_elastic_forces()
  /// to `force` (N): linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds the change of the viscous forces between the state of the last add_elastic_forces() and `seconds`
  /// later, for particles that keep the velocities `v` (m/s), to `force` (N).
  ///
  /// If d turns by w t within t seconds, its length changes faster by w^2 t / sqrt(|d|^2 + w^2 t^2), where w
  /// is the part of d' across d. Without that, velocities of the later time seem to shorten a spring that
  /// turns, and a rope that whips gains energy.
  void add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force);
  /// Adds the turn forces that the last add_elastic_forces() has computed (Turn) to `force` (N).
  void add_kept_turn_forces(std::vector<Vec3>& force) const { sums_.add_kept_to(force); }
  /// Adds the viscous forces like add_damping_forces(), in single precision.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
    add_dashpot_forces(dashpots_, sums_, v, force);
  }
  /// Adds each particle's own 3x3 block of minus the operator of add_damping_forces() to `blocks`, kg/s.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  /// Adds the change of the elastic forces for displacements `dx` (m) from the state of the last
  /// add_elastic_forces() to `force` (N).
  ///
  /// The lateral push of compressed springs, which would destabilize an implicit solve, is left out: linear
  /// in dx, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  /// Appends the blocks of the matrix of these forces in the state of the last add_elastic_forces().
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Returns the elastic energy at the positions `x` (m), J.
  double energy(const std::vector<Vec3>& x) const;

  /// Adds to each particle's entry of `stiffness` (N/m) its part of the springs' stiffness, see
  /// InternalForces::finalize().
  void add_stiffness(std::vector<double>& stiffness) const;
  /// Returns the highest omega^2 bound of a spring, rad^2/s^2, given the rates C_i / m_i of the particles
  /// (InternalForces::finalize()).
  double max_omega_squared(const std::vector<double>& squared_rate) const;
  /// Finds which springs have enough viscosity for steps of `relaxation` times their damping time (viscosity
  /// over stiffness, s).
  ///
  /// Returns the highest omega^2 bound (rad^2/s^2) that such steps stand for, over the springs that it
  /// lowers; 0 without any. Adds the stiffness of the other springs (undamped stiffness, N/m) to
  /// `undamped_stiffness`.
  double rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                         std::vector<double>& undamped_stiffness) const;

 private:
  // Returns the omega^2 bound of a spring, rad^2/s^2.
  double omega_squared(const Spring<N>& spring, const std::vector<double>& squared_rate) const;

  // One spring of each of eight groups.
  struct Row {
    std::array<double8, N> weight;
    double8 rest_length, stiffness, viscosity;  // the last two are zero in the lanes that pad the last batch
    double8 length;                             // |d| of the last add_elastic_forces()
    vector8 direction;                          // u then
    double8 geometric_stiffness;  // N/m, geometric stiffness k (1 - L / |d|) then, or 0 if that is negative

    // Returns the block of the springs of `lane` between their points, kg: that of two particles is w_i w_j
    // times it.
    Mat3 block(std::size_t lane, const BlockFactors& factors) const;
    // Returns sum w_i of `values`, those of the particles.
    vector8 difference(const std::array<vector8, N>& values) const;
  };
  // Eight groups.
  struct Batch {
    std::array<PackIndex, N> particle;
    std::array<ScatterAdd::Slot, N> slot;
    std::array<Row, R> row;

    // Returns the values at the particles, from the rows of a block.
    std::array<vector8, N> gather(const double4* rows) const;
    // Distributes forces along d, one for each row, to the particles, and the numbers `fourth` with them.
    void spread(const std::array<vector8, R>& force, const std::array<double8, N>& fourth,
                double4* sums) const;
  };
  // Returns the work of a batch, for sums_, that adds the forces along d which force_of(row, d) returns for
  // the springs of one row, where d = sum w_i of the values.
  template <class Force>
  auto forces_along(Force force_of) const;
  // Returns the force of add_turn_forces() along d.
  static auto turn_force(double seconds);
  template <class Force>
  void add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of);

  std::vector<Spring<N>> springs_;
  std::vector<Batch> batches_;
  std::vector<Dashpots<N, R>> dashpots_;  // by batch
  ScatterAdd sums_;
};

extern template class Springs<2>;
extern template class Springs<4>;
extern template class Springs<12, 3>;

/// Returns the viscosity (N s/m) at which a spring of stiffness `k` (N/m) is damped `fraction` times
/// critically.
///
///     2 f sqrt(k m),   1/m = sum w_i^2 / m_i
///
/// The particles have the given inverse masses (1/kg), 0 for infinite mass. Returns 0 if all masses are
/// infinite.
template <std::size_t N>
double critical_viscosity(double fraction, double k, const std::array<double, N>& weight,
                          const std::array<double, N>& inverse_mass);

extern template double critical_viscosity(double, double, const std::array<double, 2>&,
                                          const std::array<double, 2>&);
extern template double critical_viscosity(double, double, const std::array<double, 4>&,
                                          const std::array<double, 4>&);

}  // namespace duet
