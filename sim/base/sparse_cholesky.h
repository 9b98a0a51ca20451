// Cholesky factorization of sparse matrices of 3x3 blocks, with a fixed order of operations, so that its bits
// are the same everywhere.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/base/types.h"

namespace duet {

/// A block of a symmetric matrix of 3x3 blocks: in block row `row` and block column `column`.
///
/// A block off the diagonal stands for its transposed one, too.
struct SparseBlock {
  int row = 0,                ///< number of the block row
      column = 0;             ///< number of the block column
  Mat3 value = Mat3::Zero();  ///< the block; symmetric on the diagonal
};

/// A = L L^T of a symmetric positive definite sparse matrix A.
///
/// Rows and columns are eliminated in the order of minimum degree: always one with the fewest neighbors that
/// are left (Tinney, Walker 1967). The columns of L are computed one after the other
/// from those before (left-looking; George, Liu, Computer Solution of Large Sparse Positive Definite Systems,
/// 1981).
class SparseCholesky {
 public:
  /// Factorizes the sum of `blocks`, with `size` block rows. Blocks in the same place add up.
  ///
  /// Keeps the order of elimination of the last matrix if all blocks have a place in its factor. Otherwise it
  /// finds a new order, for the places of both matrices: factors of matrices that change little in turn soon
  /// keep theirs.
  ///
  /// Returns false if the factorization needs more than `max_products` products of blocks, or if the matrix
  /// is not positive definite to rounding; solve() must not be called then.
  bool factorize(std::size_t size, const std::vector<SparseBlock>& blocks, std::size_t max_products);
  /// Forgets earlier matrices, so that the next factorization does not depend on them.
  void forget();
  /// Replaces the right side b, one vector for each block row, by the solution x of A x = b.
  void solve(std::vector<Vec3>& b) const;

 private:
  // Adds the places of `blocks` to neighbors_. Finds the order of elimination and the places of the blocks of
  // L. Returns false if there are too many.
  bool analyze(std::size_t size, const std::vector<SparseBlock>& blocks, std::size_t max_products);
  // Puts the sum of `blocks` into the places of L. Returns false if one has none.
  bool fill(const std::vector<SparseBlock>& blocks);
  // Computes L in place. Returns false if the matrix is not positive definite.
  bool compute();

  // For each block row: the rows with which it shares a block, ascending, in all matrices so far.
  std::vector<std::vector<int>> neighbors_;
  std::size_t products_ = 0;        // of blocks, in a factorization
  std::vector<int> place_;          // for each block row: when it is eliminated; below, rows have this number
  std::vector<std::size_t> first_;  // for each column: its first entry in row_; one entry past the last
  std::vector<int> row_;            // rows of the blocks below the diagonal, ascending in each column
  std::vector<Mat3> value_,         // these blocks
      inverse_;                     // for each column: the inverse of the diagonal block of L
  mutable std::vector<Vec3> x_;     // scratch of solve()
};

}  // namespace duet
