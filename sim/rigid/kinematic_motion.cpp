#include "sim/rigid/kinematic_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/rotation.h"

namespace duet {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr double never = std::numeric_limits<double>::infinity();

using Increments = std::array<Vec3, 3>;

// The cumulative Bezier basis at s from 0 to 1: B_k is the sum of the cubic Bernstein polynomials from k on,
// and dB_k/ds is three times a quadratic Bernstein polynomial.
struct Basis {
  std::array<double, 3> value,  // B_1, B_2, B_3
      slope;                    // dB_k/ds
  explicit Basis(double s)
      : value{s * (3 - s * (3 - s)), s * s * (3 - 2 * s), s * s * s},
        slope{3 * (1 - s) * (1 - s), 6 * s * (1 - s), 3 * s * s} {}
};

// The place of a time in a track: in the interval after `key`, or at rest at `key`.
struct Place {
  std::size_t key = 0;
  double s = 0;       // 0 to 1 over the interval
  double length = 0;  // s, length of the interval; 0: at rest
};

// Returns the place of the time `t` (s) among the times of the keys, of which there is at least one.
Place locate(const std::vector<double>& time, bool loop, double t) {
  if (time.size() < 2) return {};
  const double first = time.front(), last = time.back();
  if (loop) {
    t = first + std::fmod(t - first, last - first);
    if (t < first) t += last - first;
  } else if (t < first) {
    return {};
  } else if (t >= last) {
    return {time.size() - 1, 0, 0};
  }
  const auto next = std::upper_bound(time.begin() + 1, time.end() - 1, t);
  const double length = *next - *(next - 1);
  return {static_cast<std::size_t>(next - time.begin()) - 1, (t - *(next - 1)) / length, length};
}

// Rotates the body about its position by the rotation vector `turn` (rad). The vector grows by `rate` (rad/s)
// along its own axis, so that `rate` is the angular velocity that it adds.
void rotate(MotionState& state, const Vec3& turn, const Vec3& rate) {
  const Quat rotation = exponential(turn);
  state.pose.orientation = rotation * state.pose.orientation;
  state.angular_velocity = rate + rotation * state.angular_velocity;
}

// Sets the position to that of the track, and adds its velocity.
void follow(const PositionTrack& track, double time, MotionState& state) {
  const Place place = locate(track.time, track.loop, time);
  state.pose.position = track.value[place.key];
  if (place.length == 0) return;
  const Basis basis(place.s);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = track.increment[place.key][k];
    state.pose.position += basis.value[k] * a;
    state.velocity += basis.slope[k] / place.length * a;
  }
}

// Sets the orientation to that of the track, and adds its angular velocity.
void follow(const OrientationTrack& track, double time, MotionState& state) {
  const Place place = locate(track.time, track.loop, time);
  state.pose.orientation = track.value[place.key];
  if (place.length == 0) return;
  const Basis basis(place.s);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = track.increment[place.key][k];
    rotate(state, basis.value[k] * a, basis.slope[k] / place.length * a);
  }
}

// Returns 3 u^2 - 2 u^3 with u = after / ramp: the fraction of the full rate that a ramp of `ramp` (s) has
// reached at the time `after` (s) from its beginning.
double ramp_rate(double ramp, double after) {
  if (after < 0) return 0;
  if (after >= ramp) return 1;
  const double u = after / ramp;
  return u * u * (3 - 2 * u);
}

// Returns the integral of ramp_rate() from the beginning of the ramp on, s.
double ramp_integral(double ramp, double after) {
  if (after <= 0) return 0;
  if (after >= ramp) return after - ramp / 2;
  const double u = after / ramp;
  return ramp * u * u * u * (1 - u / 2);
}

