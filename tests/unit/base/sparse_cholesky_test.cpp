// Factorizations of sparse matrices of blocks, compared with products of the matrix.
#include "sim/base/sparse_cholesky.h"

#include <algorithm>
#include <limits>
#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::sparse_cholesky_test {
namespace {

constexpr std::size_t no_limit = std::numeric_limits<std::size_t>::max();

Mat3 random_matrix(std::mt19937& random) {
  Mat3 matrix;
  for (int k = 0; k < 3; ++k) matrix.col(k) = test::random_vector(random);
  return matrix;
}

// Returns a matrix of random springs between the nodes of a grid, about half of them left out, and of random
// points between three nodes each, with small masses on the diagonal. It is positive definite.
std::vector<SparseBlock> random_blocks(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<SparseBlock> blocks;
  const int size = width * height;
  for (int i = 0; i < size; ++i) blocks.push_back({i, i, 0.01 * Mat3::Identity()});
  const auto add = [&](int a, int b, const Mat3& A, const Mat3& B) {
    blocks.push_back({a, a, A.transpose() * A});
    blocks.push_back({b, b, B.transpose() * B});
    if (random() % 2 == 0)
      blocks.push_back({a, b, A.transpose() * B});
    else
      blocks.push_back({b, a, B.transpose() * A});
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int i = y * width + x;
      if (x + 1 < width && random() % 2 == 0) add(i, i + 1, random_matrix(random), random_matrix(random));
      if (y + 1 < height && random() % 2 == 0)
        add(i, i + width, random_matrix(random), random_matrix(random));
      const int far = static_cast<int>(random() % static_cast<unsigned>(size));
      if (random() % 4 == 0 && far != i) add(i, far, random_matrix(random), random_matrix(random));
    }
  return blocks;
}

std::vector<Vec3> product(std::size_t size, const std::vector<SparseBlock>& blocks,
                          const std::vector<Vec3>& x) {
  std::vector<Vec3> sum(size, Vec3::Zero());
  for (const SparseBlock& block : blocks) {
    const auto row = static_cast<std::size_t>(block.row), column = static_cast<std::size_t>(block.column);
    sum[row] += block.value * x[column];
    if (row != column) sum[column] += block.value.transpose() * x[row];
  }
  return sum;
}

// Returns the largest error of solutions for random right sides A x, relative to the largest entry of x.
double error_of(const SparseCholesky& factor, std::size_t size, const std::vector<SparseBlock>& blocks) {
  std::mt19937 random(99);
  std::vector<Vec3> x(size);
  for (Vec3& v : x) v = test::random_vector(random);
  std::vector<Vec3> solution = product(size, blocks, x);
  factor.solve(solution);
  double error = 0;
  for (std::size_t i = 0; i < size; ++i) error = std::max(error, (solution[i] - x[i]).cwiseAbs().maxCoeff());
  return error;
}

// The condition number is at most some 1e4, so that twelve digits are right. One object solves all sizes.
TEST(SparseCholesky, SolvesRandomSystems) {
  SparseCholesky factor;
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 1}, {7, 5}, {1, 40}, {20, 20}, {3, 100}})
    for (unsigned seed = 1; seed < 6; ++seed) {
      const auto size = static_cast<std::size_t>(width * height);
      const std::vector<SparseBlock> blocks = random_blocks(width, height, seed);
      ASSERT_TRUE(factor.factorize(size, blocks, no_limit));
      EXPECT_LT(error_of(factor, size, blocks), 1e-11) << width << " x " << height << ", seed " << seed;
    }
}

// A grid of n x n nodes needs 6.5 n^3 products in this order, and n^4 / 2 = 40 n^3 in that of its rows.
TEST(SparseCholesky, OrdersByMinimumDegree) {
  constexpr int n = 80;
  std::vector<SparseBlock> blocks;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int i = y * n + x;
      blocks.push_back({i, i, 5 * Mat3::Identity()});
      if (x + 1 < n) blocks.push_back({i, i + 1, -Mat3::Identity()});
      if (y + 1 < n) blocks.push_back({i, i + n, -Mat3::Identity()});
    }
  SparseCholesky factor;
  ASSERT_TRUE(factor.factorize(n * n, blocks, 7 * n * n * n));
  EXPECT_LT(error_of(factor, n * n, blocks), 1e-13);
  EXPECT_FALSE(factor.factorize(n * n, blocks, n * n * n / 10)) << "more products than allowed";
}

TEST(SparseCholesky, RefusesMatricesThatAreNotPositiveDefinite) {
  std::vector<SparseBlock> blocks = random_blocks(6, 6, 1);
  SparseCholesky factor;
  ASSERT_TRUE(factor.factorize(36, blocks, no_limit));
  for (const double value : {-1e3, std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<SparseBlock> broken = blocks;
    broken.push_back({17, 17, value * Mat3::Identity()});
    EXPECT_FALSE(factor.factorize(36, broken, no_limit)) << value;
  }
  ASSERT_TRUE(factor.factorize(36, blocks, no_limit));
  EXPECT_LT(error_of(factor, 36, blocks), 1e-11);
}

}  // namespace
}  // namespace duet::sparse_cholesky_test
