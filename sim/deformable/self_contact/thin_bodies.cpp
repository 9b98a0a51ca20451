#include "sim/deformable/self_contact/thin_bodies.h"

#include <cmath>

namespace duet {
namespace {

// Largest bend at rest that counts as none, rad.
constexpr double flat = 1e-6;

const Vec3& at(const std::vector<Vec3>& x, int i) { return x[static_cast<std::size_t>(i)]; }

// Returns the spring with the given weights and stiffness whose rest length is the length of the weighted sum
// of `rest`. `angle` is the length that a bend of one radian makes.
Spring<4> curvature_spring(const std::array<int, 4>& particle, const std::array<double, 4>& weight,
                           const std::vector<Vec3>& rest, double stiffness, double damping, double angle) {
  Vec3 curvature = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) curvature += weight[i] * at(rest, particle[i]);
  const double length = curvature.norm();
  return {particle, weight, length < flat * angle ? 0 : length, stiffness, damping * stiffness};
}

}  // namespace

Spring<2> edge_spring(int a, int b, const std::vector<Vec3>& rest, double modulus, double fraction,
                      const std::vector<double>& inverse_mass) {
  const double length = (at(rest, a) - at(rest, b)).norm(), stiffness = modulus / length;
  const std::array<double, 2> weight{1, -1};
  const std::array<double, 2> inverse{inverse_mass[static_cast<std::size_t>(a)],
                                      inverse_mass[static_cast<std::size_t>(b)]};
  return {{a, b}, weight, length, stiffness, critical_viscosity(fraction, stiffness, weight, inverse)};
}

Spring<2> rod_element(int a, int b, const std::vector<Vec3>& rest, double modulus, double damping) {
  const double length = (at(rest, a) - at(rest, b)).norm(), stiffness = modulus / length;
  return {{a, b}, {1, -1}, length, stiffness, damping * stiffness};
}

Spring<4> rod_bending(int before, int node, int after, const std::vector<Vec3>& rest, double rigidity,
                      double damping) {
  const double first = (at(rest, node) - at(rest, before)).norm();
  const double second = (at(rest, after) - at(rest, node)).norm();
  const std::array<double, 4> weight{1 / first, -1 / first - 1 / second, 1 / second, 0};
  return curvature_spring({before, node, after, node}, weight, rest, 2 * rigidity / (first + second), damping,
                          1);
}

}  // namespace duet
