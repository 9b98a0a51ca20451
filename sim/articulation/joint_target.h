// The target of a controlled joint as a function of time.
#pragma once

#include <optional>
#include <vector>

#include "sim/rigid/kinematic_motion.h"

namespace duet {

/// The bend of one joint of a spine that follows a traveling wave:
///
///     p(s) = (bend sin f, height cos f, s),   f = 2 pi (s / wavelength + t / period).
///
/// The joint is at s = `place`. In its frame the x axis runs along the spine and y points up.
struct BodyWave {
  double place = 0,    ///< m, arc length of the joint along the spine
      spacing = 1,     ///< m, distance to the neighboring joints
      wavelength = 1;  ///< m
  double period = 1;   ///< s
  double bend = 0,     ///< m, amplitude of the lateral wave
      height = 0;      ///< m, amplitude of the vertical wave
  /// Returns the rotation vector (rad) of the joint at `time` (s).
  ///
  /// It leads from the piece of spine before the joint to the piece after it, which are chords of the curve.
  Vec3 rotation(double time) const;
};

/// The rotation or travel that a controlled joint is to have: a sum of terms that are all optional.
///
/// The value is a rotation vector in the joint's frame (rad), from the parent's frame to the child's; of a
/// prismatic joint its x component is the travel (m).
struct JointTarget {
  /// A term amplitude sin(2 pi t / period + phase).
  struct Sinusoid {
    /// rad, or m along x.
    Vec3 amplitude = Vec3::Zero();
    double period = 1;  ///< s
    double phase = 0;   ///< rad
  };
  /// s, the time from which the other terms count; before it, the value grows linearly from zero at time 0.
  double start = 0;
  /// Constant term, rad, or m along x.
  Vec3 constant = Vec3::Zero();
  /// Term that grows from `start` on, rad/s, or m/s along x.
  Vec3 rate = Vec3::Zero();
  std::vector<Sinusoid> sinusoids;  ///< periodic terms
  PositionTrack keys;               ///< keyed term, rad, or m along x; may be empty
  std::optional<BodyWave> wave;     ///< wave of a spine

  /// Returns the sum of all terms at `time` (s).
  Vec3 value(double time) const;
};

}  // namespace duet