// Adds the rotation of a spin.
void follow(const Spin& spin, double time, MotionState& state) {
  const double up = time - spin.start, down = time - (spin.stop - spin.ramp);
  const double angle = spin.rate * (ramp_integral(spin.ramp, up) - ramp_integral(spin.ramp, down));
  const double rate = spin.rate * (ramp_rate(spin.ramp, up) - ramp_rate(spin.ramp, down));
  rotate(state, angle * spin.axis, rate * spin.axis);
}

// Adds the displacement and rotation of a sinusoid.
void follow(const Sinusoid& sinusoid, double time, MotionState& state) {
  const double omega = two_pi * sinusoid.frequency;
  const double angle =
      omega * (std::clamp(time, sinusoid.start, sinusoid.stop) - sinusoid.start) + sinusoid.phase;
  const double f = math::sin(angle) - math::sin(sinusoid.phase);
  const bool moves = time >= sinusoid.start && time < sinusoid.stop;
  const double rate = moves ? omega * math::cos(angle) : 0;
  state.pose.position += f * sinusoid.amplitude;
  state.velocity += rate * sinusoid.amplitude;
  rotate(state, f * sinusoid.turn, rate * sinusoid.turn);
}

// Returns the rate at a key between two intervals with mean rates `left` and `right`, and lengths in s. Each
// coordinate is a harmonic mean, weighted by the lengths, so that a monotone coordinate stays monotone; it is
// zero at an extremum and beside an interval without motion (Fritsch, Butland 1984).
Vec3 key_rate(const Vec3& left, double left_length, const Vec3& right, double right_length) {
  const double left_weight = 2 * right_length + left_length, right_weight = right_length + 2 * left_length;
  Vec3 rate;
  for (int i = 0; i < 3; ++i)
    rate[i] = left[i] * right[i] > 0
                  ? (left_weight + right_weight) / (left_weight / left[i] + right_weight / right[i])
                  : 0;
  return rate;
}

// The rates (m/s or rad/s) at the beginning and the end of an interval.
struct EndRates {
  Vec3 begin, end;
};
// Returns the rates at the ends of every interval. `time` (s) are the times of the keys, and `change` (m or
// rad) is the change of the value over each interval.
std::vector<EndRates> end_rates(const std::vector<double>& time, const std::vector<Vec3>& change,
                                Interpolation interpolation, bool loop) {
  const std::size_t count = change.size();
  std::vector<EndRates> rates(count);
  const auto length = [&](std::size_t i) { return time[i + 1] - time[i]; };
  const auto mean = [&](std::size_t i) { return Vec3(change[i] / length(i)); };
  for (std::size_t i = 0; i < count; ++i) {
    if (interpolation == Interpolation::linear) {
      rates[i] = {mean(i), mean(i)};
    } else {
      const std::size_t next = i + 1 < count ? i + 1 : 0;
      const bool rests = next == 0 && !loop;
      rates[i].end = rests ? Vec3(Vec3::Zero()) : key_rate(mean(i), length(i), mean(next), length(next));
      rates[next].begin = rates[i].end;
    }
  }
  return rates;
}

// Returns the rotation vector (rad, world axes) from one key to the next.
Vec3 rotation_between(const OrientationKey& from, const OrientationKey& to) {
  const Vec3& axis = to.angle == 0 ? from.axis : to.axis;  // a key without a rotation may have any axis
  const double along = from.angle == 0 ? 1 : from.axis.dot(axis);
  // Axes that differ by less than 1.4e-6 rad are one axis but for the rounding of decimal numbers.
  if (std::abs(along) > 1 - 1e-12) return (to.angle - std::copysign(from.angle, from.angle * along)) * axis;
  return logarithm(exponential(to.angle * to.axis) * exponential(from.angle * from.axis).conjugate());
}

// Returns the rotation vector (rad) of a unit quaternion that is nearest to `guess` among all that differ by
// whole turns.
Vec3 logarithm_near(const Quat& q, const Vec3& guess) {
  const Vec3 shortest = logarithm(q);
  const double angle = shortest.norm();
  // Below 1e-9 rad the direction of the rotation vector is rounding.
  const Vec3 axis = angle > 1e-9 ? Vec3(shortest / angle) : Vec3(guess.normalized());
  return shortest + two_pi * std::round((guess.dot(axis) - angle) / two_pi) * axis;
}

