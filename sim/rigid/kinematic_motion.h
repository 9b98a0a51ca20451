// Motion that a scene prescribes: pose and velocity of a rigid body as functions of time.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "sim/base/types.h"

namespace duet {

/// A curve through keys, of positions (m) or of orientations.
///
/// Between two keys it is a cubic in Bezier's cumulative form (Kim, Kim, Shin 1995), which positions and
/// quaternions share:
///
///     x(s) = x_i + a_1 B_1(s) + a_2 B_2(s) + a_3 B_3(s)
///     q(s) = exp(a_3 B_3(s)) exp(a_2 B_2(s)) exp(a_1 B_1(s)) q_i
///
/// for s from 0 to 1, where B_k is the sum of the cubic Bernstein polynomials from k on. Before the first key
/// and after the last one the value is constant, unless the track loops.
template <class Value>
struct Track {
  /// s, times of the keys, increasing.
  std::vector<double> time;
  /// Values at the keys, one per time.
  std::vector<Value> value;
  /// The increments a_1, a_2, a_3 of every interval, m, or rotation vectors in world axes, rad.
  std::vector<std::array<Vec3, 3>> increment;
  /// True if the track is periodic, at all times: the first key follows the last one.
  bool loop = false;
  /// s, increasing: times of the keys where the velocity jumps. A jump from the end of a loop to its
  /// beginning stands as the time of the first key.
  std::vector<double> jump = {};
};
/// A curve of positions, m.
using PositionTrack = Track<Vec3>;
/// A curve of orientations, body to world.
using OrientationTrack = Track<Quat>;

/// A key of a position track.
struct PositionKey {
  double time = 0;               ///< s
  Vec3 position = Vec3::Zero();  ///< m
  /// m/s, velocity at the key; without it, the interpolation chooses one.
  std::optional<Vec3> velocity = {};
};
/// A key of an orientation track: a rotation by `angle` about `axis`.
struct OrientationKey {
  double time = 0;            ///< s
  Vec3 axis = Vec3::UnitY();  ///< unit, world axes
  double angle = 0;           ///< rad, of any size
};

/// How a track moves between its keys.
enum class Interpolation {
  /// Velocity is continuous in time: zero at the first and the last key unless the track loops, and elsewhere
  /// such that no coordinate overshoots its keys (Fritsch, Butland 1984).
  smooth,
  /// Velocity is constant between keys.
  linear
};

/// What a track does after its last key.
enum class AfterLastKey {
  stay,   ///< it keeps the last value
  repeat  ///< it loops: it begins again at the first key
};

/// Makes the track through `keys`.
///
/// There is at least one key, and times increase. For a track that repeats, the last value must equal the
/// first, to 1e-8 m.
PositionTrack position_track(std::span<const PositionKey> keys, Interpolation interpolation,
                             AfterLastKey after);
/// Returns the position (m) of the track at `time` (s).
Vec3 position_at(const PositionTrack& track, double time);
/// Makes the track through `keys`, under the same conditions as position_track().
///
/// Between two keys with a common axis it turns by the difference of their angles, however many turns;
/// between others it turns by the shortest rotation.
OrientationTrack orientation_track(std::span<const OrientationKey> keys, Interpolation interpolation,
                                   AfterLastKey after);

/// Fills Track::jump from the other members of a track.
template <class Value>
void find_jumps(Track<Value>& track);

/// A rotation about an axis through the body's position.
///
/// The angular velocity is constant between two smooth ramps: one that begins at `start`, and one that ends
/// at `stop`.
struct Spin {
  Vec3 axis = Vec3::UnitY();                           ///< unit, world axes
  double rate = 0;                                     ///< rad/s, between the ramps
  double start = 0,                                    ///< s, time at which the rotation begins
      stop = std::numeric_limits<double>::infinity();  ///< s, time at which it ends; infinity: never
  double ramp = 0;                                     ///< s, length of a ramp, at most half of stop - start
};

/// A periodic displacement and rotation:
///
///     f(t) = sin(2 pi frequency (t - start) + phase) - sin(phase)
///
/// Between `start` and `stop` the displacement is f `amplitude` and the rotation vector f `turn`. Before,
/// both are zero; after, they keep their values at `stop`.
struct Sinusoid {
  Vec3 amplitude = Vec3::Zero();                       ///< m, world axes
  Vec3 turn = Vec3::Zero();                            ///< rad, world axes, about the body's position
  double frequency = 0;                                ///< Hz
  double phase = 0;                                    ///< rad
  double start = 0,                                    ///< s
      stop = std::numeric_limits<double>::infinity();  ///< s; infinity: never
};

/// The whole prescribed motion of a body.
///
/// The tracks place the coordinates of the body's shape in the world. The spins follow in their order, then
/// the sinusoids.
struct KinematicMotion {
  PositionTrack position;           ///< position of the shape's origin
  OrientationTrack orientation;     ///< orientation of the shape's axes
  std::vector<Spin> spins;          ///< rotations on top of the tracks
  std::vector<Sinusoid> sinusoids;  ///< oscillations on top of the spins
  /// Body space (center of mass, principal axes) in the coordinates of the shape.
  Pose frame;
};

/// Pose and velocity of a body at one time.
struct MotionState {
  Pose pose;                             ///< body space to world
  Vec3 velocity = Vec3::Zero();          ///< m/s, of the center of mass
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, world axes
};

/// Returns pose and velocity at `time` (s), both exact.
///
/// At a jump of the velocity it is the one after the jump.
MotionState motion_at(const KinematicMotion& motion, double time);

/// Returns the first time (s) after `time` at which the velocity jumps, or infinity if there is none.
double next_jump(const KinematicMotion& motion, double time);

/// Upper bounds of a motion over an interval of time.
struct MotionBounds {
  double speed = 0;  ///< m/s, of the center of mass
  double spin = 0;   ///< rad/s, of the angular velocity
  double phase = 0;  ///< rad/s, largest angular frequency of the sinusoids
};
/// Returns upper bounds over the times from `begin` to `end` (s).
MotionBounds motion_bounds(const KinematicMotion& motion, double begin, double end);

}  // namespace duet
