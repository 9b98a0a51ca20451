// The order in which Eigen sums up scalar products, the same for all its versions: up to version 3.4 that of
// sum(), x + (y + z) of three numbers, from 5 on (x + y) + z. Included wherever Eigen's vectors come from
// (sim/base/types.h), so that all of the program has the one.
#pragma once

#include <type_traits>

#include <Eigen/Core>

#if EIGEN_WORLD_VERSION > 3 || EIGEN_MAJOR_VERSION > 4

namespace Eigen::internal {

// Of vectors of a fixed length: those of others are summed up one by one in all versions.
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
