#include "sim/articulation/block_factor.h"

#include <algorithm>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace duet::block_factor_test {
namespace {

// A random matrix S = J M^-1 J^T with the block structure of joints between bodies, dense and by blocks.
struct System {
  // Scalar rows of each block row, pairs of block rows that are coupled, and S itself.
  std::vector<int> rows;
  std::vector<std::pair<int, int>> couplings;
  Eigen::MatrixXd dense;
};

// Returns the system of `count` block rows of 1 to 9 rows that are coupled in a ring, with one chord across
// it. Every coupling adds A^T A with a random A of 6 rows, so that the matrix is symmetric positive
// semi-definite.
System ring(int count, unsigned seed) {
  System system;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<int> first{0};
  for (int i = 0; i < count; ++i) {
    system.rows.push_back(1 + (5 * i) % 9);
    first.push_back(first.back() + system.rows.back());
  }
  system.dense = Eigen::MatrixXd::Zero(first.back(), first.back());
  for (int i = 0; i < count; ++i)
    for (const int j : {(i + 1) % count, (i + count / 2) % count}) {
      if (i == j || (j == (i + count / 2) % count && i != 0)) continue;
      const std::pair<int, int> pair = std::minmax(i, j);
      if (std::find(system.couplings.begin(), system.couplings.end(), pair) == system.couplings.end())
        system.couplings.push_back(pair);
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6, first.back());  // A: six rows over two blocks
      for (Eigen::Index r = 0; r < 6; ++r) {
        for (int c = first[static_cast<std::size_t>(i)]; c < first[static_cast<std::size_t>(i) + 1]; ++c)
          rows(r, c) = number(random);
        for (int c = first[static_cast<std::size_t>(j)]; c < first[static_cast<std::size_t>(j) + 1]; ++c)
          rows(r, c) = number(random);
      }
      system.dense += rows.transpose() * rows;
    }
  return system;
}

// Factors the system by blocks and returns the solution for the right side `right`.
std::vector<BlockFactor::Segment> solve(const System& system, const Eigen::VectorXd& right) {
  BlockFactor factor;
  factor.analyze(system.rows, system.couplings);
  factor.set_zero();
  std::vector<int> first{0};
  for (const int n : system.rows) first.push_back(first.back() + n);
  const auto block = [&](int i, int j) {
    return system.dense.block(first[static_cast<std::size_t>(i)], first[static_cast<std::size_t>(j)],
                              system.rows[static_cast<std::size_t>(i)],
                              system.rows[static_cast<std::size_t>(j)]);
  };
  for (int i = 0; i < static_cast<int>(system.rows.size()); ++i) factor.diagonal(i) = block(i, i);
  for (const auto& [i, j] : system.couplings) factor.add_coupling(i, j, block(i, j));
  factor.factor();
  std::vector<BlockFactor::Segment> x;
  for (std::size_t i = 0; i < system.rows.size(); ++i) x.push_back(right.segment(first[i], system.rows[i]));
  factor.solve(x);
  return x;
}

// Returns the segments of a block vector, one after the other.
Eigen::VectorXd joined(const std::vector<BlockFactor::Segment>& x) {
  Eigen::Index size = 0;
  for (const auto& segment : x) size += segment.size();
  Eigen::VectorXd all(size);
  Eigen::Index at = 0;
  for (const auto& segment : x) {
    all.segment(at, segment.size()) = segment;
    at += segment.size();
  }
  return all;
}

// The block solution agrees with the dense LU solution of Eigen. With 1 on the diagonal the matrices are well
// conditioned, so the bound of 1e-12 (relative) is rounding with a margin. A ring with a chord has fill-in:
// an error in the elimination of blocks that are not neighbors at first shows here.
TEST(BlockFactor, SolvesLikeADenseOne) {
  for (const int count : {1, 2, 3, 7, 12}) {
    System system = ring(count, 7);
    system.dense.diagonal().array() += 1;
    const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(system.dense.rows(), -1, 2);
    const Eigen::VectorXd x = joined(solve(system, right)),
                          expected = system.dense.partialPivLu().solve(right);
    EXPECT_LT((x - expected).norm(), 1e-12 * expected.norm()) << count << " blocks";
  }
}

// A row that repeats another one is left out: the system is still solved to 1e-9 (relative), which is ten
// times the pivot at which a row counts as dependent, and the solution stays of the size of the one that the
// right side was made from. A division by the pivot of the dependent row would make the solution large.
TEST(BlockFactor, DependentRowsTakeNoPart) {
  System system = ring(6, 3);
  const Eigen::Index last = system.dense.rows() - 1;
  // The last row repeats the one before it.
  system.dense.row(last) = system.dense.row(last - 1);
  system.dense.col(last) = system.dense.col(last - 1);
  system.dense.diagonal().head(last - 1).array() += 1;
  const Eigen::VectorXd wanted = Eigen::VectorXd::LinSpaced(last + 1, 0.5, 1.5);
  const Eigen::VectorXd right = system.dense * wanted;
  const Eigen::VectorXd x = joined(solve(system, right));
  EXPECT_LT((system.dense * x - right).norm(), 1e-9 * right.norm());
  EXPECT_LT(x.norm(), 10 * wanted.norm());
}

// The bits of the solution do not depend on the addresses of the blocks. The allocator aligns memory to 16
// bytes and vectors take up to 64: every gap of 40 bytes moves the next blocks on by 48. Sums that depend on
// alignment would break the determinism of runs.
TEST(BlockFactor, SolvesTheSameWhereverItsBlocksAre) {
  const System system = ring(12, 7);
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(system.dense.rows(), -1, 1);
  const Eigen::VectorXd expected = joined(solve(system, right));
  std::vector<std::vector<char>> gaps;
  for (int i = 0; i < 8; ++i) {
    gaps.emplace_back(40);
    EXPECT_EQ(joined(solve(system, right)), expected) << i;
  }
}

#ifdef DUET_ASSERTS
// A block that analyze() was not told of would be added to another one.
TEST(BlockFactor, RefusesCouplingsThatItWasNotToldOf) {
  BlockFactor factor;
  factor.analyze({1, 1, 1}, {{0, 1}});
  EXPECT_DEATH(factor.add_coupling(0, 2, BlockFactor::Block::Zero(1, 1)), "entry != end");
  EXPECT_DEATH(factor.add_coupling(0, 1, BlockFactor::Block::Zero(2, 1)), "block.rows");
}
#endif

}  // namespace
}  // namespace duet::block_factor_test
