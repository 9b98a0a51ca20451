// Where static bodies adjoin, as the planks of a floor do, what lies on them must not feel the faces that
// they hide from each other.
#pragma once

#include <optional>

#include "sim/contact/detection/contact_plane.h"
#include "sim/state/bodies.h"

namespace duet {

// Of the smallest size of two static bodies: no farther apart, they adjoin.
constexpr double adjoin_within = 1e-4;

// The static bodies that touch or overlap each static body; none for all others.
ElementLists adjoining_bodies(const Bodies& bodies);

// Takes away the samples and ridges of static bodies that no convex edge or corner is left at, such as those
// along the planks of a floor: rigid bodies that slide over them would run into them.
void remove_hidden_samples(Bodies& bodies);

// How a point would leave a host.
struct WayOut {
  Vec3 normal = Vec3::Zero();  // unit, outward
  double depth = 0;            // m, below the surface with that normal; negative outside
};

// Where a body that adjoins the host hides its surface at `foot` (m): there its unit normal `normal` would
// stop what slides over the seam between the two, and clamp what has come into it.
struct HiddenFoot {
  Vec3 foot;
  Vec3 others_normal;  // of the surface of the other body that goes on from there; zero if they face each
                       // other
  int body = -1;       // the other body
};
std::optional<HiddenFoot> hidden_foot(const Bodies& bodies, int host, const Vec3& foot, const Vec3& normal);
// The way out of all of them instead of `way`, for a point at `x` (m) the rest of whose body lies in the unit
// direction `inward`.
WayOut way_out_of_seam(const Bodies& bodies, int host, const Vec3& x, const Vec3& inward, const WayOut& way,
                       const HiddenFoot& hidden);

// Whether another body adjoins the host at `foot`, which is known up to `precision` (m).
bool is_at_seam(const Bodies& bodies, int host, const Vec3& foot, double precision);

// Signed distance (m) of `x` (m) from a body at `pose` together with the static bodies that adjoin it.
double united_distance(const Bodies& bodies, int body, const Pose& pose, const Vec3& x);

// What a guest's point is: the deepest one towards this host, so that a body that adjoins it has one of its
// own, or a point that stays where it is on the guest whatever it touches.
enum class PointKind { deepest, fixed };

// contact_plane() of a host at `pose`, but for what is hidden. Of a deepest point over a hidden foot it is
// the plane of the surface that goes on from there, through the foot, with an infinite gap: what is deepest
// towards the hidden edge is not what is deepest towards that plane.
ContactPlane exposed_plane(const Bodies& bodies, int host, const Pose& pose, const Vec3& x,
                           const Vec3& inside, PointKind kind);

}  // namespace duet
