#include "sim/deformable/forces/finite_elements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/LU>

#include "sim/base/dense_solvers.h"
#include "sim/base/elementary.h"
#include "sim/base/parallel.h"
#include "sim/deformable/forces/element_kernels.h"
#include "sim/deformable/forces/tet_strain.h"
#include "sim/deformable/materials/viscous_stress.h"
#include "sim/deformable/materials/with_model.h"

namespace duet {
namespace {

// Damping time, in steps, of the stiffness that compression adds beyond what the step follows. Half a step
// would be stable for a stiffness that stays as it is. One step brings an element to rest as a step of
// Newton's method would. The value lies between, because an element may become stiffer yet within the step.
constexpr double compression_steps = 0.75;
// Squared frequency up to which the step follows an element that compression stiffens, relative to the one
// that it may have at rest. The step falls to 1/sqrt(followed_stiffening) = 0.7 of that at rest; a larger
// value makes it shorter yet. With 2, impacts between soft bodies remain as accurate as without the limit.
constexpr double followed_stiffening = 2;
// Number of particles in a chunk of a parallel loop.
constexpr std::size_t particle_grain = 512;

// True for models that can tell the stiffness that damping can hold from the rest.
template <class Model>
constexpr bool can_rely_on_damping = requires(double8 modulus, Matrix3<double8> F) {
  Model::compression_stiffness(modulus, modulus, F);
};

// Returns the fraction of the viscosity of volume that compressed and inverted elements keep in implicit
// steps: all of it down to J = 1/4, none from J = 0 on. On their way back they change the trace of the Green
// strain. A nearly incompressible material would let them do so only over lambda / mu times the damping time.
// Explicit elasticity needs all of the viscosity to hold such elements.
double8 volume_share(const Matrix3<double8>& F) {
  const double8 share = max_of(4.0 * determinant(F, cofactor(F)), double8{});
  return select(share < double8{} + 1.0, share, double8{} + 1.0);
}

// Returns the damping time `seconds` (s) of a material, limited so that double precision can still tell
// velocities in a body that is almost rigid within a step from rounding. `rate` is the step times the highest
// omega^2, 1/s. Only damping times of hours reach the limit, except in the stiffest and smallest
// elements.
double bounded_damping(double seconds, double rate) {
  // Largest factor by which damping may slow a particle by itself in a step.
  constexpr double most = 1e9;
  return seconds * rate > most ? most / rate : seconds;
}

}  // namespace

LameParameters lame_parameters(double youngs_modulus, double poisson_ratio, double damping) {
  const double nu = poisson_ratio;
  return {youngs_modulus / (2 * (1 + nu)), youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu)), damping};
}

void FiniteElements::add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest,
                         const ElasticMaterial& material) {
  for (const Tet& tet : tets) {
    const Mat3 edges = edge_matrix(tet, rest);
    tets_.push_back(tet);
    inverse_rest_.push_back(edges.inverse());
    volume_.push_back(edges.determinant() / 6);
    material_of_.push_back(static_cast<int>(material_.size()));
  }
  material_.push_back(material);
}

void FiniteElements::finalize(const std::vector<double>& mass, const std::vector<double>& own_mass,
                              std::vector<double> outer_omega_squared) {
  outer_omega_squared_ = std::move(outer_omega_squared);
  max_outer_omega_squared_ = 0;
  for (const double outer : outer_omega_squared_)
    max_outer_omega_squared_ = std::max(max_outer_omega_squared_, outer);
  particle_volume_.assign(mass.size(), 0);
  particle_frequency_.assign(mass.size(), 0);
  for (std::size_t t = 0; t < tets_.size(); ++t)
    for (int p : tets_[t]) particle_volume_[as_index(p)] += volume_[t];
  std::size_t lanes = 0;
  // Each pass fills the batches of one material.
  for (std::size_t begin = 0, end = 0; begin < tets_.size(); begin = end) {
    for (; end < tets_.size() && material_of_[end] == material_of_[begin]; ++end)
      fill_lane(lanes++, end, volume_[end], scatter(end, mass));
    for (; lanes % pack_width > 0; ++lanes) fill_lane(lanes, end - 1, 0, scatter(end - 1, mass));
  }
  deformation_.resize(batches_.size());
  compression_viscosity_.resize(batches_.size());
  single_compression_.resize(batches_.size());
  is_damped_.resize(batches_.size());
  sums_.build(batches_, mass.size());
  single_.resize(batches_.size());
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    single_[b].slot = batches_[b].slot;
    single_[b].inverse_rest = to_single(batches_[b].inverse_rest);
  }

  elastic_omega_squared_ = bound_at_rest();
  rely_on_damping(0, 0);

  for (std::size_t t = 0; t < tets_.size(); ++t) {
    const double rate = material_[as_index(material_of_[t])].mass_damping;
    if (rate == 0) continue;
    for (std::vector<double>* values : {&drag_, &drag_rate_, &drag_mass_}) values->resize(mass.size(), 0);
    for (int p : tets_[t]) {
      drag_rate_[as_index(p)] = rate;
      drag_mass_[as_index(p)] = own_mass[as_index(p)];
      drag_[as_index(p)] = rate * own_mass[as_index(p)];
    }
  }
}

