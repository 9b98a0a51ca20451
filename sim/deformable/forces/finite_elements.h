// Linear tetrahedral finite elements of all deformable bodies, evaluated in batches of eight.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/base/matrix3.h"
#include "sim/base/types.h"
#include "sim/deformable/forces/particle_blocks.h"
#include "sim/deformable/forces/turn.h"
#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/compression_stiffness.h"
#include "sim/deformable/materials/material_model.h"
#include "sim/deformable/materials/stress_differential.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/deformable/scatter_add.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Elastic and viscous moduli of an isotropic material.
struct LameParameters {
  double mu = 0,       ///< Pa, shear modulus (second Lamé parameter)
      lambda = 0;      ///< Pa, first Lamé parameter
  double damping = 0;  ///< s, damping time: ratio of viscous to elastic moduli
};
/// Returns the moduli for a Young's modulus (Pa), a Poisson ratio (less than 1/2) and a damping time (s).
LameParameters lame_parameters(double youngs_modulus, double poisson_ratio, double damping);

/// Material of a body of finite elements.
struct ElasticMaterial {
  LameParameters moduli;                             ///< elastic and viscous moduli
  MaterialModel model = MaterialModel::neo_hookean;  ///< form of the elastic energy
  double mass_damping = 0;                           ///< 1/s, braking force over own mass and velocity
  /// whether pressures keep its volumes; steps then stay within its elastic limit
  bool is_pressurized = false;
};

