#include "sim/contact/detection/load_shares.h"

#include <array>
#include <cmath>
#include <numeric>

#include "sim/base/dense_solvers.h"
#include "sim/base/index.h"

namespace duet {
namespace {

using Vec2 = Eigen::Vector2d;
using Moments = Eigen::Matrix<double, 6, 1>;

constexpr int most_rounds = 8;  // of dropping points that would have to pull
// What keeps the system regular where the places leave conditions undecided.
constexpr double regularization = 1e-9;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

// Length without std::hypot, whose last bit is left to the library.
double length(const Vec2& a) { return std::sqrt(a.x() * a.x() + a.y() * a.y()); }

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

// 1, x, |x| and x/|x| of a place, in units of the mean distance.
Moments moments_of(const EvenLoad& load, const Vec2& place) {
  const Vec2 x = (place - load.middle) / load.mean_distance;
  const double r = length(x);
  const Vec2 direction = r > 0 ? Vec2(x / r) : Vec2(0, 0);
  Moments result;
  result << 1, x.x(), x.y(), r, direction.x(), direction.y();
  return result;
}

}  // namespace

// From the triangles between the middle and the edges: with an edge at the distance h, along which s runs,
//   integral of r dA = h/3 integral of |x(s)| ds,  integral of x/r dA = h/2 integral of x(s)/|x(s)| ds,
// by Gauss's rule of five points, which is right to 1e-5 for the edge of a square.
EvenLoad even_load(std::span<const Vec2> corners) {
  constexpr std::array<std::array<double, 2>, 5> gauss{
      {{0.0469100770306680, 0.1184634425280945},
       {0.2307653449471585, 0.2393143352496832},
       {0.5, 0.2844444444444444},
       {0.7692346550528415, 0.2393143352496832},
       {0.9530899229693320, 0.1184634425280945}}};  // place, weight
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

// Minimizes the sum of (w_i - s_i)^2 / s_i under sum of w_i f_i = f of the even load: w_i = s_i (1 + f_i .
// y).
void share_load(const EvenLoad& load, std::span<const Vec2> places, std::span<double> shares) {
  Moments even;
  even << 1, 0, 0, 1, load.mean_direction.x(), load.mean_direction.y();
  for (int round = 0; round < most_rounds; ++round) {
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
