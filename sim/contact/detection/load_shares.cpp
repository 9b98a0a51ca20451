#include "sim/contact/detection/load_shares.h"

#include <array>
#include <cmath>
#include <numeric>

#include "sim/base/dense_solvers.h"
#include "sim/base/index.h"

namespace duet {
namespace {

using Vec2 = Eigen::Vector2d;
using Moments = Eigen::Matrix<double, 6, 1>;  // see moments_of()

// Added to the diagonal of the system for y, whose entries are of the order of 1. It keeps the system regular
// if the places leave conditions undecided; a larger value would make the conditions inexact.
constexpr double regularization = 1e-9;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

// Returns the length of a vector. std::hypot is not used because its last bit depends on the library.
double length(const Vec2& a) { return std::sqrt(a.x() * a.x() + a.y() * a.y()); }

// Returns the center of area (m) of a convex polygon, and sets `area` (m^2).
Vec2 center_of_area(std::span<const Vec2> corners, double& area) {
  Vec2 sum(0, 0);
  area = 0;
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Vec2 b = corners[i] - corners[0], c = corners[i + 1] - corners[0];
    const double part = cross(b, c) / 2;
    area += part;
    sum += part / 3 * (b + c);
  }
  return corners[0] + sum / area;
}

// Returns the functions 1, x, |x| and x/|x| of a place, whose means the points have to reproduce. Here x is
// the displacement from the middle in units of the mean distance.
Moments moments_of(const EvenLoad& load, const Vec2& place) {
  const Vec2 x = (place - load.middle) / load.mean_distance;
  const double r = length(x);
  const Vec2 direction = r > 0 ? Vec2(x / r) : Vec2(0, 0);
  Moments result;
  result << 1, x.x(), x.y(), r, direction.x(), direction.y();
  return result;
}

}  // namespace

//   integral of r dA = h/3 integral of |x(s)| ds,  integral of x/r dA = h/2 integral of x(s)/|x(s)| ds
// over the triangle between the middle and an edge at the distance h from it, along which s runs, with r =
// |x|. The integrals along the edge use the Gauss rule with five points, whose error is 1e-5 for the edge of
// a square.
EvenLoad even_load(std::span<const Vec2> corners) {
  constexpr std::array<std::array<double, 2>, 5> gauss{
      {{0.0469100770306680, 0.1184634425280945},
       {0.2307653449471585, 0.2393143352496832},
       {0.5, 0.2844444444444444},
       {0.7692346550528415, 0.2393143352496832},
       {0.9530899229693320, 0.1184634425280945}}};  // place along the edge, weight
  EvenLoad load;
  load.middle = center_of_area(corners, load.area);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec2 a = corners[i] - load.middle, b = corners[(i + 1) % corners.size()] - load.middle;
    const double twice_area = cross(a, b);
    for (const auto& [place, weight] : gauss) {
      const Vec2 x = a + place * (b - a);
      const double r = length(x);
      if (!(r > 0)) continue;
      load.mean_distance += twice_area / 3 * weight * r;
      load.mean_direction += twice_area / 2 * weight / r * x;
    }
  }
  load.mean_distance /= load.area;
  load.mean_direction /= load.area;
  return load;
}

//   w_i = s_i (1 + f_i . y)
// minimizes the sum of (w_i - s_i)^2 / s_i under the conditions sum of w_i f_i = f. Here s_i are the shares
// so far, w_i the new ones, f_i the functions of moments_of() at the points, f their means under the even
// load, and y the Lagrange multipliers of the conditions. Points whose share would become negative are
// dropped, and the others solved for again.
void share_load(const EvenLoad& load, std::span<const Vec2> places, std::span<double> shares) {
  Moments even;
  even << 1, 0, 0, 1, load.mean_direction.x(), load.mean_direction.y();
  for (std::size_t round = 0; round <= places.size(); ++round) {  // each one but the last drops a point
    Moments missing = even;
    SquareMatrix<6> matrix = regularization * SquareMatrix<6>::Identity();
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Moments f = moments_of(load, places[i]);
      missing -= shares[i] * f;
      for (int row = 0; row < 6; ++row)
        for (int column = 0; column <= row; ++column) matrix(row, column) += shares[i] * f[row] * f[column];
    }
    const Moments y = SymmetricFactor<6>(matrix).solve(missing);
    bool pulls = false;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Moments f = moments_of(load, places[i]);
      double change = 0;
      for (int row = 0; row < 6; ++row) change += f[row] * y[row];
      if (shares[i] > 0 && change < -1) {
        shares[i] = 0;
        pulls = true;
      }
    }
    if (pulls) continue;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Moments f = moments_of(load, places[i]);
      double change = 0;
      for (int row = 0; row < 6; ++row) change += f[row] * y[row];
      shares[i] *= 1 + change;
    }
    break;
  }
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share /= sum;
}

}  // namespace duet
