#include "sim/simulation/deepest_point.h"

#include <algorithm>

namespace duet {

DepthSearch::DepthSearch(const RigidBodies& rigid, const BodyBounds& bounds, int host, double spacing)
    : shape_(rigid.properties[as_index(host)].shape),
      pose_(shape_pose(rigid, as_index(host))),
      is_half_space_(bounds.is_half_space),
      spacing_(spacing) {
  if (!is_half_space_) box_ = world_box(bounds, 0);
}

void DepthSearch::at_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double around,
                              DeepestPoint& deepest) const {
  const Vec3 middle = (a + b + c) / 3;
  const double radius = std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
  if (min_distance(middle) - radius - around >= deepest.distance) return;
  const double ab = (b - a).norm(), bc = (c - b).norm(), ca = (a - c).norm();
  if (std::max({ab, bc, ca}) <= spacing_) {
    for (const Vec3& x : {middle, a, b, c}) at(x, around, deepest);
  } else if (ab >= bc && ab >= ca) {
    at_triangle(a, (a + b) / 2, c, around, deepest);
    at_triangle((a + b) / 2, b, c, around, deepest);
  } else {
    at_triangle(b, c, a, around, deepest);
  }
}

// Returns a cheap lower bound of the distance (m) of `x` from the host.
double DepthSearch::min_distance(const Vec3& x) const {
  const double outside = is_half_space_ ? 0 : box_.exteriorDistance(x);
  return outside > 0 ? outside : shape_.distance(pose_.to_body(x)) - shape_.tolerance();
}

// Updates `deepest` by one point.
void DepthSearch::at(const Vec3& x, double around, DeepestPoint& deepest) const {
  if (min_distance(x) - around >= deepest.distance) return;
  const double distance = shape_.exact(pose_.to_body(x)).distance - around;
  if (distance < deepest.distance) deepest = {distance, x};
}

}  // namespace duet
