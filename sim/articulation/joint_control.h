// Proportional-derivative control in closed form (Weinstein, Guendelman, Fedkiw 2008).
#pragma once

#include "sim/articulation/joint_rows.h"

namespace duet {

/// The error of a controlled motion and the rate at which it changes.
struct ControlError {
  double value = 0,  ///< rad or m, target less the joint's value
      rate = 0;      ///< rad/s or m/s, time derivative of `value`
};
/// Returns the solution of e'' + damping e' + gain e = 0 after `dt` (s), for the error `start` now.
///
/// The solution is exact for weak, critical and strong damping, so that control is stable for every `gain`
/// (1/s^2), `damping` (1/s) and step. Near critical damping it uses the limit of the formula.
ControlError controlled_error(ControlError start, double gain, double damping, double dt);

/// Returns the angle (rad) that differs from `angle` by whole turns and is nearest to `to`.
double nearest_angle(double angle, double to);

/// The rates of a controlled joint that follow the solution of its control equation in a step.
///
/// Both are relative rotation vectors in the axes of the parent's frame, rad/s. For a prismatic joint the x
/// component is the rate of the travel, m/s.
struct ControlRates {
  Vec3 mean = Vec3::Zero(),  ///< mean rate over the step
      end = Vec3::Zero();    ///< rate at the end of the step
};
/// Returns the rates that take a controlled joint through the step from `time` (s) to `time + dt`.
///
/// `frames` are the joint's frames at `time`, and `rate` is the child's rate relative to the parent then, in
/// the units and axes of ControlRates. The target is clamped to the joint's limits of angle or travel;
/// without gain, the rates stop at these limits instead. Along the error the rates follow controlled_error();
/// across it the rate relative to the target's decays as exp(-damping t). A universal joint of which one
/// angle is free controls the other angle alone, towards that component of the target.
///
/// `angle` (rad) is the angle of a joint with one free rotation at an earlier time, less than half a turn
/// before: the joint has the angle that is nearest to it, so that its control knows whole turns. It is set to
/// that angle; other joints leave it as it is.
ControlRates control_rates(const Joint& joint, const JointFrames& frames, const Vec3& rate, double time,
                           double dt, double& angle);

}  // namespace duet