/// Elastic and viscous forces of the tetrahedra of all volumes, and bounds on their frequencies.
class FiniteElements {
 public:
  /// Adds the tetrahedra of a body (global particle indices) at their rest positions (m).
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest, const ElasticMaterial& material);
  /// Lays out the batches. Must be called once after the last add().
  ///
  /// `mass` (kg) has the inertia that a force on each particle meets: that of its bone for a particle which a
  /// bone carries. `own_mass` (kg) has the mass of the material around each particle, which mass-proportional
  /// damping brakes.
  ///
  /// `outer_omega_squared` (rad^2/s^2) bounds what other forces on each particle add to the bounds
  /// max_omega_squared() and so on; it is empty if there are none.
  void finalize(const std::vector<double>& mass, const std::vector<double>& own_mass,
                std::vector<double> outer_omega_squared);

  /// Returns the number of tetrahedra.
  std::size_t size() const { return tets_.size(); }
  /// Restricts the sums below to the particles of `mask` until the next call; null removes the restriction
  /// (ScatterAdd::limit_to()).
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }
  /// Returns the tetrahedra of all bodies, in the order in which they were added.
  const std::vector<Tet>& tets() const { return tets_; }
  /// Returns the volume of a tetrahedron at rest, m^3.
  double volume(std::size_t tet) const { return volume_[tet]; }

  /// Adds the elastic forces at the positions `x` (m) to `force` (N) and keeps the deformation gradients for
  /// damping and linearize().
  ///
  /// It also computes the bound max_omega_squared() and decides which compressed elements are damped
  /// (rely_on_damping()).
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force, const Turn* turn = nullptr);
  /// Adds the viscous forces for the velocities `v` (m/s) at the last deformation gradients to `force` (N):
  /// linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds the change of the viscous forces between the state of the last add_elastic_forces() and `seconds`
  /// later, for particles that keep the velocities `v` (m/s), to `force` (N).
  ///
  /// For an element that turns by the angular velocity w (spin_of_columns()), the strain rate sym(F^T F') of
  /// velocities that have turned for t seconds lacks
  ///
  ///     (w x F)^T (w x F) t / sqrt(1 + w^2 t^2),
  ///
  /// so that they seem to shrink it. Damping of compression and mass-proportional damping are left as they
  /// are. So are pressurized elements: at rest their pressures push particles to and fro in every step, which
  /// is no turn.
  void add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force);
  /// Adds the turn forces that the last add_elastic_forces() has computed (Turn) to `force` (N).
  void add_kept_turn_forces(std::vector<Vec3>& force) const { sums_.add_kept_to(force); }
  /// Adds the viscous forces in single precision: to about 1e-7 of the forces of each element, with half the
  /// memory traffic.
  ///
  /// The forces of an element still add up to zero as in double precision. Added damping
  /// (set_added_damping()) is not included, so it must be 0.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds each particle's own 3x3 block of minus the operator of add_damping_forces() to `blocks`, kg/s.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  /// Lets damping hold stiff elements instead of the time step following them, from now on.
  ///
  /// This concerns materials with damping of tau seconds whose model can tell the two kinds of stiffness
  /// apart (neo-Hookean). There are two effects:
  ///
  /// 1) Elements that compression makes stiffer than any at rest no longer bound the step if tau is at least
  /// the step at rest. They are damped in proportion to the stiffness that exceeds the bound, for as many
  /// seconds as the step takes (set_time_step()).
  ///
  /// 2) Stiffness that damping holds does not lower the stability limit below `relaxation` times tau.
  ///
  /// `cfl` is the fraction of the stability limit that steps take. 0 for `cfl` turns the first effect off, 0
  /// for `relaxation` the second.
  void rely_on_damping(double cfl, double relaxation);
  /// Sets the time step `dt` (s) of the evaluations to come, and the coefficients of mass-proportional
  /// damping for them. If steps evaluate it at their fraction `at`, the coefficient is the one with which a
  /// step multiplies the velocity by exp(-c dt), the exact factor for the damping rate c (1/s):
  ///
  ///     c' = (1 - E) / ((1 - at) + at E) / dt,     E = exp(-c dt)
  ///
  /// Without `at` it is c.
  void set_time_step(double dt, std::optional<double> at = {});
  /// Sets a damping time (s) that is added to that of every material, as implicit integration does.
  ///
  /// While it is positive, stretched elements keep the whole viscosity and compressed ones lose that of their
  /// volume.
  void set_added_damping(double seconds) { added_damping_ = seconds; }
  /// Adds the change of the elastic forces for displacements `dx` (m) from the state of the last linearize()
  /// to `force` (N).
  ///
  /// It is linear in dx, symmetric and negative semi-definite, because the Hessian of each element is
  /// projected.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  /// Appends the blocks of the matrix of these forces in the state of the last add_elastic_forces(),
  /// with elasticity that of the last linearize().
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Computes the stress differentials at the last deformation gradients.
  void linearize();
  /// Returns the elastic energy at the positions `x` (m), J.
  double energy(const std::vector<Vec3>& x) const;
  /// Returns the largest rate of deformation of an element at the positions `x` (m) and velocities `v` (m/s),
  /// 1/s.
  ///
  ///     max over the elements of max(|Fdot|, |dJ/dt| / 2),   J = det F
  ///
  /// The rate of volume is the larger one in elements that are stretched to several times their size.
  double max_deformation_rate(const std::vector<Vec3>& x, const std::vector<Vec3>& v) const;
  /// Returns a particle of the element that deforms fastest, by the measure of max_deformation_rate(); -1
  /// without elements.
  int fastest_particle(const std::vector<Vec3>& x, const std::vector<Vec3>& v) const;
  /// Returns the particle that max_omega_squared() is about; -1 without elements.
  int stiffest_particle() const;

  /// Strain statistics of all elements.
  struct Strain {
    double min_det = 1;      ///< smallest det F
    int inverted = 0;        ///< number of elements with det F <= 0
    int worst_tet = -1;      ///< index of the element with the smallest det F; -1: none
    double max_stretch = 1;  ///< largest principal stretch, at least 1
  };
  /// Returns the strain statistics at the positions `x` (m).
  Strain strain(const std::vector<Vec3>& x) const;
  /// Value that add_strain() gives to particles of inverted elements.
  static constexpr float inverted = -1;
  /// Raises each particle's entry of `strain` to the largest |stretch - 1| of the elements around it, with
  /// the principal stretches of F.
  ///
  /// Entries of particles of elements with det F <= 0 become `inverted`.
  void add_strain(const std::vector<Vec3>& x, std::vector<float>& strain) const;

  /// Sets each particle's entries of `stress` (Pa) and `energy` (J/m^3) to the means over the elements around
  /// it, weighted by their volumes at rest; 0 without elements.
  ///
  /// The stress of an element is von Mises' equivalent sqrt(3/2 s : s) of the elastic Cauchy stress
  /// sigma = P F^T / det F with s = sigma - tr(sigma)/3, its energy the elastic energy over the volume at
  /// rest. The stress of inverted elements is left out.
  void measure_stress(const std::vector<Vec3>& x, std::vector<float>& stress,
                      std::vector<float>& energy) const;

  /// Returns an upper bound on the square of the highest angular frequency in the state of the last
  /// add_elastic_forces(), or at rest before the first, rad^2/s^2.
  ///
  ///     max over the particles of (h + sum V_e w_e^2 / sum V_e),   sums over the elements e around a
  ///     particle
  ///
  /// V_e is the volume of an element at rest and w_e a bound on its highest frequency. The elements' parts
  /// M_e of the masses satisfy K_e <= w_e^2 M_e, so x.K x is at most the sum of w_e^2 x.M_e x, which is at
  /// most the largest of these means times x.M x. Other forces on the particle, with K_o <= h M, add their h
  /// (finalize()). A single compressed element counts only by its fraction of its particles' masses; the
  /// fastest element by itself (Irons' theorem) would make the step several times shorter. Stiffness that
  /// damping holds is left out (rely_on_damping()).
  double max_omega_squared() const { return max_omega_squared_; }
  /// Returns the bound of max_omega_squared() at rest, rad^2/s^2.
  double rest_omega_squared() const { return rest_omega_squared_; }
  /// Returns the bound of max_omega_squared() at rest without the help of damping, rad^2/s^2.
  double elastic_omega_squared() const { return elastic_omega_squared_; }
  /// Sets the bound of max_omega_squared() for a resumed run, whose next step size depends on it.
  void set_max_omega_squared(double value) { max_omega_squared_ = value; }

  /// Returns whether any material has mass-proportional damping.
  bool brakes() const { return !drag_.empty(); }
  /// Returns the coefficient of mass-proportional damping of a particle, kg/s, see set_time_step().
  double drag(std::size_t particle) const { return drag_.empty() ? 0 : drag_[particle]; }

 private:
  static constexpr std::size_t corners = 4;
  // Eight elements of one material.
  struct Batch {
    std::array<PackIndex, 4> particle;
    std::array<ScatterAdd::Slot, 4> slot;
    Matrix3<double8> inverse_rest;  // D_m^-1, 1/m
    double8 volume;                 // m^3; zero in the lanes that pad the last batch of a material
  };
  // The data of a batch from which its viscous forces follow, in single precision.
  struct SingleBatch {
    std::array<ScatterAdd::Slot, 4> slot;
    Matrix3<float8> inverse_rest, F;
    float8 share;  // m^3, the volume divided by excess_damping()
  };
  // Moduli of a batch, the same in all lanes.
  struct Moduli {
    double8 mu, lambda;  // Pa
  };
  const ElasticMaterial& material_of_batch(std::size_t batch) const {
    return material_[static_cast<std::size_t>(batch_material_[batch])];
  }
  Moduli moduli(std::size_t batch) const {
    const LameParameters& of_all = material_of_batch(batch).moduli;
    return {double8{} + of_all.mu, double8{} + of_all.lambda};
  }
  MaterialModel model(std::size_t batch) const { return material_of_batch(batch).model; }
  // Returns the scatter matrix of a tetrahedron, whose nodes have its share, by volume, of their particles'
  // masses.
  GradientScatter<double> scatter(std::size_t tet, const std::vector<double>& mass) const;
  // Returns the squared rates of deformation of the elements of a batch, see max_deformation_rate(), 1/s^2.
  double8 squared_rates(const Batch& batch, const std::vector<Vec3>& x, const std::vector<Vec3>& v) const;
  // Puts a tetrahedron into lane `number`, counted over all batches. `volume` (m^3) is its own, or 0 in the
  // lanes that fill up the last batch of a material.
  void fill_lane(std::size_t number, std::size_t tet, double volume, const GradientScatter<double>& scatter);
  // Return the deformation gradient for positions and its rate for velocities, from the values of all
  // particles or from the rows of a block.
  Matrix3<double8> gradient(const Batch& batch, const std::vector<Vec3>& values) const;
  Matrix3<double8> gradient(const Batch& batch, const double4* rows) const;
  // Stores F of a batch in double and single precision.
  void keep_deformation(std::size_t batch, const Matrix3<double8>& F);
  // Adds the damping blocks of a batch's particles to the partial sums.
  void spread_damping(std::size_t batch, double4* sums) const;
  // Adds the forces of the stress (Pa) to the partial sums, with `fourth` for every corner.
  void spread_forces(const Batch& batch, const Matrix3<double8>& stress, const double8& fourth,
                     double4* sums) const;
  // Returns the omega^2 bound of each element of a batch at rest, without the help of damping, rad^2/s^2.
  double8 elastic_at_rest(std::size_t batch) const;
  // Returns the omega^2 bound that a step of relaxation_ times the batch's damping time stands for,
  // rad^2/s^2; infinite if there is none.
  double relaxed_omega_squared_of(std::size_t batch) const;
  // Computes particle_frequency_ at rest and returns its largest entry, rad^2/s^2.
  double bound_at_rest();
  // Returns the omega^2 bound of other forces on a particle, rad^2/s^2.
  double outer_omega_squared(std::size_t particle) const {
    return outer_omega_squared_.empty() ? 0 : outer_omega_squared_[particle];
  }
  // Returns the omega^2 bounds (rad^2/s^2) of a batch in state F, as far as they are to bound the step, and
  // chooses the damping of compressed elements.
  template <class Model>
  double8 omega_squared(Model, std::size_t batch, const Matrix3<double8>& F);
  // Damps the stiffness that compression adds to a batch with `seconds` of it.
  template <class Model>
  void damp_compression(Model, std::size_t batch, const Matrix3<double8>& F, const double8& seconds);
  // Returns the bounds of omega_squared() where steps may exceed the elastic limit.
  template <class Model>
  double8 relaxed_omega_squared(Model, std::size_t batch, const Matrix3<double8>& F, const double8& squared,
                                const double8& soft, const double8& bound);
  // Adds the forces of add_turn_forces() for the velocities `rows` (m/s) to the partial sums.
  void spread_turn(std::size_t batch, const double4* rows, double seconds, double4* sums) const;
  // Returns the viscous stress of a batch for the rate `Fdot` (1/s), Pa.
  Matrix3<double8> damping_stress(std::size_t batch, const Matrix3<double8>& Fdot) const;
  // Returns its part that is a function of the strain rate sym(A), 1/s.
  Matrix3<double8> stress_of_rate(std::size_t batch, const Matrix3<double8>& A) const;
  // Adds the forces of mass-proportional damping.
  void add_drag(const std::vector<Vec3>& v, std::vector<Vec3>& force) const;

  std::vector<Tet> tets_;
  std::vector<Mat3> inverse_rest_;         // 1/m, D_m^-1 by tetrahedron
  std::vector<double> volume_;             // m^3, by tetrahedron
  std::vector<ElasticMaterial> material_;  // by body, in the order in which they were added
  std::vector<int> material_of_;           // index into material_, by tetrahedron
  std::vector<double> drag_;               // kg/s, by particle; empty without mass-proportional damping
  std::vector<double> drag_rate_,          // 1/s, by particle as drag_: the damping rate c
      drag_mass_;                          // kg, by particle as drag_: the mass that it brakes

  std::vector<Batch> batches_;
  std::vector<SingleBatch> single_;                        // by batch
  std::vector<int> batch_material_;                        // index into material_, by batch
  std::vector<GradientScatter<double8>> scatter_;          // by batch
  std::vector<Matrix3<double8>> deformation_;              // F, by batch
  std::vector<StressDifferential<double8>> differential_;  // by batch, once linearized
  ScatterAdd sums_;
  std::vector<double> particle_volume_;  // m^3, sum over the elements around each particle
  // rad^2/s^2, by particle of elements: mean over the elements around it, plus the bound of other forces on
  // it; 0 for other particles.
  std::vector<double> particle_frequency_;
  std::vector<double> outer_omega_squared_;     // rad^2/s^2, by particle: bound of other forces; empty: none
  double max_outer_omega_squared_ = 0;          // rad^2/s^2, its largest entry
  std::vector<double8> allowed_omega_squared_;  // rad^2/s^2, by batch: what keeps the bound at rest
  // For each batch that is damped in compression: its viscosity (Pa s), and minus its volume times that (N m
  // s).
  std::vector<CompressionStiffness<double8>> compression_viscosity_;
  std::vector<CompressionStiffness<float8>> single_compression_;
  std::vector<char> is_damped_;  // by batch: whether any lane is damped in compression
  double cfl_ = 0;               // fraction of the limit that steps take; 0: all elements bound the step
  double relaxation_ = 0;        // smallest limit of what damping holds, over its damping time
  double dt_ = 0;                // s
  double added_damping_ = 0;     // s
  double max_omega_squared_ = 0, rest_omega_squared_ = 0, elastic_omega_squared_ = 0;
};

}  // namespace duet
