#include "sim/articulation/joint_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/elementary.h"
#include "sim/base/rotation.h"

namespace duet {
namespace {

// Returns the rates that reduce the error vector `way` (rad or m) as the control equation says. `next_way` is
// the vector from where the joint is now to the target at the end of the step, `target_rate` the mean rate of
// the target, and `rate` that of the joint now. Along `way` the error follows controlled_error(); across it
// the rate relative to the target's decays as exp(-damping t).
ControlRates rates_along(const Vec3& way, const Vec3& next_way, const Vec3& target_rate, const Vec3& rate,
                         const JointControl& control, double dt) {
  const double error = way.norm();
  const Vec3 axis = error > 0 ? Vec3(way / error) : Vec3::UnitX();
  const ControlError after =
      controlled_error({error, (target_rate - rate).dot(axis)}, control.gain, control.damping, dt);
  const double next = next_way.dot(axis);
  const Vec3 target_across = target_rate - target_rate.dot(axis) * axis,
             across = rate - rate.dot(axis) * axis - target_across;
  const double fading = math::exp(-control.damping * dt);
  // Below this c dt, 1 - c dt / 2 is 1 to 5e-9, and the quotient would lose more digits than that.
  constexpr double weak = 1e-8;
  const double mean_fading = control.damping * dt > weak ? (1 - fading) / (control.damping * dt) : 1;
  return {(next - after.value) / dt * axis + target_across + mean_fading * across,
          (target_rate.dot(axis) - after.rate) * axis + target_across + fading * across};
}

// Clamps the target to the joint's limits, so that control does not push against them. A control without gain
// follows the speed of the target, which then counts wherever the target is.
Vec3 within_limits(const Joint& joint, Vec3 target) {
  if (joint.control.gain == 0) return target;
  if (joint.kind == JointKind::prismatic)
    target.x() = std::clamp(target.x(), joint.travel.least, joint.travel.most);
  else if (twists(joint.kind))
    target.x() = std::clamp(target.x(), joint.angle.least, joint.angle.most);
  return target;
}

// Lets a control without gain stop at the bounds of the value `now` (rad or m, along x).
ControlRates stopped_at(const Bounds& bounds, double now, ControlRates rates, const JointControl& control,
                        double dt) {
  if (control.gain != 0) return rates;
  const auto allowed = [&](double value, double rate) {
    return std::clamp(rate, std::min((bounds.least - value) / dt, 0.0),
                      std::max((bounds.most - value) / dt, 0.0));
  };
  rates.mean.x() = allowed(now, rates.mean.x());
  rates.end.x() = allowed(now + dt * rates.mean.x(), rates.end.x());
  return rates;
}

// Returns the rates of a universal joint of whose two angles only one is controlled: that about the x axis of
// the parent (`axis` 0), or that about the y axis of the child (1). The angle has its target's component as
// target, whatever the free angle is. The two axes are at right angles, so that the rate of an angle is the
// rate along its axis.
ControlRates rates_of_one_angle(const Joint& joint, const Quat& now, const Vec3& target, const Vec3& next,
                                const Vec3& rate, int axis, double dt) {
  // The relative rotation is R = R_x(a) R_y(b). Its columns are the child's axes.
  const Mat3 child = now.toRotationMatrix();
  const double angle =
      axis == 0 ? math::atan2(child(2, 1), child(1, 1)) : math::atan2(child(0, 2), child(0, 0));
  const Vec3 along = axis == 0 ? Vec3(Vec3::UnitX()) : Vec3(child.col(1));
  const double from = std::remainder(target[axis] - angle, 2 * std::numbers::pi),
               turn = next[axis] - target[axis];
  ControlRates rates = rates_along(from * along, (from + turn) * along, turn / dt * along,
                                   rate.dot(along) * along, joint.control, dt);
  // At the end of the step the free rotation has turned the child's y.
  if (axis == 1) rates.end = exponential(Vec3(dt * rate.x(), 0, 0)) * rates.end;
  return rates;
}

// Drops the components of those axes of a point joint that are not controlled.
Vec3 on_axes(const Joint& joint, Vec3 v) {
  for (Eigen::Index i = 0; i < 3; ++i)
    if (joint.kind == JointKind::point && !joint.control.axis[static_cast<std::size_t>(i)]) v[i] = 0;
  return v;
}

}  // namespace

double nearest_angle(double angle, double to) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::nearbyint((to - angle) / turn);
}

ControlError controlled_error(ControlError start, double gain, double damping, double dt) {
  const double half = damping / 2, square = half * half - gain, decay = math::exp(-half * dt);
  // even = exp(-half dt) cosh(a dt) and odd = exp(-half dt) sinh(a dt) / a with a^2 = square; near critical
  // damping, where a vanishes, their limits. Below this (a dt)^2 the limits are exact to its half, and the
  // difference of exponentials would lose more digits than that.
  constexpr double near_critical = 1e-10;
  double even = decay, odd = dt * decay;
  if (square * dt * dt > near_critical) {
    const double a = std::sqrt(square);
    const double slow = math::exp((a - half) * dt), fast = math::exp((-a - half) * dt);
    even = (slow + fast) / 2;
    odd = (slow - fast) / (2 * a);
  } else if (square * dt * dt < -near_critical) {
    const double a = std::sqrt(-square);
    even = decay * math::cos(a * dt);
    odd = decay * math::sin(a * dt) / a;
  }
  return {start.value * even + (start.rate + half * start.value) * odd,
          start.rate * even - (gain * start.value + half * start.rate) * odd};
}

ControlRates control_rates(const Joint& joint, const JointFrames& frames, const Vec3& rate, double time,
                           double dt, double& angle) {
  const JointControl& control = joint.control;
  const Vec3 target = within_limits(joint, control.target.value(time));
  const Vec3 next = control.leads ? within_limits(joint, control.target.value(time + dt)) : target;
  if (joint.kind == JointKind::prismatic) {
    const double now = travel_of(frames);
    return stopped_at(joint.travel, now,
                      rates_along((target.x() - now) * Vec3::UnitX(), (next.x() - now) * Vec3::UnitX(),
                                  (next - target) / dt, rate, control, dt),
                      control, dt);
  }
  if (twists(joint.kind)) {
    angle = nearest_angle(angle_of(frames), angle);
    return stopped_at(
        joint.angle, angle,
        rates_along((target.x() - angle) * Vec3::UnitX(), (next.x() - angle) * Vec3::UnitX(),
                    (next.x() - target.x()) / dt * Vec3::UnitX(), rate.x() * Vec3::UnitX(), control, dt),
        control, dt);
  }
  const Quat now = frames.relative();
  if (joint.kind == JointKind::universal && control.axis[0] != control.axis[1])
    return rates_of_one_angle(joint, now, target, next, rate, control.axis[0] ? 0 : 1, dt);
  const Quat to = exponential(target), then = exponential(next);
  const auto from_now = [&](const Quat& q) { return on_axes(joint, logarithm(q * now.conjugate())); };
  const Vec3 turn = on_axes(joint, logarithm(then * to.conjugate()));  // rotation of the target in this step
  return rates_along(from_now(to), from_now(then), turn / dt, on_axes(joint, rate), control, dt);
}

}  // namespace duet
