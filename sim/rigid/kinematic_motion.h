// Motion that a scene prescribes: pose and velocity of a rigid body as functions of time.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "sim/base/types.h"

namespace duet {

// A curve through keys, of positions (m) or of orientations. Between two keys it is a cubic in Bezier's
// cumulative form (Kim, Kim, Shin 1995), which positions and quaternions share:
//   x(s) = x_i + a_1 B_1(s) + a_2 B_2(s) + a_3 B_3(s)
//   q(s) = exp(a_3 B_3(s)) exp(a_2 B_2(s)) exp(a_1 B_1(s)) q_i
// Before the first key and from the last one on it rests, unless it loops.
template <class Value>
struct Track {
  std::vector<double> time;                    // s, of the keys, increasing
  std::vector<Value> value;                    // at the keys
  std::vector<std::array<Vec3, 3>> increment;  // a_1, a_2, a_3 of every interval: m; rad
  bool loop = false;  // goes on from the first key after the last one and has done so before the first
};
using PositionTrack = Track<Vec3>;
using OrientationTrack = Track<Quat>;

struct PositionKey {
  double time = 0;                    // s
  Vec3 position = Vec3::Zero();       // m
  std::optional<Vec3> velocity = {};  // m/s, where smooth interpolation shall not choose it
};
struct OrientationKey {
  double time = 0;            // s
  Vec3 axis = Vec3::UnitY();  // unit, world axes
  double angle = 0;           // rad
};

// Smooth: one velocity at every key, continuous in time; zero at the first and the last key unless the track
// loops, and elsewhere such that no coordinate overshoots its keys (Fritsch, Butland 1984). Linear: constant
// velocity between keys.
enum class Interpolation { smooth, linear };

// At least one key, times increasing; of a looping track the last value must equal the first.
PositionTrack position_track(std::span<const PositionKey> keys, Interpolation interpolation, bool loop);
Vec3 position_at(const PositionTrack& track, double time);
// Two keys with one axis turn by the difference of their angles, however many turns; others by the shortest
// way.
OrientationTrack orientation_track(std::span<const OrientationKey> keys, Interpolation interpolation,
                                   bool loop);

// Rotation about an axis through the body's position, with constant angular velocity between two smooth
// ramps: one that begins at `start`, and one that ends at `stop`.
struct Spin {
  Vec3 axis = Vec3::UnitY();                                         // unit, world axes
  double rate = 0;                                                   // rad/s
  double start = 0, stop = std::numeric_limits<double>::infinity();  // s
  double ramp = 0;                                                   // s, at most half of stop - start
};

// Between `start` and `stop` the displacement is f `amplitude` and the rotation f `turn`, with
// f(t) = sin(2 pi frequency (t - start) + phase) - sin(phase); outside, the body rests.
struct Sinusoid {
  Vec3 amplitude = Vec3::Zero();  // m, world axes
  Vec3 turn = Vec3::Zero();       // rad, rotation vector in world axes, about the body's position
  double frequency = 0;           // Hz
  double phase = 0;               // rad
  double start = 0, stop = std::numeric_limits<double>::infinity();  // s
};

// The tracks place the shape's own coordinates in the world; on top come the spins in turn, then the
// sinusoids.
struct KinematicMotion {
  PositionTrack position;
  OrientationTrack orientation;
  std::vector<Spin> spins;
  std::vector<Sinusoid> sinusoids;
  Pose frame;  // body space (centre of mass, principal axes) in the shape's own coordinates
};

struct MotionState {
  Pose pose;                             // of body space
  Vec3 velocity = Vec3::Zero();          // m/s, of the centre of mass
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world axes
};

// Pose and velocity at `time` (s), both exact. Where the velocity jumps it is the one from then on.
MotionState motion_at(const KinematicMotion& motion, double time);

// Upper bounds over the times from `begin` to `end` (s).
struct MotionBounds {
  double speed = 0;  // m/s, of the centre of mass
  double spin = 0;   // rad/s
  double phase = 0;  // rad/s, of the fastest sinusoid
};
MotionBounds motion_bounds(const KinematicMotion& motion, double begin, double end);

}  // namespace duet
