#include "sim/articulation/block_factor.h"

#include <algorithm>
#include <set>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include "sim/base/assert.h"
#include "sim/base/index.h"

namespace duet {
namespace {

// A row depends on the rows before it if elimination leaves less than this fraction of its diagonal entry. It
// is far above rounding (1e-16) and far below the pivots of independent rows; a larger value would drop
// ill-conditioned rows.
constexpr double dependence = 1e-10;

// Computes sum = A b, where b(k) returns entry k of b, and `sum` has an entry per row of A. It uses plain
// loops, because Eigen's product of matrices of dynamic size fuses multiplications and additions in the rows
// that a vector register can take: results would depend on the alignment of the blocks in memory.
template <class Value>
void multiply(const BlockFactor::Block& A, double* sum, Value&& b) {
  const Eigen::Index n = A.rows();
  std::fill(sum, sum + n, 0);
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    const double* column = A.data() + k * n;
    const double factor = b(k);
    for (Eigen::Index i = 0; i < n; ++i) sum[i] += column[i] * factor;
  }
}

// Replaces a symmetric positive semi-definite block by its inverse on the rows that do not depend on rows
// before them, and by zero on the rest. `scale` holds the entries of the diagonal before anything was
// eliminated.
void invert(BlockFactor::Block& A, const BlockFactor::Segment& scale) {
  const Eigen::Index n = A.rows();
  BlockFactor::Block L = BlockFactor::Block::Identity(n, n);  // A = L D L^T
  BlockFactor::Segment inverse = BlockFactor::Segment::Zero(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double pivot = A(j, j);
    if (!(pivot > dependence * scale(j))) continue;
    inverse(j) = 1 / pivot;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      L(i, j) = A(i, j) / pivot;
      for (Eigen::Index k = j + 1; k <= i; ++k) A(i, k) -= L(i, j) * A(k, j);
    }
  }
  for (Eigen::Index c = 0; c < n; ++c) {  // column c of the inverse solves A x = e_c
    BlockFactor::Segment x = BlockFactor::Segment::Zero(n);
    if (inverse(c) != 0) x(c) = 1;
    for (Eigen::Index j = 0; j < n; ++j)
      for (Eigen::Index i = j + 1; i < n; ++i) x(i) -= L(i, j) * x(j);
    x = x.cwiseProduct(inverse);
    for (Eigen::Index j = n; j-- > 0;)
      for (Eigen::Index i = j + 1; i < n; ++i)
        if (inverse(j) != 0) x(j) -= L(i, j) * x(i);
    A.col(c) = x;
  }
}

}  // namespace

