#include "sim/deformable/forces/springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

// Length, relative to the rest length, below which a compressed spring loses its direction and force.
constexpr double min_length = 1e-3;

// Returns half of the sum of |w_i|: 1 for the spring between two particles.
template <std::size_t N>
double half_of_weights(const Spring<N>& spring) {
  double sum = 0;
  for (const double weight : spring.weight) sum += std::abs(weight);
  return sum / 2;
}

// Adds k w_i, with the weights scaled to a sum of 2, to the entries of the spring's particles (N/m).
template <std::size_t N>
void add_stiffness_of(const Spring<N>& spring, std::vector<double>& stiffness) {
  const double half = half_of_weights(spring);
  for (std::size_t i = 0; i < N; ++i)
    stiffness[as_index(spring.particle[i])] += spring.stiffness * half * std::abs(spring.weight[i]);
}

}  // namespace

double relaxed_omega_squared(double reach) {
  return reach > 0 ? 4 / (reach * reach) : std::numeric_limits<double>::infinity();
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::finalize(std::size_t particle_count) {
  const std::size_t groups = springs_.size() / R;
  batches_.resize((groups + pack_width - 1) / pack_width);
  for (std::size_t place = 0; place < batches_.size() * pack_width; ++place) {
    Batch& batch = batches_[place / pack_width];
    const std::size_t lane = place % pack_width;
    const std::size_t group = ScatterAdd::element_of(place / pack_width, lane, batches_.size());
    const bool pads = group >= groups;
    const Spring<N>* springs = &springs_[R * (pads ? groups - 1 : group)];
    for (std::size_t i = 0; i < N; ++i) batch.particle[i][lane] = springs[0].particle[i];
    for (std::size_t r = 0; r < R; ++r) {
      Row& row = batch.row[r];
      for (std::size_t i = 0; i < N; ++i) row.weight[i][lane] = springs[r].weight[i];
      row.rest_length[lane] = springs[r].rest_length;
      row.stiffness[lane] = pads ? 0 : springs[r].stiffness;
      row.viscosity[lane] = pads ? 0 : springs[r].viscosity;
      row.geometric_stiffness[lane] = row.length[lane] = 0;
    }
  }
  sums_.build(batches_, particle_count);
  dashpots_.resize(batches_.size());
}

template <std::size_t N, std::size_t R>
vector8 Springs<N, R>::Row::difference(const std::array<vector8, N>& values) const {
  vector8 sum = weight[0] * values[0];
  for (std::size_t i = 1; i < N; ++i) sum = sum + weight[i] * values[i];
  return sum;
}

template <std::size_t N, std::size_t R>
std::array<vector8, N> Springs<N, R>::Batch::gather(const double4* rows) const {
  std::array<vector8, N> values;
  for (std::size_t i = 0; i < N; ++i) values[i] = ScatterAdd::gather(rows, slot[i]);
  return values;
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::Batch::spread(const std::array<vector8, R>& force, const std::array<double8, N>& fourth,
                                  double4* sums) const {
  for (std::size_t i = 0; i < N; ++i) {
    vector8 sum = row[0].weight[i] * force[0];
    for (std::size_t r = 1; r < R; ++r) sum = sum + row[r].weight[i] * force[r];
    ScatterAdd::spread(slot[i], sum, fourth[i], sums);
  }
}

// The forces are distributed to the particles by the weights.
template <std::size_t N, std::size_t R>
template <class Force>
auto Springs<N, R>::forces_along(Force force_of) const {
  return [this, force_of](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_);
    const Batch& batch = batches_[b];
    const std::array<vector8, N> here = batch.gather(rows);
    std::array<vector8, R> force;
    for (std::size_t r = 0; r < R; ++r) force[r] = force_of(batch.row[r], batch.row[r].difference(here));
    batch.spread(force, {}, sums);
  };
}

template <std::size_t N, std::size_t R>
template <class Force>
void Springs<N, R>::add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of) {
  sums_.fill_from(values, forces_along(force_of));
  sums_.add_to(totals);
}

template <std::size_t N, std::size_t R>
auto Springs<N, R>::turn_force(double seconds) {
  return [seconds](const Row& row, const vector8& difference) {
    return (-row.viscosity * turn_rate(row.direction, row.length, difference, seconds)) * row.direction;
  };
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                                       std::vector<double>& geometric_stiffness, const Turn* turn) {
  const auto elastic = [&](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_, dashpots_);
    Batch& batch = batches_[b];
    const std::array<vector8, N> here = batch.gather(rows);
    std::array<vector8, R> along;
    std::array<double8, N> geometric{};  // parts of the geometric stiffness, N/m
    for (std::size_t r = 0; r < R; ++r) {
      Row& row = batch.row[r];
      const vector8 d = row.difference(here);
      const double8 length = sqrt_of(dot(d, d));
      const double8 shortest = min_length * row.rest_length;
      const double8 divisor = select(length > shortest, length, shortest);
      const mask8 extends = divisor > double8{};
      const double8 inverse = select(extends, 1.0 / select(extends, divisor, double8{} + 1.0), double8{});
      row.length = length;
      row.direction = inverse * d;
      const double8 side = row.stiffness * (1.0 - row.rest_length * inverse);
      row.geometric_stiffness = select(side > double8{}, side, double8{});
      dashpots_[b].set(batch.slot, row.weight, row.viscosity, row.direction, r);
      along[r] = (row.stiffness * (row.rest_length - length)) * row.direction;
      double8 half{};
      for (const double8& weight : row.weight) half += 0.5 * abs_of(weight);
      for (std::size_t i = 0; i < N; ++i)
        geometric[i] += half * abs_of(row.weight[i]) * row.geometric_stiffness;
    }
    batch.spread(along, geometric, sums);
  };
  if (turn)
    sums_.fill_both_from(x, elastic, turn->v, forces_along(turn_force(turn->seconds)));
  else
    sums_.fill_from(x, elastic);
  sums_.add_to(force, geometric_stiffness);
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  add_forces(v, force, [](const Row& row, const vector8& difference) {
    return (-row.viscosity * dot(row.direction, difference)) * row.direction;
  });
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force) {
  add_forces(v, force, turn_force(seconds));
}

