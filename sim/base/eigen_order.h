// Fixes the order in which Eigen sums the products of a scalar product, so that it is the same in all
// versions. Up to version 3.4 it is that of sum(), which adds three numbers as x + (y + z); from version 5 on
// Eigen adds them as (x + y) + z. sim/base/types.h includes this file, so that the whole program uses the
// order of 3.4.
#pragma once

#include <type_traits>

#include <Eigen/Core>

#if EIGEN_WORLD_VERSION > 3 || EIGEN_MAJOR_VERSION > 4

namespace Eigen::internal {

/// Scalar products of vectors of fixed length use sum(). Vectors of variable length are summed one by one in
/// all versions and need no specialization.
template <class Left, class Right>
requires(int(Left::SizeAtCompileTime) > 2 && int(Left::SizeAtCompileTime) == int(Right::SizeAtCompileTime) &&
         std::is_floating_point_v<typename Left::Scalar>) struct dot_impl<Left, Right> {
  static typename Left::Scalar run(const MatrixBase<Left>& left, const MatrixBase<Right>& right) {
    if constexpr (int(Left::RowsAtCompileTime) == int(Right::RowsAtCompileTime))
      return left.cwiseProduct(right).sum();
    else
      return left.transpose().cwiseProduct(right).sum();
  }
};

}  // namespace Eigen::internal

#endif