void BlockFactor::analyze(const std::vector<int>& rows, const std::vector<std::pair<int, int>>& couplings) {
  const int n = static_cast<int>(rows.size());
  Eigen::SparseMatrix<double> pattern(n, n);
  std::vector<Eigen::Triplet<double>> ones;
  ones.reserve(rows.size() + 2 * couplings.size());
  for (int i = 0; i < n; ++i) ones.emplace_back(i, i, 1);
  for (const auto& [i, j] : couplings) {
    DUET_ASSERT(i >= 0 && i < n && j >= 0 && j < n);
    ones.emplace_back(i, j, 1);
    ones.emplace_back(j, i, 1);
  }
  pattern.setFromTriplets(ones.begin(), ones.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order(n);
  if (n > 0) Eigen::AMDOrdering<int>()(pattern, order);
  place_.resize(rows.size());
  std::vector<int> at(rows.size());  // per place, the block row there
  for (int k = 0; k < n; ++k) at[as_index(k)] = order.indices()[k];
  for (int k = 0; k < n; ++k) place_[as_index(at[as_index(k)])] = k;

  std::vector<std::set<int>> column(rows.size());
  for (const auto& [i, j] : couplings) {
    const auto [low, high] = std::minmax(place_[as_index(i)], place_[as_index(j)]);
    if (low != high) column[as_index(low)].insert(high);
  }
  for (const std::set<int>& below : column)  // fill-in: eliminating a column couples all rows below it
    for (const int i : below)
      for (const int k : below)
        if (k > i) column[as_index(i)].insert(k);

  pivot_.clear();
  work_.clear();
  first_.assign(1, 0);
  entry_.clear();
  lower_.clear();
  for (int c = 0; c < n; ++c) {
    const int size = rows[as_index(at[as_index(c)])];
    DUET_ASSERT(size >= 0 && size <= max_rows);
    pivot_.push_back(Block::Zero(size, size));
    work_.push_back(Segment::Zero(size));
    for (const int row : column[as_index(c)]) {
      entry_.push_back({row, static_cast<int>(lower_.size())});
      lower_.push_back(Block::Zero(rows[as_index(at[as_index(row)])], size));
    }
    first_.push_back(static_cast<int>(entry_.size()));
  }
}

int BlockFactor::find(int row, int column) const {
  const auto begin = entry_.begin() + first_[as_index(column)],
             end = entry_.begin() + first_[as_index(column) + 1];
  const auto entry = std::lower_bound(begin, end, row, [](const Entry& e, int r) { return e.row < r; });
  DUET_ASSERT(entry != end && entry->row == row);
  return entry->block;
}

void BlockFactor::set_zero() {
  for (Block& block : pivot_) block.setZero();
  for (Block& block : lower_) block.setZero();
}

void BlockFactor::add_coupling(int i, int j, const Block& block) {
  DUET_ASSERT(i != j);
  const int row = place_[as_index(i)], column = place_[as_index(j)];
  DUET_ASSERT(block.rows() == pivot_[as_index(row)].rows() &&
              block.cols() == pivot_[as_index(column)].cols());
  if (row > column)
    lower_[as_index(find(row, column))] += block;
  else
    lower_[as_index(find(column, row))] += block.transpose();
}

void BlockFactor::factor(double softness) {
  DUET_ASSERT(softness >= 0);
  for (std::size_t c = 0; c < pivot_.size(); ++c) {
    pivot_[c].diagonal() *= 1 + softness;
    work_[c] = pivot_[c].diagonal();
  }
  Block product;
  double sum[max_rows];
  for (std::size_t c = 0; c < pivot_.size(); ++c) {
    invert(pivot_[c], work_[c]);
    for (int a = first_[c]; a < first_[c + 1]; ++a) {
      const Entry& low = entry_[as_index(a)];
      const Block& eliminated = lower_[as_index(low.block)];
      product.resize(eliminated.rows(), eliminated.cols());
      for (Eigen::Index j = 0; j < product.cols(); ++j)
        multiply(eliminated, &product(0, j), [&](Eigen::Index k) { return pivot_[c](k, j); });
      for (int b = first_[c]; b <= a; ++b) {
        const Entry& high = entry_[as_index(b)];
        Block& target = a == b ? pivot_[as_index(low.row)] : lower_[as_index(find(low.row, high.row))];
        const Block& other = lower_[as_index(high.block)];
        for (Eigen::Index j = 0; j < target.cols(); ++j) {
          multiply(product, sum, [&](Eigen::Index k) { return other(j, k); });
          for (Eigen::Index i = 0; i < target.rows(); ++i) target(i, j) -= sum[i];
        }
      }
    }
  }
}

void BlockFactor::solve(std::vector<Segment>& x) const {
  DUET_ASSERT(x.size() == place_.size());
  for (std::size_t i = 0; i < place_.size(); ++i) {
    DUET_ASSERT(x[i].size() == pivot_[as_index(place_[i])].rows());
    work_[as_index(place_[i])] = x[i];
  }
  double scaled[max_rows], sum[max_rows];
  for (std::size_t c = 0; c < pivot_.size(); ++c) {
    multiply(pivot_[c], scaled, [&](Eigen::Index k) { return work_[c](k); });
    for (int a = first_[c]; a < first_[c + 1]; ++a) {
      const Entry& entry = entry_[as_index(a)];
      Segment& below = work_[as_index(entry.row)];
      multiply(lower_[as_index(entry.block)], sum, [&](Eigen::Index k) { return scaled[k]; });
      for (Eigen::Index i = 0; i < below.size(); ++i) below(i) -= sum[i];
    }
  }
  for (std::size_t c = pivot_.size(); c-- > 0;) {
    Segment& here = work_[c];
    for (int a = first_[c]; a < first_[c + 1]; ++a) {
      const Entry& entry = entry_[as_index(a)];
      const Segment& below = work_[as_index(entry.row)];
      const Block& L = lower_[as_index(entry.block)];
      for (Eigen::Index j = 0; j < here.size(); ++j) {
        double along = 0;
        for (Eigen::Index i = 0; i < below.size(); ++i) along += L(i, j) * below(i);
        here(j) -= along;
      }
    }
    multiply(pivot_[c], scaled, [&](Eigen::Index k) { return here(k); });
    std::copy(scaled, scaled + here.size(), here.data());
  }
  for (std::size_t i = 0; i < place_.size(); ++i) x[i] = work_[as_index(place_[i])];
}

}  // namespace duet