// The block of a particle is c w^2 u u^T, with the viscosity c, its weight w and the spring's direction u.
template <std::size_t N, std::size_t R>
void Springs<N, R>::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  add_blocks(sums_, blocks, [&](std::size_t b, double4* sums) {
    fetch_ahead(b + batches_ahead, batches_);
    const Batch& batch = batches_[b];
    for (std::size_t i = 0; i < N; ++i)
      for (const Row& row : batch.row)
        spread_square(batch.slot[i], row.viscosity * row.weight[i] * row.weight[i], row.direction, sums);
  });
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  add_forces(dx, force, [](const Row& row, const vector8& d) {
    const double8 along = (row.geometric_stiffness - row.stiffness) * dot(row.direction, d);
    return along * row.direction - row.geometric_stiffness * d;
  });
}

template <std::size_t N, std::size_t R>
Mat3 Springs<N, R>::Row::block(std::size_t lane, const BlockFactors& factors) const {
  const Vec3 u(direction.x[lane], direction.y[lane], direction.z[lane]);
  const double geometric = factors.elasticity * geometric_stiffness[lane];
  const double along = factors.damping * viscosity[lane] + factors.elasticity * stiffness[lane] - geometric;
  return along * u * u.transpose() + geometric * Mat3::Identity();
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  for (const Batch& batch : batches_)
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      std::array<Mat3, R> of_row;
      for (std::size_t r = 0; r < R; ++r) of_row[r] = batch.row[r].block(lane, factors);
      for (std::size_t i = 0; i < N; ++i)
        for (std::size_t j = 0; j <= i; ++j) {
          Mat3 sum = Mat3::Zero();
          for (std::size_t r = 0; r < R; ++r)
            sum += batch.row[r].weight[i][lane] * batch.row[r].weight[j][lane] * of_row[r];
          append_block(batch.particle[i][lane], batch.particle[j][lane], sum, blocks);
        }
    }
}

template <std::size_t N, std::size_t R>
double Springs<N, R>::energy(const std::vector<Vec3>& x) const {
  return parallel_sum(batches_.size(), ScatterAdd::batches_of_block, [&](std::size_t b, double& sum) {
    std::array<vector8, N> here;
    for (std::size_t i = 0; i < N; ++i) here[i] = gather(x, batches_[b].particle[i]);
    for (const Row& row : batches_[b].row) {
      const vector8 d = row.difference(here);
      const double8 stretch = sqrt_of(dot(d, d)) - row.rest_length;
      sum += sum_of_lanes(0.5 * row.stiffness * stretch * stretch);
    }
  });
}

template <std::size_t N, std::size_t R>
void Springs<N, R>::add_stiffness(std::vector<double>& stiffness) const {
  for (const Spring<N>& spring : springs_) add_stiffness_of(spring, stiffness);
}

template <std::size_t N, std::size_t R>
double Springs<N, R>::omega_squared(const Spring<N>& spring, const std::vector<double>& squared_rate) const {
  const double half = half_of_weights(spring);
  if (half == 0) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < N; ++i)
    sum += std::abs(spring.weight[i]) * squared_rate[as_index(spring.particle[i])];
  return sum / half;
}

template <std::size_t N, std::size_t R>
double Springs<N, R>::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (const Spring<N>& spring : springs_) highest = std::max(highest, omega_squared(spring, squared_rate));
  return highest;
}

template <std::size_t N, std::size_t R>
double Springs<N, R>::rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                                      std::vector<double>& undamped_stiffness) const {
  double highest = 0;
  for (const Spring<N>& spring : springs_) {
    const double relaxed = relaxed_omega_squared(relaxation * spring.viscosity / spring.stiffness);
    if (relaxed < omega_squared(spring, squared_rate))
      highest = std::max(highest, relaxed);
    else
      add_stiffness_of(spring, undamped_stiffness);
  }
  return highest;
}

template <std::size_t N>
double critical_viscosity(double fraction, double k, const std::array<double, N>& weight,
                          const std::array<double, N>& inverse_mass) {
  double inverse = 0;
  for (std::size_t i = 0; i < N; ++i) inverse += weight[i] * weight[i] * inverse_mass[i];
  return inverse > 0 ? 2 * fraction * std::sqrt(k / inverse) : 0;
}

template class Springs<2>;
template class Springs<4>;
template class Springs<12, 3>;
template double critical_viscosity(double, double, const std::array<double, 2>&,
                                   const std::array<double, 2>&);
template double critical_viscosity(double, double, const std::array<double, 4>&,
                                   const std::array<double, 4>&);

}  // namespace duet