// Returns an upper bound of the rate (m/s or rad/s) of a track from `begin` to `end` (s). The slopes of B_1,
// B_2 and B_3 are never negative and add up to 3, so that no rate exceeds 3 times the longest
// increment over the length of the interval.
template <class Value>
double rate_bound(const Track<Value>& track, double begin, double end) {
  double bound = 0;
  for (std::size_t i = 0; i < track.increment.size(); ++i) {
    if (!track.loop && (track.time[i + 1] < begin || track.time[i] > end)) continue;
    for (const Vec3& a : track.increment[i])
      bound = std::max(bound, 3 * a.norm() / (track.time[i + 1] - track.time[i]));
  }
  return bound;
}

// Returns the first time (s) after `time` at which the velocity of a track jumps.
template <class Value>
double next_jump(const Track<Value>& track, double time) {
  if (track.jump.empty()) return never;
  const double first = track.time.front(), period = track.time.back() - first;
  const double begin = track.loop ? period * std::floor((time - first) / period) : 0;  // of the lap
  const auto next = std::upper_bound(track.jump.begin(), track.jump.end(), time - begin);
  if (next != track.jump.end()) return begin + *next;
  return track.loop ? begin + period + track.jump.front() : never;
}

// Least jump of a velocity, over the velocities on both sides of it: rounding leaves less.
constexpr double least_jump = 1e-6;

// Largest difference between the first and the last key of a loop, m or rad: ten times what rounded decimal
// numbers in scenes leave. A jump of this size is not seen.
[[maybe_unused]] constexpr double same_place = 1e-8;

// Returns whether there is a key and their times increase.
[[maybe_unused]] bool is_increasing(const auto& keys) {
  for (std::size_t i = 0; i + 1 < keys.size(); ++i)
    if (!(keys[i].time < keys[i + 1].time)) return false;
  return !keys.empty();
}

}  // namespace

// The rates at the beginning and the end of an interval are 3 a_1 and 3 a_3 over its length.
template <class Value>
void find_jumps(Track<Value>& track) {
  track.jump.clear();
  const std::size_t count = track.increment.size();
  const auto rate = [&](std::size_t interval, std::size_t k) {
    return Vec3(track.increment[interval][k] / (track.time[interval + 1] - track.time[interval]));
  };
  for (std::size_t i = 0; count > 0 && i <= count; ++i) {
    if (track.loop && i == count) break;  // the first key
    const bool follows = i > 0 || track.loop, precedes = i < count;
    const Vec3 before = follows ? rate(i > 0 ? i - 1 : count - 1, 2) : Vec3(Vec3::Zero()),
               after = precedes ? rate(i, 0) : Vec3(Vec3::Zero());
    if ((after - before).norm() > least_jump * (after.norm() + before.norm()))
      track.jump.push_back(track.time[i]);
  }
}
template void find_jumps(PositionTrack& track);
template void find_jumps(OrientationTrack& track);

PositionTrack position_track(std::span<const PositionKey> keys, Interpolation interpolation,
                             AfterLastKey after) {
  const bool loop = after == AfterLastKey::repeat;
  DUET_ASSERT(is_increasing(keys));
  DUET_ASSERT(!loop || (keys.front().position - keys.back().position).norm() < same_place);
  PositionTrack track;
  track.loop = loop;
  for (const PositionKey& key : keys) {
    track.time.push_back(key.time);
    track.value.push_back(key.position);
  }
  std::vector<Vec3> change;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) change.push_back(keys[i + 1].position - keys[i].position);
  const std::vector<EndRates> rates = end_rates(track.time, change, interpolation, loop);
  for (std::size_t i = 0; i < change.size(); ++i) {
    const double third = (track.time[i + 1] - track.time[i]) / 3;
    const Vec3 first = third * keys[i].velocity.value_or(rates[i].begin),
               last = third * keys[i + 1].velocity.value_or(rates[i].end);
    track.increment.push_back({first, change[i] - first - last, last});
  }
  find_jumps(track);
  return track;
}

