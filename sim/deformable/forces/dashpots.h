// What the viscosity of springs between two points makes of velocities, in single precision: of a spring's
// numbers (springs.h, altitude_springs.h) only those that the search directions of a solve need, at half the
// size.
//
//   f_i = -w_i s (s . sum w_j v_j),   s = sqrt(c) u
//
// for the viscosity c, N s/m, and the spring's direction u. Its weights w add up to zero, and so do its
// forces, to the rounding of doubles.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/block_sums.h"

namespace duet {

// The squared frequency that makes a limit of 2 / omega of `reach` seconds; infinite for none.
double relaxed_squared_frequency(double reach);

template <std::size_t N>
class Dashpots {  // of one batch
 public:
  void set(const std::array<BlockSums::Slot, N>& slot, const std::array<Pack, N>& weight,
           const Pack& viscosity, const PackVector& direction) {
    slot_ = slot;
    const Pack root = sqrt_of(viscosity);
    s_ = {to_single(root * direction.x), to_single(root * direction.y), to_single(root * direction.z)};
    for (std::size_t i = 1; i < N; ++i) weight_[i - 1] = to_single(weight[i]);
  }

  // See BlockSums::fill_from.
  void spread_forces(const QuadF* rows, Quad* sums) const {
    const PackVectorF origin = BlockSums::gather(rows, slot_[0]);
    PackF along{};  // s . sum w_j v_j
    for (std::size_t i = 1; i < N; ++i) {
      const PackVectorF v = BlockSums::gather(rows, slot_[i]) - origin;
      along += weight_[i - 1] * (s_.x * v.x + s_.y * v.y + s_.z * v.z);
    }
    PackVector rest{};
    for (std::size_t i = 1; i < N; ++i) {
      const PackF share = -weight_[i - 1] * along;
      const PackVector force{to_double(share * s_.x), to_double(share * s_.y), to_double(share * s_.z)};
      BlockSums::spread(slot_[i], force, Pack{}, sums);
      rest = rest - force;
    }
    BlockSums::spread(slot_[0], rest, Pack{}, sums);
  }

 private:
  std::array<BlockSums::Slot, N> slot_;
  std::array<PackF, N - 1> weight_;  // of all but the first
  PackVectorF s_;
};

template <std::size_t N>
void add_dashpot_forces(const std::vector<Dashpots<N>>& dashpots, BlockSums& sums, const std::vector<Vec3>& v,
                        std::vector<Vec3>& force) {
  sums.fill_from<QuadF>(v, [&](std::size_t b, const QuadF* rows, Quad* block_sums) {
    dashpots[b].spread_forces(rows, block_sums);
  });
  sums.add_to(force);
}

}  // namespace duet
