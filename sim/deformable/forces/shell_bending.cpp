#include "sim/deformable/forces/shell_bending.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace duet {
namespace {

// Largest bend at rest that counts as none, rad.
constexpr double flat_shell = 1e-6;

// Relative size of a combination of curvatures below which the bends around an edge count as blind to it. The
// weights of bends would grow with the inverse of its root: without this limit, the highest frequency of a
// sheet whose nodes are moved at random by a quarter of their distance is three times as high. Twice the
// limit leaves eight times the error, which is 1e-3 of the energy for cells of 1 to 3 that are cut by both
// diagonals.
constexpr double blind = 1e-3;

// A weighted sum of positions: particles and their weights.
using PointSum = std::map<int, double>;

void add_scaled(double factor, const PointSum& term, PointSum& sum) {
  for (const auto& [particle, weight] : term) sum[particle] += factor * weight;
}

// A linear function of a symmetric 2x2 tensor S: its coefficients on (S_xx, sqrt(2) S_xy, S_yy). The product
// of two of them does not depend on the axes.
using Functional = Vec3;

// Returns the function u . S v.
Functional between(const Vec2& u, const Vec2& v) {
  return Vec3(u.x() * v.x(), (u.x() * v.y() + u.y() * v.x()) / std::numbers::sqrt2, u.y() * v.y());
}

// Returns f . Q^-1 g for the energy S . Q S = (1 - nu) S : S + nu (tr S)^2.
double compliance(const Functional& f, const Functional& g, double nu) {
  return (f.dot(g) - nu / (1 + nu) * (f.x() + f.z()) * (g.x() + g.z())) / (1 - nu);
}

// Orthogonal unit vectors in the plane of a triangle.
struct Axes {
  Vec3 x, y;

  Vec2 components(const Vec3& v) const { return Vec2(v.dot(x), v.dot(y)); }
};

// Returns the function `f` for the axes `from` as one for the axes `to` in the same plane.
Functional in_axes(const Functional& f, const Axes& from, const Axes& to) {
  const Vec2 x = to.components(from.x), y = to.components(from.y);
  return f.x() * between(x, x) + std::numbers::sqrt2 * f.y() * between(x, y) + f.z() * between(y, y);
}

// One side of an inner edge: the edge and 0 or 1 for its first or second triangle; `hinge` is -1 on the
// border.
struct HingeSide {
  int hinge = -1;
  std::size_t side = 0;
};

// An inner edge between two triangles.
struct Hinge {
  // Length of the edge times the bend across it (m), in the direction of the normal: the mean curvature of
  // Bergou, Wardetzky, Harmon, Zorin, Grinspun, "A Quadratic Bending Model for Inextensible Surfaces" (2006).
  PointSum bend;
  // `bend` of a surface of the curvature S (1/m), in `axes` of either side.
  Functional functional;
  // x along the edge; y across it, from the second triangle to the first.
  std::array<Axes, 2> axes;
  std::array<int, 2> triangle{-1, -1};
  // Fraction of the bend that is on the first side if the surface bends across the edge only.
  double first_fraction = 0;
  // Length of the edge times the angle that is on the second side instead of the first, as a sum of bends.
  PointSum shift;
};

// Makes the elements of a shell.
class ShellAssembly {
 public:
  ShellAssembly(const std::vector<Triangle>& triangles, const std::vector<SheetEdge>& edges,
                const std::vector<Vec3>& rest);
  // Returns whether triangle `t` has an inner edge.
  bool bends(std::size_t t) const {
    return std::any_of(sides_[t].begin(), sides_[t].end(), [](const HingeSide& s) { return s.hinge >= 0; });
  }
  // Returns the element of triangle `t`, see shell_bending().
  ShellBending element(std::size_t t, double rigidity, double nu, double damping) const {
    return springs_on(curvatures(t, nu), rigidity / area(t), damping);
  }

 private:
  const Vec3& at(int particle) const { return rest_[as_index(particle)]; }
  double area(std::size_t t) const;
  void add_hinge(const SheetEdge& edge);
  // Returns the function of S that is the length of edge `k` of triangle `t` times the angle between the
  // triangle and the surface in the middle of the edge (m).
  Functional side_functional(std::size_t t, std::size_t k, const Axes& axes) const;
  void find_shift(Hinge& hinge) const;
  // Returns the length of an edge times the angle of side_functional(), as a sum of bends.
  PointSum side_bend(const HingeSide& side) const;
  // Returns the sums d of triangle `t`, one for each inner edge, see shell_bending().
  std::vector<PointSum> curvatures(std::size_t t, double nu) const;
  // Returns springs of the given stiffness (N/m) on the lengths of the sums d.
  ShellBending springs_on(const std::vector<PointSum>& curvatures, double stiffness, double damping) const;
  // Returns axes in the plane of triangle `t`.
  Axes axes_of(std::size_t t) const;

