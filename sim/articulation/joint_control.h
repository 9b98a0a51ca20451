// Proportional-derivative control in closed form (Weinstein, Guendelman, Fedkiw 2008).
#pragma once

#include "sim/articulation/joint_rows.h"

namespace duet {

struct ControlError {
  double value = 0, rate = 0;
};
// The solution of e'' + damping e' + gain e = 0 after `dt`, whatever the damping: exact, so stable for every
// gain and step.
ControlError controlled_error(ControlError start, double gain, double damping, double dt);

// The rates that a controlled joint is to have: the mean one over the step from `time` to time + dt, and the
// one at its end. Rotation vectors in the parent's frame, rad/s; of a travel along x, m/s.
struct ControlRates {
  Vec3 mean = Vec3::Zero(), end = Vec3::Zero();
};
// `rate` is the child's relative to the parent's now, the same.
ControlRates control_rates(const Joint& joint, const JointFrames& frames, const Vec3& rate, double time,
                           double dt);

}  // namespace duet
