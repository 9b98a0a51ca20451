#include "sim/scene/reader/random_placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/elementary.h"

namespace duet::scene {
namespace {

constexpr int max_tries = 10000;  // random poses of a box before random_pose() gives up

}  // namespace

double Random::uniform(double least, double most) {
  const double share = static_cast<double>(engine_() >> 11) * 0x1p-53;
  return least + (most - least) * share;
}

// Uniform random rotations: Shoemake 1992.
Quat Random::rotation() {
  const double u = uniform(0, 1), a = uniform(0, 2 * std::numbers::pi), b = uniform(0, 2 * std::numbers::pi);
  const double r = std::sqrt(1 - u), s = std::sqrt(u);
  return {r * math::sin(a), r * math::cos(a), s * math::sin(b), s * math::cos(b)};
}

// Separating axis test: two boxes are disjoint if one of their edges, or a cross product of two, separates
// them.
bool overlap(const PlacedBox& a, const PlacedBox& b) {
  const Mat3 A = a.pose.orientation.toRotationMatrix(), B = b.pose.orientation.toRotationMatrix();
  const Vec3 way = b.pose.position - a.pose.position;
  const auto separates = [&](const Vec3& axis) {
    const double reach =
        (A.transpose() * axis).cwiseAbs().dot(a.half) + (B.transpose() * axis).cwiseAbs().dot(b.half);
    return std::abs(way.dot(axis)) > reach;
  };
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (separates(A.col(i)) || separates(B.col(i))) return false;
    for (Eigen::Index j = 0; j < 3; ++j)
      // Below a sine of 1e-6 the edges are parallel, and the axes of the boxes have separated them before.
      if (const Vec3 axis = A.col(i).cross(B.col(j)); axis.squaredNorm() > 1e-12 && separates(axis))
        return false;
  }
  return true;
}

std::optional<Pose> random_pose(const Vec3& half, const Vec3& lower, const Vec3& upper, BoxAxes axes,
                                const std::vector<PlacedBox>& placed, Random& random) {
  for (int i = 0; i < max_tries; ++i) {
    PlacedBox box{{Vec3::Zero(), axes == BoxAxes::random ? random.rotation() : Quat::Identity()}, half};
    const Vec3 reach = box.pose.orientation.toRotationMatrix().cwiseAbs() * half;
    bool fits = true;
    for (Eigen::Index k = 0; k < 3; ++k) {
      fits = fits && lower[k] + reach[k] <= upper[k] - reach[k];
      box.pose.position[k] = random.uniform(lower[k] + reach[k], upper[k] - reach[k]);
    }
    if (fits &&
        std::none_of(placed.begin(), placed.end(), [&](const PlacedBox& b) { return overlap(box, b); }))
      return box.pose;
  }
  return std::nullopt;
}

}  // namespace duet::scene
