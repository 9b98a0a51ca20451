// Direct solution of sparse symmetric positive semi-definite systems made of small blocks.
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace duet {

// S = L D L^T by blocks, in an order that keeps L sparse (Eigen's approximate minimum degree): for chains and
// trees of joints the work is linear in their number, and loops add little. Rows that depend on earlier ones
// (loops are redundant) get no part in the solution. Nothing allocates after `analyze`.
class BlockFactor {
 public:
  static constexpr int max_rows = 9;  // of a block
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_rows, max_rows>;
  using Segment = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, max_rows, 1>;

  // `rows` of every block row; `couplings` are the pairs of block rows with a block between them.
  void analyze(const std::vector<int>& rows, const std::vector<std::pair<int, int>>& couplings);

  void set_zero();
  Block& diagonal(int i) { return pivot_[static_cast<std::size_t>(place_[static_cast<std::size_t>(i)])]; }
  // Adds `block`, of rows i and columns j, to S, and its transpose on the other side; i and j differ.
  void add_coupling(int i, int j, const Block& block);

  // A row whose pivot has fallen below a tiny share of its diagonal entry depends on the rows before it.
  // `softness` is added to the diagonal, as a share of itself.
  void factor(double softness = 0);
  // Solves in place. `x` has a segment for every block row.
  void solve(std::vector<Segment>& x) const;

 private:
  struct Entry {  // of L, below the diagonal
    int row = 0, block = 0;
  };
  int find(int row, int column) const;

  std::vector<int> place_;    // of a block row in the order of elimination
  std::vector<Block> pivot_;  // D; after `factor` its inverse
  std::vector<int> first_;    // entries of column c: entry_[first_[c], first_[c + 1]), by row
  std::vector<Entry> entry_;
  std::vector<Block> lower_;  // S; after `factor`, S with what was eliminated: L D
  mutable std::vector<Segment> work_;
};

}  // namespace duet
