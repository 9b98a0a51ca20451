// Small products and sums that the finite elements of a batch compute in packs, one element in each lane.
#pragma once

#include <array>

#include "sim/base/matrix3.h"
#include "sim/deformable/scatter_add.h"

namespace duet {

/// Returns the gradient D_s D_m^-1 of the linear function with the values value(corner) at the four corners.
///
/// It is the deformation gradient F for positions, and its rate for velocities. `inverse_rest` is D_m^-1
/// (1/m); D_s has the differences of the corners 1 to 3 from corner 0 as columns.
template <class P, class Value>
Matrix3<P> gradient_of(const Matrix3<P>& inverse_rest, Value&& value) {
  const VectorOf<P> origin = value(0);
  Matrix3<P> edges;
  for (int k = 0; k < 3; ++k) {
    const VectorOf<P> edge = value(as_index(k + 1)) - origin;
    edges[0][k] = edge.x;
    edges[1][k] = edge.y;
    edges[2][k] = edge.z;
  }
  return edges * inverse_rest;
}

/// Returns von Mises' equivalent sqrt(3/2 s : s), s = a - tr(a)/3, of the symmetric stress `a`.
inline double8 von_mises(const Matrix3<double8>& a) {
  const double8 mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
  double8 squares = 2.0 * (a[0][1] * a[0][1] + a[1][2] * a[1][2] + a[2][0] * a[2][0]);
  for (int i = 0; i < 3; ++i) squares += (a[i][i] - mean) * (a[i][i] - mean);
  return sqrt_of(1.5 * squares);
}

/// Returns the product A v.
inline vector8 product(const Matrix3<double8>& A, const vector8& v) {
  return {A[0][0] * v.x + A[0][1] * v.y + A[0][2] * v.z, A[1][0] * v.x + A[1][1] * v.y + A[1][2] * v.z,
          A[2][0] * v.x + A[2][1] * v.y + A[2][2] * v.z};
}

/// Adds the columns of H (N) to the partial sums of corners 1 to 3, and minus the sum of the columns to that
/// of corner 0.
///
/// `fourth` is added as the fourth component of the partial sum of every corner.
inline void spread_columns(const Matrix3<double8>& H, const double8& fourth,
                           const std::array<ScatterAdd::Slot, 4>& slot, double4* sums) {
  vector8 force[4];
  for (int k = 0; k < 3; ++k) force[k + 1] = {H[0][k], H[1][k], H[2][k]};
  force[0] = {-(force[1].x + force[2].x + force[3].x), -(force[1].y + force[2].y + force[3].y),
              -(force[1].z + force[2].z + force[3].z)};
  for (std::size_t i = 0; i < slot.size(); ++i) ScatterAdd::spread(slot[i], force[i], fourth, sums);
}

/// Adds factor v v^T to the upper triangle of `sum`.
inline void add_square(const double8& factor, const vector8& v, Matrix3<double8>& sum) {
  const double8 x = factor * v.x, y = factor * v.y;
  sum[0][0] += x * v.x;
  sum[0][1] += x * v.y;
  sum[0][2] += x * v.z;
  sum[1][1] += y * v.y;
  sum[1][2] += y * v.z;
  sum[2][2] += factor * v.z * v.z;
}

}  // namespace duet
