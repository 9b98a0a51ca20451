// Places oriented boxes at random so that no two overlap.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "sim/base/types.h"

namespace duet::scene {

/// A random number generator with the same numbers on every machine: the engine is that of the C++ standard,
/// the distributions are our own.
class Random {
 public:
  /// Equal seeds give equal numbers.
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Returns a number that is uniformly distributed in [least, most).
  double uniform(double least, double most);
  /// Returns a rotation that is uniformly distributed over all rotations.
  Quat rotation();

 private:
  std::mt19937_64 engine_;
};

/// An oriented box.
struct PlacedBox {
  Pose pose;                 ///< Center (m) and axes.
  Vec3 half = Vec3::Zero();  ///< Half edge lengths, m.
};

/// Returns whether two boxes overlap or touch, by the separating axis test.
bool overlap(const PlacedBox& a, const PlacedBox& b);

/// The axes of a box that is placed at random.
enum class BoxAxes {
  random,    ///< A random rotation.
  of_bounds  ///< Those of the box that it is placed in.
};

/// Finds a random pose of a box with the half edge lengths `half` (m) by rejection: the first of 10000 whose
/// box lies between the corners `lower` and `upper` (m) and overlaps none of `placed`. Returns none if there
/// is no such pose.
std::optional<Pose> random_pose(const Vec3& half, const Vec3& lower, const Vec3& upper, BoxAxes axes,
                                const std::vector<PlacedBox>& placed, Random& random);

}  // namespace duet::scene
