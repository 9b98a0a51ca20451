// What a controlled joint is to do, as a function of time.
#pragma once

#include <optional>
#include <vector>

#include "sim/rigid/kinematic_motion.h"

namespace duet {

// The travelling wave of a snake: the joint bends as the curve p(s) = (bend sin f, height cos f, s), with f =
// 2 pi (s / wavelength + t / period), bends at `place`. Of the joint frame x runs along the spine, y is up.
struct BodyWave {
  double place = 0, spacing = 1, wavelength = 1;  // m, of the joint and of its neighbours along the spine
  double period = 1;                              // s
  double bend = 0, height = 0;                    // m
  Vec3 rotation(double time) const;               // rad
};

// A rotation vector in the joint's frame (rad), from the parent's frame to the child's; of a prismatic joint
// the travel along x (m). It begins at `start`: before, it grows from nothing to what it is then, linearly.
struct JointTarget {
  struct Sinusoid {  // amplitude sin(2 pi t / period + phase)
    Vec3 amplitude = Vec3::Zero();
    double period = 1;  // s
    double phase = 0;   // rad
  };
  double start = 0;  // s, from where on times below count
  Vec3 constant = Vec3::Zero();
  std::vector<Sinusoid> sinusoids;
  PositionTrack keys;  // may be empty
  std::optional<BodyWave> wave;

  Vec3 value(double time) const;  // the sum of all
};

}  // namespace duet