void FiniteElements::set_time_step(double dt, std::optional<double> at) {
  dt_ = dt;
  double rate = 0, fitted = 0;  // 1/s: those of the last particle, which the next one mostly shares
  for (std::size_t p = 0; p < drag_.size(); ++p) {
    if (drag_rate_[p] != rate) {
      rate = fitted = drag_rate_[p];
      const double rest = math::exp(-rate * dt);
      if (at) fitted = (1 - rest) / ((1 - *at) + *at * rest) / dt;
    }
    drag_[p] = fitted * drag_mass_[p];
  }
}

void FiniteElements::rely_on_damping(double cfl, double relaxation) {
  cfl_ = cfl;
  relaxation_ = relaxation;
  max_omega_squared_ = rest_omega_squared_ = bound_at_rest();
  // An element may become stiffer by the ratio of the bound to the mean frequency around its particles, if
  // that is lower.
  allowed_omega_squared_.resize(batches_.size());
  for (std::size_t b = 0; b < batches_.size(); ++b)
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      double mean = std::numeric_limits<double>::min();
      for (const PackIndex& particle : batches_[b].particle)
        mean = std::max(mean, particle_frequency_[as_index(particle[lane])]);
      const double room = std::max(rest_omega_squared_ / mean, 1.0);
      allowed_omega_squared_[b][lane] = followed_stiffening * room * elastic_at_rest(b)[lane];
    }
}

double8 FiniteElements::elastic_at_rest(std::size_t b) const {
  const Moduli here = moduli(b);
  return batches_[b].volume * scatter_[b].at_rest(here.mu, here.lambda);
}

// For stiffness that damping holds only the relaxed limit counts.
double FiniteElements::bound_at_rest() {
  for (std::size_t p = 0; p < particle_frequency_.size(); ++p)
    particle_frequency_[p] = particle_volume_[p] > 0 ? outer_omega_squared(p) : 0;
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    const Moduli here = moduli(b);
    double8 squared = elastic_at_rest(b);
    with_model(model(b), [&]<class Model>(Model) {
      if constexpr (can_rely_on_damping<Model>) {
        Matrix3<double8> rest{};
        for (int i = 0; i < 3; ++i) rest[i][i] = double8{} + 1.0;
        const double8 soft = Model::uncompressed_omega_squared(here.mu, here.lambda, rest, scatter_[b]);
        squared = min_of(squared, max_of(batch.volume * soft, double8{} + relaxed_omega_squared_of(b)));
      }
    });
    for (std::size_t lane = 0; lane < pack_width; ++lane)
      for (const PackIndex& particle : batch.particle) {
        const std::size_t p = as_index(particle[lane]);
        particle_frequency_[p] += batch.volume[lane] / particle_volume_[p] * squared[lane];
      }
  }
  const auto largest = std::max_element(particle_frequency_.begin(), particle_frequency_.end());
  return largest == particle_frequency_.end() ? 0 : *largest;
}

//     omega^2 = 4 / (relaxation tau)^2
// Here tau is the damping time of the batch's material. Elements that would bound the step more tightly by
// themselves are bounded by this instead.
double FiniteElements::relaxed_omega_squared_of(std::size_t b) const {
  const ElasticMaterial& material = material_of_batch(b);
  const double reach = relaxation_ * material.moduli.damping;
  if (reach <= 0 || material.is_pressurized) return std::numeric_limits<double>::infinity();
  return 4 / (reach * reach);
}

