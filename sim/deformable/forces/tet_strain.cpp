#include "sim/deformable/forces/tet_strain.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "sim/base/dense_solvers.h"

namespace duet {
namespace {

// Returns an upper bound on the squares of the principal stretches, the eigenvalues of C, by more than their
// rounding. It is the largest eigenvalue if the other two are equal.
//
//     m + sqrt(2/3) |C - m 1|,   m = tr(C) / 3
double largest_square_bound(const Mat3& C) {
  const double mean = C.trace() / 3;
  return (1 + 1e-12) * (mean + std::sqrt((C - mean * Mat3::Identity()).squaredNorm() * (2.0 / 3)));
}

}  // namespace

Mat3 edge_matrix(const Tet& tet, const std::vector<Vec3>& x) {
  Mat3 edges;
  for (int k = 0; k < 3; ++k)
    edges.col(k) = x[static_cast<std::size_t>(tet[static_cast<std::size_t>(k) + 1])] -
                   x[static_cast<std::size_t>(tet[0])];
  return edges;
}

void take_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                 const std::vector<Vec3>& x, FiniteElements::Strain& strain) {
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const Mat3 F = edge_matrix(tets[t], x) * inverse_rest[t];
    const double det = F.determinant();
    if (det <= 0) ++strain.inverted;
    if (strain.worst_tet < 0 || det < strain.min_det) {
      strain.min_det = det;
      strain.worst_tet = static_cast<int>(t);
    }
    const Mat3 C = F.transpose() * F;
    if (largest_square_bound(C) <= strain.max_stretch * strain.max_stretch) continue;
    const Vec3 squares = symmetric_eigen<3>(C).values;
    strain.max_stretch = std::max(strain.max_stretch, std::sqrt(squares[2]));
  }
}

void raise_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                  const std::vector<Vec3>& x, std::vector<float>& strain) {
  constexpr float inverted = FiniteElements::inverted;
  for (std::size_t t = 0; t < tets.size(); ++t) {
    const Mat3 F = edge_matrix(tets[t], x) * inverse_rest[t];
    const bool is_inverted = F.determinant() <= 0;
    double largest = 0;
    if (!is_inverted) {
      const Vec3 squares = symmetric_eigen<3>(F.transpose() * F).values;
      for (int i : {0, 2}) largest = std::max(largest, std::abs(std::sqrt(std::max(squares[i], 0.0)) - 1));
    }
    for (int p : tets[t]) {
      float& here = strain[static_cast<std::size_t>(p)];
      if (is_inverted)
        here = inverted;
      else if (here != inverted)
        here = std::max(here, static_cast<float>(largest));
    }
  }
}

}  // namespace duet
