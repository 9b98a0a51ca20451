// Symmetric 3x3 matrices, one for each particle, and their sums over elements.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/scatter_add.h"

namespace duet {

/// Symmetric 3x3 matrix.
struct SymmetricBlock {
  Vec3 diagonal = Vec3::Zero();  ///< the entries xx, yy, zz
  Vec3 other = Vec3::Zero();     ///< the entries yz, xz, xy

  /// Returns the product of the matrix with `v`.
  Vec3 operator*(const Vec3& v) const {
    return diagonal.cwiseProduct(v) + Vec3(other.z() * v.y() + other.y() * v.z(),
                                           other.z() * v.x() + other.x() * v.z(),
                                           other.y() * v.x() + other.x() * v.y());
  }
  /// Returns the inverse; the matrix must be positive definite (it is not checked).
  SymmetricBlock inverse() const {
    const Vec3& d = diagonal;
    const Vec3& o = other;
    SymmetricBlock adjugate;
    adjugate.diagonal =
        Vec3(d.y() * d.z() - o.x() * o.x(), d.x() * d.z() - o.y() * o.y(), d.x() * d.y() - o.z() * o.z());
    adjugate.other =
        Vec3(o.y() * o.z() - o.x() * d.x(), o.x() * o.z() - o.y() * d.y(), o.x() * o.y() - o.z() * d.z());
    const double determinant =
        d.x() * adjugate.diagonal.x() + o.z() * adjugate.other.z() + o.y() * adjugate.other.y();
    adjugate.diagonal /= determinant;
    adjugate.other /= determinant;
    return adjugate;
  }
};

/// Adds the symmetric matrices that the lanes of a batch have for one corner to the partial sums of the
/// particles at `slot`.
///
/// `diagonal` holds xx, yy, zz and `other` yz, xz, xy. To be called from the callback of add_blocks().
inline void spread_block(const ScatterAdd::Slot& slot, const vector8& diagonal, const vector8& other,
                         double4* sums) {
  ScatterAdd::spread<2>(slot, diagonal, double8{}, sums);
  ScatterAdd::spread<2>(slot, other, double8{}, sums + 1);
}
/// Adds factor n n^T of each lane to the partial sums of the particles at `slot`, as spread_block() does.
inline void spread_square(const ScatterAdd::Slot& slot, const double8& factor, const vector8& n,
                          double4* sums) {
  const vector8 part = factor * n;
  spread_block(slot, {part.x * n.x, part.y * n.y, part.z * n.z}, {part.y * n.z, part.x * n.z, part.x * n.y},
               sums);
}

/// Adds the sums of element matrices to the matrices `blocks` of the particles: calls spread(index of a
/// batch, partial sums), see ScatterAdd::fill().
template <class Spread>
void add_blocks(ScatterAdd& sums, std::vector<SymmetricBlock>& blocks, Spread&& spread) {
  sums.fill<2>(spread);
  sums.for_each<2>([&](std::size_t p, const std::array<double4, 2>& sum) {
    blocks[p].diagonal += Vec3(sum[0][0], sum[0][1], sum[0][2]);
    blocks[p].other += Vec3(sum[1][0], sum[1][1], sum[1][2]);
  });
}

}  // namespace duet