// Every node has the element's fraction, by volume, of its particle's mass.
GradientScatter<double> FiniteElements::scatter(std::size_t t, const std::vector<double>& mass) const {
  Mat3 sum = Mat3::Zero();
  for (std::size_t i = 0; i < corners; ++i) {
    const std::size_t p = as_index(tets_[t][i]);
    const Vec3 gradient = i == 0 ? Vec3(-inverse_rest_[t].colwise().sum().transpose())
                                 : Vec3(inverse_rest_[t].row(static_cast<Eigen::Index>(i) - 1).transpose());
    sum += gradient * gradient.transpose() * particle_volume_[p] / (mass[p] * volume_[t]);
  }
  GradientScatter<double> scatter;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) scatter.S[i][j] = sum(i, j);
  scatter.largest = symmetric_eigen<3>(sum).values[2];
  return scatter;
}

void FiniteElements::fill_lane(std::size_t number, std::size_t t, double volume,
                               const GradientScatter<double>& scatter) {
  const std::size_t lane = number % pack_width;
  if (lane == 0) {
    batches_.emplace_back();
    scatter_.emplace_back();
    batch_material_.push_back(material_of_[t]);
  }
  Batch& batch = batches_.back();
  for (std::size_t i = 0; i < corners; ++i) batch.particle[i][lane] = tets_[t][i];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) batch.inverse_rest[i][j][lane] = inverse_rest_[t](i, j);
  batch.volume[lane] = volume;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) scatter_.back().S[i][j][lane] = scatter.S[i][j];
  scatter_.back().largest[lane] = scatter.largest;
}

Matrix3<double8> FiniteElements::gradient(const Batch& batch, const std::vector<Vec3>& values) const {
  return gradient_of(batch.inverse_rest, [&](std::size_t i) { return gather(values, batch.particle[i]); });
}

Matrix3<double8> FiniteElements::gradient(const Batch& batch, const double4* rows) const {
  return gradient_of(batch.inverse_rest,
                     [&](std::size_t i) { return ScatterAdd::gather(rows, batch.slot[i]); });
}

void FiniteElements::keep_deformation(std::size_t b, const Matrix3<double8>& F) {
  deformation_[b] = F;
  single_[b].F = to_single(F);
  single_[b].share = to_single(batches_[b].volume / excess_damping(F));
}

//     H = -V P D_m^-T
// The columns of H are the forces on particles 1 to 3; particle 0 gets minus their sum.
void FiniteElements::spread_forces(const Batch& batch, const Matrix3<double8>& stress, const double8& fourth,
                                   double4* sums) const {
  spread_columns(-batch.volume * times_transposed(stress, batch.inverse_rest), fourth, batch.slot, sums);
}

// The operator is kept for all products of the step.
template <class Model>
void FiniteElements::damp_compression(Model, std::size_t b, const Matrix3<double8>& F,
                                      const double8& seconds) {
  is_damped_[b] = any_of(double8{} < seconds);
  if (!is_damped_[b]) return;
  const Moduli here = moduli(b);
  CompressionStiffness<double8>& viscosity = compression_viscosity_[b];
  viscosity = Model::compression_stiffness(here.mu, here.lambda, F);
  viscosity.shear *= seconds;
  viscosity.bulk *= seconds;
  const double8& volume = batches_[b].volume;
  single_compression_[b] = {to_single(viscosity.inverse), to_single(-volume * viscosity.shear),
                            to_single(-volume * viscosity.bulk)};
}

