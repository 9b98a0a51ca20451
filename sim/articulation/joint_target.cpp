#include "sim/articulation/joint_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/rotation.h"

namespace duet {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

// Returns the axes of a straight piece of the spine in the columns: along it, upward, and their cross
// product.
Mat3 spine_axes(const Vec3& from, const Vec3& to) {
  Mat3 axes;
  axes.col(0) = (to - from).normalized();
  axes.col(1) = (Vec3::UnitY() - axes(1, 0) * axes.col(0)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

Vec3 BodyWave::rotation(double time) const {
  DUET_ASSERT(spacing > 0 && wavelength > 0 && period > 0);
  const auto at = [&](double s) {
    const double f = two_pi * (s / wavelength + time / period);
    return Vec3(bend * math::sin(f), height * math::cos(f), s);
  };
  const Vec3 before = at(place - spacing), here = at(place), after = at(place + spacing);
  return logarithm(Quat(Mat3(spine_axes(before, here).transpose() * spine_axes(here, after))));
}

Vec3 JointTarget::value(double time) const {
  const double since = std::max(0.0, time - start);
  const double grown = time < start ? std::max(0.0, time / start) : 1;
  Vec3 value = constant + since * rate;
  for (const Sinusoid& s : sinusoids) value += math::sin(two_pi * since / s.period + s.phase) * s.amplitude;
  if (!keys.time.empty()) value += position_at(keys, since);
  if (wave) value += wave->rotation(since);
  return grown * value;
}

}  // namespace duet