  const std::vector<Triangle>& triangles_;
  const std::vector<Vec3>& rest_;
  std::vector<Hinge> hinges_;
  std::vector<std::array<HingeSide, 3>> sides_;  // by triangle: its edges, from corner k to corner k + 1
};

ShellAssembly::ShellAssembly(const std::vector<Triangle>& triangles, const std::vector<SheetEdge>& edges,
                             const std::vector<Vec3>& rest)
    : triangles_(triangles), rest_(rest), sides_(triangles.size()) {
  std::map<std::pair<int, int>, std::pair<int, const SheetEdge*>> inner;
  for (const SheetEdge& edge : edges) {
    if (edge.other_opposite < 0) continue;
    inner[std::minmax(edge.a, edge.b)] = {static_cast<int>(hinges_.size()), &edge};
    add_hinge(edge);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto found = inner.find(std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]));
      if (found == inner.end()) continue;
      const auto& [hinge, edge] = found->second;
      const int corner = triangles[t][(k + 2) % 3];
      std::array<int, 2>& owner = hinges_[as_index(hinge)].triangle;
      // An edge of more than two triangles bends between two of them.
      for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
        if (owner[side] >= 0 || corner != (side == 0 ? edge->opposite : edge->other_opposite)) continue;
        owner[side] = static_cast<int>(t);
        sides_[t][k] = {hinge, side};
        break;
      }
    }
  for (Hinge& hinge : hinges_) find_shift(hinge);
}

Axes ShellAssembly::axes_of(std::size_t t) const {
  const Triangle& corner = triangles_[t];
  const Vec3 x = (at(corner[1]) - at(corner[0])).normalized(), side = at(corner[2]) - at(corner[0]);
  return {x, (side - side.dot(x) * x).normalized()};
}

double ShellAssembly::area(std::size_t t) const {
  const Triangle& corner = triangles_[t];
  return (at(corner[1]) - at(corner[0])).cross(at(corner[2]) - at(corner[0])).norm() / 2;
}

// The weights are sums of cotangents of the angles at rest. For the deflection u = x . S x / 2 of a flat
// sheet, the bend is their sum over u at the nodes, with the second triangle turned into the plane of the
// first. It points against the normal where u is convex.
void ShellAssembly::add_hinge(const SheetEdge& edge) {
  Hinge hinge;
  const Vec3& a = at(edge.a);
  const Vec3 along = at(edge.b) - a, direction = along.normalized();
  const std::array<int, 2> opposite{edge.opposite, edge.other_opposite};
  std::array<double, 2> height;
  hinge.functional.setZero();
  for (std::size_t side = 0; side < 2; ++side) {
    const Vec3 c = at(opposite[side]) - a;
    const Vec3 across = c - c.dot(direction) * direction;
    height[side] = across.norm();
    const double sign = side == 0 ? 1 : -1;
    hinge.axes[side] = {direction, sign / height[side] * across};
    const double weight = -along.norm() / height[side], place = c.dot(direction) / along.norm();
    add_scaled(weight, {{opposite[side], 1}, {edge.a, place - 1}, {edge.b, -place}}, hinge.bend);
    const Vec2 end = hinge.axes[side].components(along), tip = hinge.axes[side].components(c);
    hinge.functional -= weight / 2 * (between(tip, tip) - place * between(end, end));
  }
  hinge.first_fraction = height[0] / (height[0] + height[1]);
  hinges_.push_back(hinge);
}

// The n_k n_k^T of the three edges have the dual tensors -l_k^2 / (8 A^2) (e_i e_j^T + e_j e_i^T), with the
// other two edges e_i and e_j: n_k . e_i = -n_k . e_j = 2 A / l_k, and n_i . e_i = 0.
Functional ShellAssembly::side_functional(std::size_t t, std::size_t k, const Axes& axes) const {
  const Triangle& corner = triangles_[t];
  const Vec3 &a = at(corner[k]), &b = at(corner[(k + 1) % 3]), &c = at(corner[(k + 2) % 3]);
  return -(b - a).squaredNorm() / (4 * area(t)) * between(axes.components(c - b), axes.components(a - c));
}

