// Small products and sums that the finite elements of a batch compute in packs, one element in each lane.
#pragma once

#include <array>

#include "sim/base/matrix3.h"
#include "sim/deformable/forces/particle_blocks.h"
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

/// Returns the columns of a matrix.
inline std::array<vector8, 3> columns_of(const Matrix3<double8>& A) {
  std::array<vector8, 3> columns;
  for (std::size_t k = 0; k < 3; ++k) columns[k] = {A[0][k], A[1][k], A[2][k]};
  return columns;
}

/// Returns the time (s) for which a turn by the angular velocity `spin` (rad/s) counts after `seconds`.
///
///     t / sqrt(1 + w^2 t^2)
///
/// It is that of a vector that keeps its velocity.
inline double8 turn_time(const vector8& spin, double seconds) {
  return seconds / sqrt_of(1.0 + seconds * seconds * dot(spin, spin));
}

/// Returns the angular velocity w (rad/s) of the columns f_k (m) of a deformation gradient that change by g_k
/// (m/s).
///
///     (tr(B) 1 - B) w = sum f_k x g_k,   B = sum f_k f_k^T
///
/// It is that of unit masses at the columns: their angular momentum over their inertia. `columns` is 3 for
/// volumes and 2 for membranes. The matrix is regular as long as two columns are not parallel, also if the
/// element is inverted; else the angular velocity is 0.
template <std::size_t columns>
vector8 spin_of_columns(const std::array<vector8, columns>& f, const std::array<vector8, columns>& g) {
  double8 xx{}, yy{}, zz{}, yz{}, xz{}, xy{};
  vector8 moment{};
  for (std::size_t k = 0; k < columns; ++k) {
    xx += f[k].y * f[k].y + f[k].z * f[k].z;
    yy += f[k].x * f[k].x + f[k].z * f[k].z;
    zz += f[k].x * f[k].x + f[k].y * f[k].y;
    yz = yz - f[k].y * f[k].z;
    xz = xz - f[k].x * f[k].z;
    xy = xy - f[k].x * f[k].y;
    moment = moment + cross(f[k], g[k]);
  }
  const vector8 a{yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy};  // columns of the adjugate
  const vector8 b{a.y, xx * zz - xz * xz, xy * xz - xx * yz};
  const vector8 c{a.z, b.z, xx * yy - xy * xy};
  const double8 determinant = xx * a.x + xy * a.y + xz * a.z, size = xx + yy + zz;
  // Points on a line have a determinant of zero but for rounding, 1e-16 of the cube of the trace.
  const mask8 is_regular = determinant > 1e-12 * size * size * size;
  const double8 inverse =
      select(is_regular, 1.0 / select(is_regular, determinant, double8{} + 1.0), double8{});
  return inverse * (moment.x * a + moment.y * b + moment.z * c);
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

/// Appends the blocks of two corners of a batch, one for each lane, given by their columns.
inline void append_lanes(const PackIndex& row, const PackIndex& column, const std::array<vector8, 3>& block,
                         std::vector<ParticleBlock>& blocks) {
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    Mat3 of_lane;
    for (std::size_t k = 0; k < 3; ++k)
      of_lane.col(static_cast<int>(k)) << block[k].x[lane], block[k].y[lane], block[k].z[lane];
    append_block(row[lane], column[lane], of_lane, blocks);
  }
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
