#include "tools/study/closed_forms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>

namespace duet::study {

using std::numbers::pi;

double slide_distance(double slope, double friction, double gravity, double speed, double t) {
  const double angle = slope * pi / 180;
  const double pull = gravity * std::sin(angle), brake = friction * gravity * std::cos(angle);
  if (speed == 0 && pull <= brake) return 0;
  const double acceleration = pull - brake;
  const double moving = acceleration < 0 ? std::min(t, -speed / acceleration) : t;
  return speed * moving + acceleration * moving * moving / 2;
}

// sin(angle / 2) = k cd(rate t) with k = sin(amplitude / 2).
double pendulum_angle(double amplitude, double rate, double t) {
  const double k = std::sin(amplitude / 2);
  double cn = 0, dn = 0;
  boost::math::jacobi_elliptic(k, rate * t, &cn, &dn);
  return 2 * std::asin(k * cn / dn);
}

// The deflection under the line load q is q (x^4 - 4 L x^3 + 6 L^2 x^2) / (24 E I) by bending and q (L x -
// x^2 / 2) / (k G A) by shear; the result is its mean over the length.
double mean_sag_of_cantilever(double load, double length, double height, double modulus) {
  const double strain = load * length / modulus, slender = length / height;
  const double bending = 12 * slender * slender / 20, shear = 2.0 / 3 / (5.0 / 6);
  return strain * length * (bending + shear);
}

// u(x, t) = u_static(x) - sum of 2 g / (c^2 L k^3) sin(k x) cos(k c t) over k = (n + 1/2) pi / L; the result
// is its mean over the length. A thousand modes leave an error of 1e-12.
double mean_stretch_of_bar(double length, double speed, double gravity, double t) {
  double sum = 0;
  for (int n = 999; n >= 0; --n) {
    const double k = (n + 0.5) * pi / length;
    sum += (1 - std::cos(k * speed * t)) / (k * k * k * k);
  }
  return 2 * gravity / (speed * speed * length * length) * sum;
}

}  // namespace duet::study