// In the scheme of steps I and V (elasticity explicit, damping implicit) a mode of frequency w with tau
// seconds of stiffness-proportional damping is stable in every step of dt <= 2 tau, however large w dt is.
template <class Model>
double8 FiniteElements::omega_squared(Model, std::size_t b, const Matrix3<double8>& F) {
  const Batch& batch = batches_[b];
  const Moduli here = moduli(b);
  const double8 &mu = here.mu, &lambda = here.lambda;
  const double8 squared = batch.volume * Model::omega_squared(mu, lambda, F, scatter_[b]);
  is_damped_[b] = false;
  if constexpr (can_rely_on_damping<Model>) {
    const double own = material_of_batch(b).moduli.damping;
    if (cfl_ == 0 || own < 2 * cfl_ / std::sqrt(rest_omega_squared_)) return squared;
    const double8 soft = batch.volume * Model::uncompressed_omega_squared(mu, lambda, F, scatter_[b]);
    const double8 bound = max_of(allowed_omega_squared_[b], soft);
    if (relaxed_omega_squared_of(b) < elastic_omega_squared_)
      return relaxed_omega_squared(Model{}, b, F, squared, soft, bound);
    if (!any_of(bound < squared)) return squared;
    // If some other bound has made this step shorter, it follows stiffer elements.
    const double within_reach = 4 * cfl_ * cfl_ / (dt_ * dt_);
    const double more = std::max(within_reach / (followed_stiffening * rest_omega_squared_), 1.0);
    const double8 share =
        1.0 - more * bound / max_of(squared, double8{} + std::numeric_limits<double>::min());
    damp_compression(Model{}, b, F, compression_steps * std::min(dt_, own) * max_of(share, double8{}));
    return min_of(bound, squared);
  }
  return squared;
}

// The step does not follow all stiffness here. The material's own damping holds what it can, and the rest is
// damped more, until a step of relaxation does not overshoot (K dt <= D). That is twice what stability
// requires, because compressed elements become stiffer yet within a step. Damping resists changes of strain
// only. Two kinds of stiffness therefore bound the step: shears that stress alone resists together with what
// stretching makes stiffer (`soft`), and elements compressed beyond the start of extrapolation (up to
// `bound`), because tangles come apart only in steps that follow them.
template <class Model>
double8 FiniteElements::relaxed_omega_squared(Model, std::size_t b, const Matrix3<double8>& F,
                                              const double8& squared, const double8& soft,
                                              const double8& bound) {
  const mask8 is_extrapolated = determinant(F, cofactor(F)) < double8{} + Model::extrapolation_start;
  const double8 within_reach =
      double8{} + std::max(4 * cfl_ * cfl_ / (dt_ * dt_) - max_outer_omega_squared_, 0.0);
  if (any_of(within_reach < squared)) {
    const Moduli here = moduli(b);
    const double own = material_of_batch(b).moduli.damping;
    const double8 needed = (dt_ / own) * Model::compression_over_viscosity(here.mu, here.lambda, F);
    const double8 held = within_reach / max_of(squared, double8{} + std::numeric_limits<double>::min()) +
                         select(is_extrapolated, double8{}, 1.0 / needed);
    damp_compression(Model{}, b, F, std::min(dt_, own) * max_of(1.0 - held, double8{}));
  }
  const double8 relaxed = max_of(double8{} + relaxed_omega_squared_of(b), soft);
  return min_of(squared, select(is_extrapolated, bound, relaxed));
}

void FiniteElements::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                                        const Turn* turn) {
  if (tets_.empty()) return;
  const auto elastic = [&](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_, scatter_, deformation_, single_);
    const Batch& batch = batches_[b];
    const Matrix3<double8> F = gradient(batch, rows);
    keep_deformation(b, F);
    const Moduli here = moduli(b);
    const double8 &mu = here.mu, &lambda = here.lambda;
    with_model(model(b), [&]<class Model>(Model) {
      const double8 weighted_frequency = batch.volume * omega_squared(Model{}, b, F);
      spread_forces(batch, Model::stress(mu, lambda, F), weighted_frequency, sums);
    });
  };
  if (turn)
    sums_.fill_both_from(x, elastic, turn->v, [&](std::size_t b, const double4* rows, double4* sums) {
      spread_turn(b, rows, turn->seconds, sums);
    });
  else
    sums_.fill_from(x, elastic);
  sums_.for_each([&](std::size_t p, const std::array<double4, 1>& sum) {
    force[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
    particle_frequency_[p] = outer_omega_squared(p) + sum[0][3] / particle_volume_[p];
  });
  max_omega_squared_ = *std::max_element(particle_frequency_.begin(), particle_frequency_.end());
}

