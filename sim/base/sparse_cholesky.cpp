#include "sim/base/sparse_cholesky.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Returns the inverse of the Cholesky factor of a symmetric matrix; zero if the matrix is not positive
// definite.
Mat3 inverse_factor(const Mat3& A) {
  Mat3 L = Mat3::Zero(), inverse = Mat3::Zero();
  for (int j = 0; j < 3; ++j) {
    double square = A(j, j);
    for (int k = 0; k < j; ++k) square -= L(j, k) * L(j, k);
    if (!(square > 0) || !std::isfinite(square)) return Mat3::Zero();
    L(j, j) = std::sqrt(square);
    for (int i = j + 1; i < 3; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  for (int j = 0; j < 3; ++j) {
    inverse(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < 3; ++i) {
      double sum = 0;
      for (int k = j; k < i; ++k) sum += L(i, k) * inverse(k, j);
      inverse(i, j) = -sum / L(i, i);
    }
  }
  return inverse;
}

// Adds the rows with which each row shares a block to its `neighbors`.
void add_neighbors(const std::vector<SparseBlock>& blocks, std::vector<std::vector<int>>& neighbors) {
  for (const SparseBlock& entry : blocks) {
    if (entry.row == entry.column) continue;
    neighbors[as_index(entry.row)].push_back(entry.column);
    neighbors[as_index(entry.column)].push_back(entry.row);
  }
  for (std::vector<int>& of_row : neighbors) {
    std::sort(of_row.begin(), of_row.end());
    of_row.erase(std::unique(of_row.begin(), of_row.end()), of_row.end());
  }
}

// The rows that are left to eliminate, by their number of neighbors.
class DegreeQueue {
 public:
  explicit DegreeQueue(const std::vector<std::vector<int>>& neighbors) : degree_(neighbors.size(), none) {
    for (std::size_t row = neighbors.size(); row-- > 0;) set(static_cast<int>(row), neighbors[row].size());
  }
  // Sets the number of neighbors of a row.
  void set(int row, std::size_t degree) {
    if (degree_[as_index(row)] == degree) return;
    degree_[as_index(row)] = degree;
    if (rows_.size() <= degree) rows_.resize(degree + 1);
    rows_[degree].push_back(row);
    least_ = std::min(least_, degree);
  }
  // Takes out a row with the fewest neighbors: of several, the one whose number was set last.
  int take() {
    for (;; ++least_) {
      DUET_ASSERT(least_ < rows_.size());
      while (!rows_[least_].empty()) {
        const int row = rows_[least_].back();
        rows_[least_].pop_back();
        if (degree_[as_index(row)] != least_) continue;  // its number has changed since
        degree_[as_index(row)] = none;
        return row;
      }
    }
  }

 private:
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> degree_;     // for each row; `none` once it is out
  std::vector<std::vector<int>> rows_;  // for each number of neighbors: rows that have had it
  std::size_t least_ = none;
};

// Removes the row `eliminated` from the neighbors of `row`, and makes it a neighbor of all other rows of
// `others`, unless it is one already.
void join_neighbors(int row, int eliminated, const std::vector<int>& others, bool are_joined,
                    std::vector<int>& neighbors, std::vector<int>& scratch) {
  if (are_joined) {
    neighbors.erase(std::lower_bound(neighbors.begin(), neighbors.end(), eliminated));
    return;
  }
  scratch.clear();
  std::set_union(neighbors.begin(), neighbors.end(), others.begin(), others.end(),
                 std::back_inserter(scratch));
  std::erase_if(scratch, [&](int other) { return other == row || other == eliminated; });
  neighbors.swap(scratch);
}

}  // namespace

bool SparseCholesky::factorize(std::size_t size, const std::vector<SparseBlock>& blocks,
                               std::size_t max_products) {
  if (products_ > max_products) forget();
  if (size != place_.size() || !fill(blocks)) {
    if (!analyze(size, blocks, max_products)) {
      forget();
      return false;
    }
    fill(blocks);
  }
  return compute();
}

void SparseCholesky::forget() {
  neighbors_.clear();
  place_.clear();
  products_ = 0;
}

bool SparseCholesky::analyze(std::size_t size, const std::vector<SparseBlock>& blocks,
                             std::size_t max_products) {
  if (neighbors_.size() != size) neighbors_.assign(size, {});
  add_neighbors(blocks, neighbors_);
  std::vector<std::vector<int>> neighbors = neighbors_;
  DegreeQueue left(neighbors);
  std::vector<int> order, scratch;
  std::vector<int> joined;  // rows that are all neighbors of each other
  place_.assign(size, 0);
  products_ = 0;
  while (order.size() < size) {
    const int next = left.take();
    place_[as_index(next)] = static_cast<int>(order.size());
    order.push_back(next);
    const std::vector<int>& around = neighbors[as_index(next)];
    // These rows are neighbors of each other from now on: the last ones need c^3 / 6 products by themselves.
    const std::size_t clique = around.size() + 1;
    if (products_ + clique * clique * clique / 6 > max_products) return false;
    products_ += clique * (clique + 1) / 2;
    const bool are_joined = std::includes(joined.begin(), joined.end(), around.begin(), around.end());
    for (const int row : around) {
      std::vector<int>& of_row = neighbors[as_index(row)];
      join_neighbors(row, next, around, are_joined, of_row, scratch);
      left.set(row, of_row.size());
    }
    joined = around;
  }
  first_.assign(1, 0);
  row_.clear();
  for (const int column : order) {
    for (const int row : neighbors[as_index(column)]) row_.push_back(place_[as_index(row)]);
    std::sort(row_.begin() + static_cast<std::ptrdiff_t>(first_.back()), row_.end());
    first_.push_back(row_.size());
  }
  return true;
}

bool SparseCholesky::fill(const std::vector<SparseBlock>& blocks) {
  value_.assign(row_.size(), Mat3::Zero());
  inverse_.assign(place_.size(), Mat3::Zero());
  for (const SparseBlock& entry : blocks) {
    const int row = place_[as_index(entry.row)], column = place_[as_index(entry.column)];
    if (row == column) {
      inverse_[as_index(column)] += entry.value;
      continue;
    }
    const auto begin = row_.begin() + static_cast<std::ptrdiff_t>(first_[as_index(std::min(row, column))]),
               end = row_.begin() + static_cast<std::ptrdiff_t>(first_[as_index(std::min(row, column)) + 1]);
    const auto found = std::lower_bound(begin, end, std::max(row, column));
    if (found == end || *found != std::max(row, column)) return false;
    value_[static_cast<std::size_t>(found - row_.begin())] +=
        row > column ? entry.value : Mat3(entry.value.transpose());
  }
  return true;
}

// `columns` lists, for each row, the finished columns whose next block is in that row.
bool SparseCholesky::compute() {
  constexpr int none = -1;
  const std::size_t size = place_.size();
  std::vector<Mat3> sum(size);  // of the rows of the present column
  std::vector<int> columns(size, none), next_column(size, none);
  std::vector<std::size_t> next(size);  // for each finished column: its next block
  const auto list = [&](std::size_t column) {
    if (next[column] == first_[column + 1]) return;
    int& head = columns[as_index(row_[next[column]])];
    next_column[column] = std::exchange(head, static_cast<int>(column));
  };
  for (std::size_t j = 0; j < size; ++j) {
    sum[j] = inverse_[j];
    for (std::size_t q = first_[j]; q < first_[j + 1]; ++q) sum[as_index(row_[q])] = value_[q];
    for (int column = columns[j]; column != none;) {
      const auto k = as_index(column);
      column = next_column[k];
      const Mat3 turned = value_[next[k]].transpose();
      sum[j] -= value_[next[k]] * turned;
      for (std::size_t q = next[k] + 1; q < first_[k + 1]; ++q) sum[as_index(row_[q])] -= value_[q] * turned;
      ++next[k];
      list(k);
    }
    inverse_[j] = inverse_factor(sum[j]);
    if (inverse_[j](0, 0) == 0) return false;
    for (std::size_t q = first_[j]; q < first_[j + 1]; ++q)
      value_[q] = sum[as_index(row_[q])] * inverse_[j].transpose();
    next[j] = first_[j];
    list(j);
  }
  return true;
}

void SparseCholesky::solve(std::vector<Vec3>& b) const {
  DUET_ASSERT(b.size() == place_.size());
  x_.resize(b.size());
  for (std::size_t row = 0; row < b.size(); ++row) x_[as_index(place_[row])] = b[row];
  for (std::size_t j = 0; j < x_.size(); ++j) {
    x_[j] = inverse_[j] * x_[j];
    for (std::size_t q = first_[j]; q < first_[j + 1]; ++q) x_[as_index(row_[q])] -= value_[q] * x_[j];
  }
  for (std::size_t j = x_.size(); j-- > 0;) {
    Vec3 sum = x_[j];
    for (std::size_t q = first_[j]; q < first_[j + 1]; ++q)
      sum -= value_[q].transpose() * x_[as_index(row_[q])];
    x_[j] = inverse_[j].transpose() * sum;
  }
  for (std::size_t row = 0; row < b.size(); ++row) b[row] = x_[as_index(place_[row])];
}

}  // namespace duet
