// The motion of a rigid body without torque in closed form (Landau and Lifshitz, Mechanics, section 37).
// Jacobi's elliptic functions give its angular momentum in body axes; a quadrature of these gives its
// precession about the constant angular momentum.
#pragma once

#include <algorithm>
#include <cmath>

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>

#include "sim/base/types.h"

namespace duet::study {

// A body whose principal axes are those of the world at time 0, spinning about its second and third axis.
class FreeTop {
 public:
  // `inertia`: principal moments, ascending (kg m^2). `middle`, `last`: angular velocity about the second and
  // third axis (rad/s), both positive.
  FreeTop(const Vec3& inertia, double middle, double last) : inertia_(inertia) {
    const double I1 = inertia[0], I2 = inertia[1], I3 = inertia[2];
    momentum_ = Vec3(0, I2 * middle, I3 * last);
    const double squared = momentum_.squaredNorm();                 // M^2
    const double energy = I2 * middle * middle + I3 * last * last;  // 2 E; M^2 > 2 E I2
    const double wide = energy * I3 - squared, narrow = squared - energy * I1;
    amplitude_ = Vec3(std::sqrt(I1 * wide / (I3 - I1)), std::sqrt(I2 * wide / (I3 - I2)),
                      std::sqrt(I3 * narrow / (I3 - I1)));  // kg m^2/s
    rate_ = std::sqrt((I3 - I2) * narrow / (I1 * I2 * I3));
    modulus_ = std::sqrt((I2 - I1) * wide / ((I3 - I2) * narrow));
    start_ = boost::math::ellint_1(modulus_);  // argument at which cn = 0 and sn = 1
  }

  // Returns the orientation at time `t` (s): it takes body axes to world axes, which are the body axes at
  // time 0.
  Quat orientation(double t) const {
    const double angle = precession(t);
    const Mat3 start = frame(momentum_);
    Mat3 turned = start;
    turned.col(1) = std::cos(angle) * start.col(1) + std::sin(angle) * start.col(2);
    turned.col(2) = std::cos(angle) * start.col(2) - std::sin(angle) * start.col(1);
    return Quat(Mat3(turned * frame(body_momentum(t)).transpose()));
  }

 private:
  // The angular momentum in body axes (kg m^2/s): amplitudes times (cn, sn, dn).
  Vec3 body_momentum(double t) const {
    double cn = 0, dn = 0;
    const double sn = boost::math::jacobi_elliptic(modulus_, start_ + rate_ * t, &cn, &dn);
    return amplitude_.cwiseProduct(Vec3(cn, sn, dn));
  }

  // The angle (rad) by which the third axis has turned about the angular momentum until `t` (s).
  double precession(double t) const {
    const auto speed = [&](double s) {
      const Vec3 m = body_momentum(s);
      const double x = m.x() * m.x(), y = m.y() * m.y();
      return momentum_.norm() * (x / inertia_[0] + y / inertia_[1]) / (x + y);
    };
    // One radian of the argument of the elliptic functions to a piece, with twenty Gauss points each, is far
    // more than the accuracy of doubles needs.
    const int pieces = std::max(100, static_cast<int>(std::ceil(rate_ * t)));
    double angle = 0;
    for (int i = 0; i < pieces; ++i)
      angle +=
          boost::math::quadrature::gauss<double, 20>::integrate(speed, t * i / pieces, t * (i + 1) / pieces);
    return angle;
  }

  // Returns right-handed axes: the direction of `momentum`, the component of the third axis across it
  // (normalized), and their cross product.
  static Mat3 frame(const Vec3& momentum) {
    const Vec3 first = momentum.normalized();
    const Vec3 second = (Vec3::UnitZ() - first.z() * first).normalized();
    Mat3 axes;
    axes << first, second, first.cross(second);
    return axes;
  }

  Vec3 inertia_, momentum_, amplitude_;
  double rate_ = 0, modulus_ = 0, start_ = 0;
};

}  // namespace duet::study
