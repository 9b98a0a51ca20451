// A direct solver for sparse symmetric positive semi-definite systems that are made of small dense blocks.
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace duet {

/// Block factorization S = L D L^T of a symmetric positive semi-definite matrix.
///
/// Blocks are eliminated in an order that keeps L sparse (Eigen's approximate minimum degree ordering): for
/// chains and trees of joints the work is linear in their number, and loops add little. A scalar row that
/// depends linearly on rows before it gets no part in the solution, so that redundant constraints, such as
/// those of closed loops of joints, do no harm. Use: analyze() once, then set_zero(), diagonal() and
/// add_coupling() to fill S, factor(), and solve() for any number of right sides. Nothing allocates after
/// analyze().
class BlockFactor {
 public:
  /// Largest number of scalar rows of a block row: all that one joint can have.
  static constexpr int max_rows = 9;
  /// A block of S or L with at most `max_rows` rows and columns.
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_rows, max_rows>;
  /// The part of a right side or a solution that belongs to one block row.
  using Segment = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, max_rows, 1>;

  /// Sets the structure of S, finds the order of elimination, and allocates all blocks.
  ///
  /// `rows[i]` is the number of scalar rows of block row i. `couplings` lists the pairs of block rows with a
  /// block between them; a pair may occur more than once and in either order.
  void analyze(const std::vector<int>& rows, const std::vector<std::pair<int, int>>& couplings);

  /// Sets all blocks of S to zero, so that it can be filled again.
  void set_zero();
  /// Returns the diagonal block of block row `i`, to be filled before factor().
  Block& diagonal(int i) { return pivot_[static_cast<std::size_t>(place_[static_cast<std::size_t>(i)])]; }
  /// Adds `block` to S at block row `i` and block column `j`, and its transpose at (j, i).
  ///
  /// `i` and `j` differ and are a pair of the couplings given to analyze().
  void add_coupling(int i, int j, const Block& block);

  /// Factors S in place.
  ///
  /// `softness` (1, at least 0) is a Levenberg term: every diagonal entry s becomes (1 + softness) s before
  /// the elimination. A row counts as dependent, and gets no part in solutions, when its pivot falls to less
  /// than 1e-10 of that diagonal entry.
  void factor(double softness = 0);
  /// Solves S x = b in place: `x` holds b on entry, with one segment for every block row.
  void solve(std::vector<Segment>& x) const;

 private:
  // A block of L below the diagonal.
  struct Entry {
    int row = 0,    // place of its block row in the order of elimination
        block = 0;  // index into lower_
  };
  // Returns the index into lower_ of the block at places (row, column) of the order of elimination, where
  // row > column and the block exists.
  int find(int row, int column) const;

  std::vector<int> place_;    // per block row: its place in the order of elimination
  std::vector<Block> pivot_;  // per place: diagonal block of S, after factor() the inverse of D's block
  std::vector<int> first_;    // the entries of column c are entry_[first_[c], first_[c + 1]), by row
  std::vector<Entry> entry_;
  std::vector<Block> lower_;           // blocks of S below the diagonal, after factor() those of L D
  mutable std::vector<Segment> work_;  // scratch, per place
};

}  // namespace duet
