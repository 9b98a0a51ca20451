#include "sim/rigid/orientation_update.h"

#include <array>
#include <cmath>

#include "sim/base/rotation.h"

namespace duet {
namespace {

// Largest turn of a piece, rad: so short that about 15 terms of the Taylor series give double precision.
// Longer pieces would need more terms.
constexpr double longest_piece = 0.1;
// Largest number of pieces: 6.4 rad, about a turn in a step. Longer turns are beyond what a step resolves.
constexpr int max_pieces = 64;
// Largest number of terms of the series: more than a piece needs.
constexpr std::size_t max_terms = 24;

// Returns the product of the quaternions a and (0, b).
Quat times_vector(const Quat& a, const Vec3& b) {
  const Vec3 v = a.w() * b + a.vec().cross(b);
  return Quat(-a.vec().dot(b), v.x(), v.y(), v.z());
}

// Advances m = Q^T L over `dt` (s) by the Taylor series of m' = m x (J m), and returns the rotation over
// `dt`. Term k of each series includes its factor dt^k. Afterwards m is scaled to its first length, which the
// motion keeps.
Quat advance(const Mat3& J, double dt, Vec3& m) {
  constexpr double rounding = 0x1p-56;         // relative size of a term that double precision does not see
  std::array<Vec3, max_terms> momentum, rate;  // terms of m and of J m
  std::array<Quat, max_terms> turn;            // terms of the rotation
  momentum[0] = m;
  rate[0] = J * m;
  turn[0] = Quat::Identity();
  Quat sum = turn[0];
  const double size = m.norm();
  for (std::size_t k = 0; k + 1 < max_terms; ++k) {
    Vec3 change = Vec3::Zero();
    Eigen::Vector4d turn_change = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i <= k; ++i) {
      change += momentum[i].cross(rate[k - i]);
      turn_change += times_vector(turn[i], rate[k - i]).coeffs();
    }
    const double scale = dt / static_cast<double>(k + 1);
    momentum[k + 1] = scale * change;
    rate[k + 1] = J * momentum[k + 1];
    turn[k + 1].coeffs() = scale / 2 * turn_change;
    m += momentum[k + 1];
    sum.coeffs() += turn[k + 1].coeffs();
    if (momentum[k + 1].norm() <= rounding * size && turn[k + 1].norm() <= rounding) break;
  }
  m *= size / m.norm();
  return sum.normalized();
}

}  // namespace

Quat free_rotation(const Mat3& inverse_inertia, const Vec3& L, double dt) {
  const Vec3 w = inverse_inertia * L;
  const double angle = std::abs(dt) * w.norm();
  if (angle == 0) return Quat::Identity();
  if (!(angle < longest_piece * max_pieces)) return exponential(dt * w);
  const int pieces = static_cast<int>(std::ceil(angle / longest_piece));
  Vec3 m = L;
  Quat rotation = Quat::Identity();
  for (int i = 0; i < pieces; ++i) rotation = rotation * advance(inverse_inertia, dt / pieces, m);
  return rotation;
}

}  // namespace duet