// The first side has the fraction f of the bend, less the shift. Both are exact for a constant curvature S if
//
//     shift(S) = f bend(S) - side(S)
//
// The weights of the bends around the edge with the least sum of squares are M^T (M M^T)^-1 times this, where
// the columns of M are the functions of S that the bends are. Three steps of Tikhonov's method leave out what
// the bends hardly depend on.
void ShellAssembly::find_shift(Hinge& hinge) const {
  if (hinge.triangle[0] < 0 || hinge.triangle[1] < 0) return;
  Functional wanted = hinge.first_fraction * hinge.functional;
  std::vector<std::pair<const Hinge*, Functional>> around{{&hinge, hinge.functional}};
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t t = as_index(hinge.triangle[side]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (sides_[t][k].hinge < 0) continue;
      const Hinge& other = hinges_[as_index(sides_[t][k].hinge)];
      if (&other != &hinge)
        around.emplace_back(&other,
                            in_axes(other.functional, other.axes[sides_[t][k].side], hinge.axes[side]));
      else if (side == 0)
        wanted -= side_functional(t, k, hinge.axes[0]);
    }
  }
  Mat3 gram = Mat3::Zero();
  for (const auto& [other, functional] : around) gram += functional * functional.transpose();
  const double least = blind * gram.trace();
  const Mat3 inverse = (gram + least * Mat3::Identity()).inverse();
  Functional term = inverse * wanted, sum = term;
  for (int step = 1; step < 3; ++step) {
    term = least * (inverse * term);
    sum += term;
  }
  for (const auto& [other, functional] : around) add_scaled(functional.dot(sum), other->bend, hinge.shift);
}

// With s = G S, where the rows of G are the functions of the inner edges, the least energy over all S that
// give s is D A / 2 s . (G Q^-1 G^T)^-1 s, where Q is the tensor of psi. If R R^T = G Q^-1 G^T / A^2, this is
// D / (2 A) |d|^2 with d = R^-1 s.
std::vector<PointSum> ShellAssembly::curvatures(std::size_t t, double nu) const {
  std::vector<PointSum> d;
  std::vector<Functional> g;  // G / A
  std::array<std::array<double, 3>, 3> root{};
  const Axes axes = axes_of(t);
  for (std::size_t k = 0; k < 3; ++k) {
    if (sides_[t][k].hinge < 0) continue;
    g.push_back(side_functional(t, k, axes) / area(t));
    PointSum sum = side_bend(sides_[t][k]);
    std::array<double, 3>& row = root[d.size()];
    for (std::size_t j = 0; j <= d.size(); ++j) {
      double rest = compliance(g.back(), g[j], nu);
      for (std::size_t q = 0; q < j; ++q) rest -= row[q] * root[j][q];
      row[j] = j == d.size() ? std::sqrt(rest) : rest / root[j][j];
      if (j < d.size()) add_scaled(-row[j], d[j], sum);
    }
    for (auto& [particle, weight] : sum) weight /= row[d.size()];
    d.push_back(std::move(sum));
  }
  return d;
}

PointSum ShellAssembly::side_bend(const HingeSide& side) const {
  const Hinge& hinge = hinges_[as_index(side.hinge)];
  const double fraction = side.side == 0 ? hinge.first_fraction : 1 - hinge.first_fraction;
  PointSum sum;
  add_scaled(fraction, hinge.bend, sum);
  add_scaled(side.side == 0 ? -1 : 1, hinge.shift, sum);
  return sum;
}

ShellBending ShellAssembly::springs_on(const std::vector<PointSum>& curvatures, double stiffness,
                                       double damping) const {
  PointSum all;
  for (const PointSum& d : curvatures) add_scaled(1, d, all);
  Spring<12> empty;
  empty.particle.fill(all.begin()->first);
  empty.weight.fill(0);
  std::size_t count = 0;
  for (const auto& [particle, weight] : all) empty.particle[count++] = particle;
  ShellBending springs;
  springs.fill(empty);
  for (std::size_t r = 0; r < curvatures.size(); ++r) {
    Vec3 sum = Vec3::Zero();
    double size = 0;  // m, of the terms of the sum
    for (std::size_t i = 0; i < count; ++i) {
      const auto found = curvatures[r].find(empty.particle[i]);
      if (found == curvatures[r].end()) continue;
      springs[r].weight[i] = found->second;
      const Vec3 term = found->second * (at(empty.particle[i]) - at(empty.particle[0]));
      sum += term;
      size = std::max(size, term.norm());
    }
    springs[r].rest_length = sum.norm() < flat_shell * size ? 0 : sum.norm();
    springs[r].stiffness = stiffness;
    springs[r].viscosity = damping * stiffness;
  }
  return springs;
}

}  // namespace

std::vector<ShellBending> shell_bending(const std::vector<Triangle>& triangles,
                                        const std::vector<SheetEdge>& edges, const std::vector<Vec3>& rest,
                                        double rigidity, double poisson_ratio, double damping) {
  const ShellAssembly assembly(triangles, edges, rest);
  std::vector<ShellBending> elements;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (assembly.bends(t)) elements.push_back(assembly.element(t, rigidity, poisson_ratio, damping));
  return elements;
}

}  // namespace duet
