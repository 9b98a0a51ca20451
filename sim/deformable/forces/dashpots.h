// Viscous forces of springs between two points, in single precision. Only the data that the search directions
// of a solve need is kept, at half the size of the springs' own (springs.h, altitude_springs.h).
//
//     f_i = -w_i s (s . sum w_j v_j),   s = sqrt(c) u
//
// c is the viscosity (N s/m) and u the unit direction of the spring. Its weights w add up to zero, and so do
// its forces, up to the rounding of doubles.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/scatter_add.h"

namespace duet {

/// Returns the omega^2 4 / reach^2 (rad^2/s^2) whose stability limit 2 / omega is `reach` seconds;
/// infinite if `reach` is not positive.
double relaxed_omega_squared(double reach);

/// Returns the rate w^2 t / sqrt(L^2 + w^2 t^2) at which a vector of length L changes its length t seconds
/// after it has begun to move by `rate`, of which w is the part across its unit direction.
inline double8 turn_rate(const vector8& direction, const double8& length, const vector8& rate,
                         double seconds) {
  const double8 along = dot(direction, rate);
  const double8 across = max_of(dot(rate, rate) - along * along, double8{});
  const double8 squared = length * length + seconds * seconds * across;
  return (seconds * across) / sqrt_of(max_of(squared, double8{} + std::numeric_limits<double>::min()));
}

/// The dashpots of one batch of springs on `N` particles each, in groups of `R` that share their particles.
template <std::size_t N, std::size_t R = 1>
class Dashpots {
 public:
  /// Sets slots, weights, viscosities (N s/m) and unit directions of spring `row` of the batch's groups.
  void set(const std::array<ScatterAdd::Slot, N>& slot, const std::array<double8, N>& weight,
           const double8& viscosity, const vector8& direction, std::size_t row = 0) {
    slot_ = slot;
    const double8 root = sqrt_of(viscosity);
    s_[row] = {to_single(root * direction.x), to_single(root * direction.y), to_single(root * direction.z)};
    for (std::size_t i = 1; i < N; ++i) weight_[row][i - 1] = to_single(weight[i]);
  }

  /// Adds the viscous forces (N) for the velocities `rows` (m/s) to the partial sums of the batch's block,
  /// see ScatterAdd::fill_from().
  void spread_forces(const float4* rows, double4* sums) const {
    const vector8f origin = ScatterAdd::gather(rows, slot_[0]);
    std::array<float8, R> along{};  // s . sum w_j v_j
    for (std::size_t i = 1; i < N; ++i) {
      const vector8f v = ScatterAdd::gather(rows, slot_[i]) - origin;
      for (std::size_t r = 0; r < R; ++r)
        along[r] += weight_[r][i - 1] * (s_[r].x * v.x + s_[r].y * v.y + s_[r].z * v.z);
    }
    vector8 rest{};
    for (std::size_t i = 1; i < N; ++i) {
      vector8f sum{};
      for (std::size_t r = 0; r < R; ++r) {
        const float8 share = -weight_[r][i - 1] * along[r];
        sum = {sum.x + share * s_[r].x, sum.y + share * s_[r].y, sum.z + share * s_[r].z};
      }
      const vector8 force{to_double(sum.x), to_double(sum.y), to_double(sum.z)};
      ScatterAdd::spread(slot_[i], force, double8{}, sums);
      rest = rest - force;
    }
    ScatterAdd::spread(slot_[0], rest, double8{}, sums);
  }

 private:
  std::array<ScatterAdd::Slot, N> slot_;
  std::array<std::array<float8, N - 1>, R> weight_;  // of all particles but the first
  std::array<vector8f, R> s_;                        // sqrt(N s/m), root of the viscosity times the direction
};

/// Adds the viscous forces of all batches for the velocities `v` (m/s) to `force` (N).
template <std::size_t N, std::size_t R>
void add_dashpot_forces(const std::vector<Dashpots<N, R>>& dashpots, ScatterAdd& sums,
                        const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  sums.fill_from<float4>(v, [&](std::size_t b, const float4* rows, double4* block_sums) {
    fetch_ahead(b + batches_ahead, dashpots);
    dashpots[b].spread_forces(rows, block_sums);
  });
  sums.add_to(force);
}

}  // namespace duet