Matrix3<double8> FiniteElements::stress_of_rate(std::size_t b, const Matrix3<double8>& A) const {
  const Matrix3<double8>& F = deformation_[b];
  const Moduli here = moduli(b);
  const double8 &mu = here.mu, &lambda = here.lambda;
  const double8 damping =
      double8{} +
      (bounded_damping(material_of_batch(b).moduli.damping, dt_ * elastic_omega_squared_) + added_damping_);
  // With added damping steps are as long as frames, and the greater viscosity of stretched elements smooths
  // their way out of a tangle.
  if (added_damping_ > 0) return stress_of_strain_rate<double8>(mu, volume_share(F) * lambda, damping, F, A);
  return stress_of_strain_rate<double8>(mu, lambda, damping / excess_damping(F), F, A);
}

Matrix3<double8> FiniteElements::damping_stress(std::size_t b, const Matrix3<double8>& Fdot) const {
  const Matrix3<double8> stress = stress_of_rate(b, transposed_times(deformation_[b], Fdot));
  if (added_damping_ > 0 || !is_damped_[b]) return stress;
  return stress + compression_viscosity_[b] * Fdot;
}

void FiniteElements::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  sums_.fill_from(v, [&](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_, deformation_);
    spread_forces(batches_[b], damping_stress(b, gradient(batches_[b], rows)), double8{}, sums);
  });
  sums_.add_to(force);
  add_drag(v, force);
}

void FiniteElements::spread_turn(std::size_t b, const double4* rows, double seconds, double4* sums) const {
  const std::array<vector8, 3> F = columns_of(deformation_[b]);
  const vector8 spin = spin_of_columns<3>(F, columns_of(gradient(batches_[b], rows)));
  const double8 time = turn_time(spin, material_of_batch(b).is_pressurized ? 0 : seconds);
  std::array<vector8, 3> turned;
  for (std::size_t k = 0; k < 3; ++k) turned[k] = cross(spin, F[k]);
  Matrix3<double8> A;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k <= i; ++k) A[i][k] = A[k][i] = time * dot(turned[i], turned[k]);
  spread_forces(batches_[b], stress_of_rate(b, A), double8{}, sums);
}

void FiniteElements::add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force) {
  sums_.fill_from(
      v, [&](std::size_t b, const double4* rows, double4* sums) { spread_turn(b, rows, seconds, sums); });
  sums_.add_to(force);
}

void FiniteElements::add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  sums_.fill_from<float4>(v, [&](std::size_t b, const float4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, single_);
    const SingleBatch& batch = single_[b];
    const Matrix3<float8> Fdot = gradient_of(
        batch.inverse_rest, [&](std::size_t i) { return ScatterAdd::gather(rows, batch.slot[i]); });
    const LameParameters& moduli = material_of_batch(b).moduli;
    const float8 stress_share =
        -static_cast<float>(bounded_damping(moduli.damping, dt_ * elastic_omega_squared_)) * batch.share;
    const float8 mu = float8{} + static_cast<float>(moduli.mu),
                 lambda = float8{} + static_cast<float>(moduli.lambda);
    Matrix3<float8> stress = viscous_stress(mu, lambda, stress_share, batch.F, Fdot);
    if (is_damped_[b]) stress = stress + single_compression_[b] * Fdot;
    spread_columns(to_double(times_transposed(stress, batch.inverse_rest)), double8{}, batch.slot, sums);
  });
  sums_.add_to(force);
  add_drag(v, force);
}

void FiniteElements::add_drag(const std::vector<Vec3>& v, std::vector<Vec3>& force) const {
  parallel_for(drag_.size(), particle_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) force[p] -= drag_[p] * v[p];
  });
}

void FiniteElements::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  add_blocks(sums_, blocks, [&](std::size_t b, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_, deformation_);
    spread_damping(b, sums);
  });
  for (std::size_t p = 0; p < drag_.size(); ++p)
    if (sums_.takes(p)) blocks[p].diagonal += Vec3::Constant(drag_[p]);
}