Vec3 position_at(const PositionTrack& track, double time) {
  DUET_ASSERT(!track.time.empty());
  MotionState state;
  follow(track, time, state);
  return state.pose.position;
}

OrientationTrack orientation_track(std::span<const OrientationKey> keys, Interpolation interpolation,
                                   AfterLastKey after) {
  const bool loop = after == AfterLastKey::repeat;
  DUET_ASSERT(is_increasing(keys));
  OrientationTrack track;
  track.loop = loop;
  for (const OrientationKey& key : keys) {
    track.time.push_back(key.time);
    DUET_ASSERT(is_unit(key.axis));
    track.value.push_back(exponential(key.angle * key.axis));
  }
  std::vector<Vec3> change;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) change.push_back(rotation_between(keys[i], keys[i + 1]));
  const std::vector<EndRates> rates = end_rates(track.time, change, interpolation, loop);
  for (std::size_t i = 0; i < change.size(); ++i) {
    const double third = (track.time[i + 1] - track.time[i]) / 3;
    const Vec3 first = third * rates[i].begin, last = third * rates[i].end;
    const Quat middle = exponential(-last) * exponential(change[i]) * exponential(-first);
    track.increment.push_back({first, logarithm_near(middle, change[i] - first - last), last});
  }
  find_jumps(track);
  return track;
}

MotionState motion_at(const KinematicMotion& motion, double time) {
  DUET_ASSERT(!motion.position.time.empty() && !motion.orientation.time.empty());
  MotionState state;
  follow(motion.position, time, state);
  follow(motion.orientation, time, state);
  for (const Spin& spin : motion.spins) follow(spin, time, state);
  for (const Sinusoid& sinusoid : motion.sinusoids) follow(sinusoid, time, state);

  const Vec3 arm = state.pose.orientation * motion.frame.position;
  state.pose.position += arm;
  state.velocity += state.angular_velocity.cross(arm);
  state.pose.orientation = (state.pose.orientation * motion.frame.orientation).normalized();
  return state;
}

double next_jump(const KinematicMotion& motion, double time) {
  double next = std::min(next_jump(motion.position, time), next_jump(motion.orientation, time));
  const auto consider = [&](double jump) {
    if (jump > time) next = std::min(next, jump);
  };
  for (const Spin& spin : motion.spins)
    if (spin.ramp == 0) {
      consider(spin.start);
      consider(spin.stop);
    }
  for (const Sinusoid& sinusoid : motion.sinusoids) {
    if (std::abs(math::cos(sinusoid.phase)) > least_jump) consider(sinusoid.start);
    consider(sinusoid.stop);
  }
  return next;
}

MotionBounds motion_bounds(const KinematicMotion& motion, double begin, double end) {
  DUET_ASSERT(begin <= end);
  MotionBounds bounds{rate_bound(motion.position, begin, end), rate_bound(motion.orientation, begin, end), 0};
  for (const Spin& spin : motion.spins)
    if (spin.start <= end && spin.stop >= begin) bounds.spin += std::abs(spin.rate);
  for (const Sinusoid& sinusoid : motion.sinusoids) {
    if (sinusoid.start > end || sinusoid.stop < begin) continue;
    const double omega = two_pi * sinusoid.frequency;
    bounds.phase = std::max(bounds.phase, omega);
    bounds.speed += omega * sinusoid.amplitude.norm();
    bounds.spin += omega * sinusoid.turn.norm();
  }
  bounds.speed += bounds.spin * motion.frame.position.norm();
  return bounds;
}

}  // namespace duet
