// Linear tetrahedral finite elements of all deformable bodies, processed in batches of eight.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/base/matrix3.h"
#include "sim/base/types.h"
#include "sim/deformable/block_sums.h"
#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/compression_stiffness.h"
#include "sim/deformable/materials/material_model.h"
#include "sim/deformable/materials/stress_differential.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct LameParameters {
  double mu = 0, lambda = 0;  // Pa
  double damping = 0;         // s, viscous over elastic moduli
};
LameParameters lame_parameters(double youngs_modulus, double poisson_ratio, double damping);

struct ElasticMaterial {
  LameParameters moduli;
  MaterialModel model = MaterialModel::neo_hookean;
  double mass_damping = 0;      // 1/s, braking force over mass and velocity
  bool is_pressurized = false;  // pressures keep its volumes: steps stay within its elastic limit
};

class FiniteElements {
 public:
  // Adds the tets of a body (global particle indices) at their rest positions.
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest, const ElasticMaterial& material);
  // To be called once after the last add(): lays out the batches. `mass` gives the particles' masses.
  void finalize(const std::vector<double>& mass);

  std::size_t size() const { return tets_.size(); }
  // See BlockSums.
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }
  const std::vector<Tet>& tets() const { return tets_; }
  double volume(std::size_t tet) const { return volume_[tet]; }

  // Adds the elastic forces at `x` to `force` (N) and keeps the deformation gradients for damping_forces.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force);
  // Adds the viscous forces for the velocities `v` at the last deformation gradients: linear in v, symmetric,
  // and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // The same to about 1e-7 of the forces of each element, from half the memory; their sum is as exact. Not
  // with added damping.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // Adds every particle's own block of minus the operator of add_damping_forces, kg/s.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  // From now on damping holds what steps no longer follow, in materials that have it and whose model can tell
  // the two apart: elements that compression makes stiffer than any at rest bound the step no more, but are
  // damped, for as many seconds as the step takes (see set_time_step), in proportion to what they are too
  // stiff by, if their material's own damping is no less; and where that is tau seconds, what it damps does
  // not make the stability limit less than `relaxation` tau. `cfl` is the part of the limit that steps take.
  void rely_on_damping(double cfl, double relaxation);
  // The step, s, of the evaluations to come.
  void set_time_step(double dt) { dt_ = dt; }
  // Added to the damping of every material, s, as implicit integration does.
  void set_added_damping(double seconds) { added_damping_ = seconds; }
  // Adds the change of the elastic forces for displacements `dx` from where linearize() was last called:
  // linear in dx, symmetric, and (the Hessian of each element projected) negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  void linearize();                                 // at the last deformation gradients
  double energy(const std::vector<Vec3>& x) const;  // J
  // 1/s: the largest norm |Fdot| of the elements, or half the rate of J = det F where that is more, as in
  // elements that are drawn out to several times their size.
  double max_deformation_rate(const std::vector<Vec3>& x, const std::vector<Vec3>& v) const;

  struct Strain {
    double min_det = 1;
    int inverted = 0;        // elements with det F <= 0
    int worst_tet = -1;      // that has the least determinant
    double max_stretch = 1;  // largest principal one
  };
  Strain strain(const std::vector<Vec3>& x) const;
  // Raises `strain`, of all particles, to the largest |stretch - 1| of the elements around them (principal
  // stretches: singular values of F), and makes it `inverted` beside elements with det F <= 0.
  static constexpr float inverted = -1;
  void add_strain(const std::vector<Vec3>& x, std::vector<float>& strain) const;

  // A bound on the square of the highest frequency in the state of the last add_elastic_forces (at rest
  // before the first), rad^2/s^2: the largest mean over the elements around a particle, weighted by volume,
  // of the squares of their highest frequencies w_e. With the elements' shares M_e of the masses, K_e <=
  // w_e^2 M_e, so x.K x <= sum of w_e^2 x.M_e x, which is at most that mean of every particle times its share
  // of x.M x. A single crushed element counts for as much as it has of its particles' masses; the fastest
  // element by itself (Irons' theorem) would bound the step several times more.
  double max_squared_frequency() const { return max_squared_frequency_; }
  double rest_squared_frequency() const { return rest_squared_frequency_; }
  // The latter if damping held nothing.
  double elastic_squared_frequency() const { return elastic_squared_frequency_; }
  // For a resumed run: the next step's size depends on it.
  void set_max_squared_frequency(double value) { max_squared_frequency_ = value; }

  bool brakes() const { return !drag_.empty(); }  // whether any damping is in proportion to mass
  // kg/s, of mass-proportional damping on a particle.
  double drag(std::size_t particle) const { return drag_.empty() ? 0 : drag_[particle]; }

 private:
  static constexpr std::size_t corners = 4;
  struct Batch {  // eight elements of one material
    std::array<PackIndex, 4> particle;
    std::array<BlockSums::Slot, 4> slot;
    Matrix3<Pack> inverse_rest;  // D_m^-1, 1/m
    Pack volume;                 // m^3; zero in the lanes that pad the last batch of a material
  };
  struct SingleBatch {  // what the viscosity of a batch comes from, in single precision
    std::array<BlockSums::Slot, 4> slot;
    Matrix3<PackF> inverse_rest, F;
    PackF share;  // m^3, the volume by excess_damping
  };
  struct Moduli {
    Pack mu, lambda;  // Pa
  };
  const ElasticMaterial& material_of_batch(std::size_t batch) const {
    return material_[static_cast<std::size_t>(batch_material_[batch])];
  }
  Moduli moduli(std::size_t batch) const {
    const LameParameters& of_all = material_of_batch(batch).moduli;
    return {Pack{} + of_all.mu, Pack{} + of_all.lambda};
  }
  MaterialModel model(std::size_t batch) const { return material_of_batch(batch).model; }
  GradientScatter<double> scatter(std::size_t tet, const std::vector<double>& mass) const;
  void fill_lane(std::size_t number, std::size_t tet, bool pads, const GradientScatter<double>& scatter);
  // F for positions, its rate for velocities: of all particles, or at the batch's slots.
  Matrix3<Pack> gradient(const Batch& batch, const std::vector<Vec3>& values) const;
  Matrix3<Pack> gradient(const Batch& batch, const Quad* rows) const;
  void keep_deformation(std::size_t batch, const Matrix3<Pack>& F);
  void spread_damping(std::size_t batch, Quad* sums) const;
  void spread_forces(const Batch& batch, const Matrix3<Pack>& stress, const Pack& fourth, Quad* sums) const;
  Pack elastic_at_rest(std::size_t batch) const;
  double relaxed_squared_frequency(std::size_t batch) const;
  double bound_at_rest();
  template <class Model>
  Pack squared_frequency(Model, std::size_t batch, const Matrix3<Pack>& F);
  template <class Model>
  void damp_compression(Model, std::size_t batch, const Matrix3<Pack>& F, const Pack& seconds);
  template <class Model>
  Pack lifted_squared_frequency(Model, std::size_t batch, const Matrix3<Pack>& F, const Pack& squared,
                                const Pack& soft, const Pack& bound);
  Matrix3<Pack> damping_stress(std::size_t batch, const Matrix3<Pack>& Fdot) const;
  void add_drag(const std::vector<Vec3>& v, std::vector<Vec3>& force) const;

  std::vector<Tet> tets_;
  std::vector<Mat3> inverse_rest_;
  std::vector<double> volume_;
  std::vector<ElasticMaterial> material_;  // of the bodies, in the order they were added
  std::vector<int> material_of_;           // by tet
  std::vector<double> drag_;               // kg/s, by particle; empty without mass-proportional damping

  std::vector<Batch> batches_;
  std::vector<SingleBatch> single_;                     // of each batch
  std::vector<int> batch_material_;                     // of each batch
  std::vector<GradientScatter<Pack>> scatter_;          // of each batch
  std::vector<Matrix3<Pack>> deformation_;              // F of each batch
  std::vector<StressDifferential<Pack>> differential_;  // of each batch, once linearized
  BlockSums sums_;
  std::vector<double> particle_volume_;          // m^3, of the elements around each
  std::vector<double> particle_frequency_;       // rad^2/s^2, the mean around each
  std::vector<Pack> allowed_squared_frequency_;  // rad^2/s^2, of each batch: what leaves the bound at rest
  // Of each batch that is damped in compression: its viscosity, Pa s, and minus its volume times that, N m s.
  std::vector<CompressionStiffness<Pack>> compression_viscosity_;
  std::vector<CompressionStiffness<PackF>> single_compression_;
  std::vector<char> is_damped_;  // whether any lane of a batch is, in compression
  double cfl_ = 0;               // 0: damping holds nothing, all elements bound the step
  double relaxation_ = 0;        // least limit of what damping holds, over its time
  double dt_ = 0;
  double added_damping_ = 0;
  double max_squared_frequency_ = 0, rest_squared_frequency_ = 0, elastic_squared_frequency_ = 0;
};

}  // namespace duet
