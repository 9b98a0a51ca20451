// The matrix of internal forces over the particles, as a list of blocks, for solvers that factorize it.
#pragma once

#include <vector>

#include "sim/base/types.h"

namespace duet {

/// A 3x3 block of a symmetric matrix over particles: that of the rows of one particle and the columns of
/// another one. The transposed block is implied. The blocks of a list add up if they have the same place.
struct ParticleBlock {
  int row = 0,                ///< particle
      column = 0;             ///< particle
  Mat3 block = Mat3::Zero();  ///< kg, for the matrices of velocity solves
};

/// Appends the block of two particles, unless it is zero.
inline void append_block(int row, int column, const Mat3& block, std::vector<ParticleBlock>& blocks) {
  if (!block.isZero(0)) blocks.push_back({row, column, block});
}

/// How much of each force the blocks hold. They are those of minus the derivative of
/// damping F_d(v) + elasticity dF(v) by the velocities v of the particles.
struct BlockFactors {
  double damping = 0,  ///< s, factor of the damping forces F_d
      elasticity = 0;  ///< s^2, factor of the force differentials dF
};

}  // namespace duet
