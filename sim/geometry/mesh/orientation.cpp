#include "sim/geometry/mesh/orientation.h"

#include <array>
#include <cmath>
#include <limits>

namespace duet {
namespace {

// Unit roundoff: the largest relative error of a rounded operation.
constexpr double half_ulp = std::numeric_limits<double>::epsilon() / 2;

int sign(double value) { return (value > 0) - (value < 0); }

// A sum of doubles without rounding (Shewchuk 1997), as parts of growing magnitude that do not overlap.
class ExactSum {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const double sum = value + part_[i], share = sum - value;
      const double error = (value - (sum - share)) + (part_[i] - share);
      if (error != 0) part_[kept++] = error;
      value = sum;
    }
    if (value != 0) part_[kept++] = value;
    size_ = kept;
  }
  void add_product(double x, double y) {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }
  void add_product(double x, double y, double z) {
    const double product = x * y;
    add_product(std::fma(x, y, -product), z);
    add_product(product, z);
  }
  int sign() const { return size_ > 0 ? duet::sign(part_[size_ - 1]) : 0; }

 private:
  // The largest determinant here has 24 products of four parts each.
  std::array<double, 96> part_;
  std::size_t size_ = 0;
};

// Adds the determinant of the rows x, y, z, times `factor`, which is 1 or -1.
void add_determinant(double factor, const Vec3& x, const Vec3& y, const Vec3& z, ExactSum& sum) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add_product(factor * x[i], y[j], z[k]);
    sum.add_product(-factor * x[i], y[k], z[j]);
  }
}

}  // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  double determinant = 0, permanent = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double forward = v[j] * w[k], backward = v[k] * w[j];
    determinant += u[i] * (forward - backward);
    permanent += std::abs(u[i]) * (std::abs(forward) + std::abs(backward));
  }
  // The rounding error of the determinant is below 7 unit roundoffs of the permanent (Shewchuk 1997), so its
  // sign is right.
  if (std::abs(determinant) > 10 * half_ulp * permanent) return sign(determinant);
  ExactSum sum;
  add_determinant(1, b, c, d, sum);
  add_determinant(-1, a, c, d, sum);
  add_determinant(1, a, b, d, sum);
  add_determinant(-1, a, b, c, sum);
  return sum.sign();
}

int orientation(const Vec2& a, const Vec2& b, const Vec2& c) {
  const Vec2 u = b - a, v = c - a;
  const double forward = u.x() * v.y(), backward = u.y() * v.x();
  const double determinant = forward - backward;
  // The rounding error of the determinant is below 3 unit roundoffs of the sum of magnitudes (Shewchuk 1997),
  // so its sign is right.
  if (std::abs(determinant) > 4 * half_ulp * (std::abs(forward) + std::abs(backward)))
    return sign(determinant);
  ExactSum sum;
  sum.add_product(b.x(), c.y());
  sum.add_product(-b.y(), c.x());
  sum.add_product(-a.x(), c.y());
  sum.add_product(a.y(), c.x());
  sum.add_product(a.x(), b.y());
  sum.add_product(-a.y(), b.x());
  return sum.sign();
}

}  // namespace duet
