#include "sim/deformable/forces/springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

// Length, relative to the rest length, below which a compressed spring loses its direction and force.
constexpr double crushed = 1e-3;

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

template <std::size_t N>
void Springs<N>::finalize(std::size_t particle_count) {
  batches_.resize((springs_.size() + pack_width - 1) / pack_width);
  for (std::size_t slot = 0; slot < batches_.size() * pack_width; ++slot) {
    Batch& batch = batches_[slot / pack_width];
    const std::size_t lane = slot % pack_width;
    const std::size_t s = ScatterAdd::element_of(slot / pack_width, lane, batches_.size());
    const bool pads = s >= springs_.size();
    const Spring<N>& spring = pads ? springs_.back() : springs_[s];
    for (std::size_t i = 0; i < N; ++i) {
      batch.particle[i][lane] = spring.particle[i];
      batch.weight[i][lane] = spring.weight[i];
    }
    batch.rest_length[lane] = spring.rest_length;
    batch.stiffness[lane] = pads ? 0 : spring.stiffness;
    batch.viscosity[lane] = pads ? 0 : spring.viscosity;
    batch.geometric_stiffness[lane] = 0;
  }
  sums_.build(batches_, particle_count);
  dashpots_.resize(batches_.size());
}

template <std::size_t N>
vector8 Springs<N>::difference(const Batch& batch, const std::vector<Vec3>& values) {
  vector8 sum = batch.weight[0] * gather(values, batch.particle[0]);
  for (std::size_t i = 1; i < N; ++i) sum = sum + batch.weight[i] * gather(values, batch.particle[i]);
  return sum;
}

template <std::size_t N>
vector8 Springs<N>::difference(const Batch& batch, const double4* rows) {
  vector8 sum = batch.weight[0] * ScatterAdd::gather(rows, batch.slot[0]);
  for (std::size_t i = 1; i < N; ++i) sum = sum + batch.weight[i] * ScatterAdd::gather(rows, batch.slot[i]);
  return sum;
}

// `force_of(b, d)` returns the force along d of the springs of batch b, where d = sum w_i of `values`. It is
// distributed to the particles by the weights.
template <std::size_t N>
template <class Force>
void Springs<N>::add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of) {
  sums_.fill_from(values, [&](std::size_t b, const double4* rows, double4* sums) {
    const Batch& batch = batches_[b];
    const vector8 force = force_of(b, difference(batch, rows));
    for (std::size_t i = 0; i < N; ++i)
      ScatterAdd::spread(batch.slot[i], batch.weight[i] * force, double8{}, sums);
  });
  sums_.add_to(totals);
}

template <std::size_t N>
void Springs<N>::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                                    std::vector<double>& geometric_stiffness) {
  sums_.fill_from(x, [&](std::size_t b, const double4* rows, double4* sums) {
    Batch& batch = batches_[b];
    const vector8 d = difference(batch, rows);
    const double8 length = sqrt_of(dot(d, d));
    const double8 shortest = crushed * batch.rest_length;
    const double8 divisor = select(length > shortest, length, shortest);
    const mask8 extends = divisor > double8{};
    const double8 inverse = select(extends, 1.0 / select(extends, divisor, double8{} + 1.0), double8{});
    batch.direction = inverse * d;
    const double8 side = batch.stiffness * (1.0 - batch.rest_length * inverse);
    batch.geometric_stiffness = select(side > double8{}, side, double8{});
    dashpots_[b].set(batch.slot, batch.weight, batch.viscosity, batch.direction);
    const vector8 along = (batch.stiffness * (batch.rest_length - length)) * batch.direction;
    double8 half{};
    for (const double8& weight : batch.weight) half += 0.5 * abs_of(weight);
    for (std::size_t i = 0; i < N; ++i)
      ScatterAdd::spread(batch.slot[i], batch.weight[i] * along,
                         half * abs_of(batch.weight[i]) * batch.geometric_stiffness, sums);
  });
  sums_.add_to(force, geometric_stiffness);
}

template <std::size_t N>
void Springs<N>::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  add_forces(v, force, [&](std::size_t b, const vector8& difference) {
    const Batch& batch = batches_[b];
    return (-batch.viscosity * dot(batch.direction, difference)) * batch.direction;
  });
}

// The block of a particle is c w^2 u u^T, with the viscosity c, its weight w and the spring's direction u.
template <std::size_t N>
void Springs<N>::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  add_blocks(sums_, blocks, [&](std::size_t b, double4* sums) {
    const Batch& batch = batches_[b];
    for (std::size_t i = 0; i < N; ++i)
      spread_square(batch.slot[i], batch.viscosity * batch.weight[i] * batch.weight[i], batch.direction,
                    sums);
  });
}

template <std::size_t N>
void Springs<N>::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  add_forces(dx, force, [&](std::size_t b, const vector8& d) {
    const Batch& batch = batches_[b];
    const double8 along = (batch.geometric_stiffness - batch.stiffness) * dot(batch.direction, d);
    return along * batch.direction - batch.geometric_stiffness * d;
  });
}

template <std::size_t N>
double Springs<N>::energy(const std::vector<Vec3>& x) const {
  return parallel_reduce(
      batches_.size(), ScatterAdd::batches_of_block, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t b = begin; b < end; ++b) {
          const Batch& batch = batches_[b];
          const vector8 d = difference(batch, x);
          const double8 stretch = sqrt_of(dot(d, d)) - batch.rest_length;
          sum += sum_of_lanes(0.5 * batch.stiffness * stretch * stretch);
        }
        return sum;
      },
      [](double a, double b) { return a + b; });
}

template <std::size_t N>
void Springs<N>::add_stiffness(std::vector<double>& stiffness) const {
  for (const Spring<N>& spring : springs_) add_stiffness_of(spring, stiffness);
}

template <std::size_t N>
double Springs<N>::omega_squared(const Spring<N>& spring, const std::vector<double>& squared_rate) const {
  double sum = 0;
  for (std::size_t i = 0; i < N; ++i)
    sum += std::abs(spring.weight[i]) * squared_rate[as_index(spring.particle[i])];
  return sum / half_of_weights(spring);
}

template <std::size_t N>
double Springs<N>::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (const Spring<N>& spring : springs_) highest = std::max(highest, omega_squared(spring, squared_rate));
  return highest;
}

template <std::size_t N>
double Springs<N>::rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
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
template double critical_viscosity(double, double, const std::array<double, 2>&,
                                   const std::array<double, 2>&);
template double critical_viscosity(double, double, const std::array<double, 4>&,
                                   const std::array<double, 4>&);

}  // namespace duet