// G (1/m) is the gradient of a node's linear shape function. With w = F G the viscous stress makes the block
//     b |G|^2 F F^T + (a + b) w w^T,
// and with g = F^-T G the damping of compression makes
//     shear/2 (|g|^2 1 + g g^T) + bulk g g^T.
void FiniteElements::spread_damping(std::size_t b, double4* sums) const {
  const Batch& batch = batches_[b];
  const Matrix3<double8>&F = deformation_[b], &D = batch.inverse_rest;
  const Moduli here = moduli(b);
  const bool is_added_to = added_damping_ > 0;  // see damping_stress()
  const double8 &mu = here.mu, lambda = is_added_to ? volume_share(F) * here.lambda : here.lambda;
  const double seconds =
      bounded_damping(material_of_batch(b).moduli.damping, dt_ * elastic_omega_squared_) + added_damping_;
  const double8 damping = is_added_to ? batch.volume * seconds : batch.volume * seconds / excess_damping(F);
  const Matrix3<double8> of_gradient = (damping * mu) * times_transposed(F, F);
  const double8 of_image = damping * (lambda + mu);
  const CompressionStiffness<double8>& compression = compression_viscosity_[b];
  const double8 shear = 0.5 * batch.volume * compression.shear,
                bulk = batch.volume * compression.bulk + shear;
  for (std::size_t i = 0; i < corners; ++i) {
    vector8 G{-(D[0][0] + D[1][0] + D[2][0]), -(D[0][1] + D[1][1] + D[2][1]), -(D[0][2] + D[1][2] + D[2][2])};
    if (i > 0)
      G = {D[static_cast<int>(i) - 1][0], D[static_cast<int>(i) - 1][1], D[static_cast<int>(i) - 1][2]};
    Matrix3<double8> sum = (G.x * G.x + G.y * G.y + G.z * G.z) * of_gradient;
    add_square(of_image, product(F, G), sum);
    if (is_damped_[b]) {
      const vector8 g = product(compression.inverse, G);
      add_square(bulk, g, sum);
      const double8 of_all = shear * (g.x * g.x + g.y * g.y + g.z * g.z);
      for (int k = 0; k < 3; ++k) sum[k][k] += of_all;
    }
    spread_block(batch.slot[i], {sum[0][0], sum[1][1], sum[2][2]}, {sum[1][2], sum[0][2], sum[0][1]}, sums);
  }
}

void FiniteElements::linearize() {
  differential_.resize(batches_.size());
  parallel_for(batches_.size(), ScatterAdd::batches_of_block, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Moduli here = moduli(b);
      const double8 &mu = here.mu, &lambda = here.lambda;
      const PrincipalStretches<double8> p = principal_stretches(deformation_[b]);
      with_model(model(b), [&]<class Model>(Model) {
        differential_[b] = stress_differential(p, Model::derivatives(mu, lambda, p.stretch));
      });
    }
  });
}

// Column k of the block of the corners i and j is the force on corner i while corner j moves along axis k:
// V P G_i, where P belongs to the rate e_k G_j^T and G is the gradient of a corner's linear shape function.
void FiniteElements::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    const Matrix3<double8>& D = batch.inverse_rest;
    std::array<vector8, corners> G;
    for (std::size_t i = 1; i < corners; ++i) {
      const int row = static_cast<int>(i) - 1;
      G[i] = {D[row][0], D[row][1], D[row][2]};
    }
    G[0] = vector8{} - (G[1] + G[2] + G[3]);
    for (std::size_t j = 0; j < corners; ++j) {
      std::array<Matrix3<double8>, 3> P;
      for (int k = 0; k < 3; ++k) {
        Matrix3<double8> rate{};
        rate[k][0] = G[j].x;
        rate[k][1] = G[j].y;
        rate[k][2] = G[j].z;
        P[as_index(k)] = (batch.volume * factors.damping) * damping_stress(b, rate);
        if (factors.elasticity > 0)
          P[as_index(k)] = P[as_index(k)] + (batch.volume * factors.elasticity) * (differential_[b] * rate);
      }
      for (std::size_t i = j; i < corners; ++i)
        append_lanes(batch.particle[i], batch.particle[j],
                     {product(P[0], G[i]), product(P[1], G[i]), product(P[2], G[i])}, blocks);
    }
  }
  for (std::size_t p = 0; p < drag_.size(); ++p)
    append_block(static_cast<int>(p), static_cast<int>(p), factors.damping * drag_[p] * Mat3::Identity(),
                 blocks);
}

void FiniteElements::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  sums_.fill_from(dx, [&](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_, differential_);
    spread_forces(batches_[b], differential_[b] * gradient(batches_[b], rows), double8{}, sums);
  });
  sums_.add_to(force);
}

}  // namespace duet
