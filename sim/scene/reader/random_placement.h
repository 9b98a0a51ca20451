// Places oriented boxes at random so that none meets another.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "sim/base/types.h"

namespace duet::scene {

// The same numbers on every machine: the engine is the standard's, the distribution our own.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double least, double most);
  Quat rotation();  // uniform over all

 private:
  std::mt19937_64 engine_;
};

struct PlacedBox {
  Pose pose;
  Vec3 half = Vec3::Zero();  // m
};

bool overlap(const PlacedBox& a, const PlacedBox& b);

// By rejection: the first of 10000 random poses whose box lies between `lower` and `upper` (m) and meets none
// of `placed`; none if there is no such. `turns`: with a random rotation.
std::optional<Pose> random_pose(const Vec3& half, const Vec3& lower, const Vec3& upper, bool turns,
                                const std::vector<PlacedBox>& placed, Random& random);

}  // namespace duet::scene
