// Internal edges: where static bodies adjoin, as the planks of a floor do, bodies that lie on them must not
// collide with the faces that they hide from each other (ghost collisions).
#pragma once

#include <optional>

#include "sim/contact/detection/contact_plane.h"
#include "sim/state/bodies.h"

namespace duet {

/// Gap up to which two static bodies adjoin, relative to the smaller one's smallest size. A larger value
/// would close gaps into which a body can still fall or run; a smaller one would leave gaps between bodies
/// that a scene places next to each other with rounded numbers.
constexpr double adjoin_within = 1e-4;

/// Returns for each rigid body, if it is static, the static bodies that touch or overlap it. The lists of all
/// other bodies are empty.
ElementLists adjoining_bodies(const Bodies& bodies);

/// Removes those samples and feature edges of static bodies at which the union of adjoining bodies has no
/// convex edge or corner, such as those along the planks of a floor. Rigid bodies that slide over them would
/// run into them. Reads Bodies::adjoining.
void remove_hidden_samples(Bodies& bodies);

/// The exit of a point from a host: the surface through which it would leave, in world space.
struct Exit {
  Vec3 normal = Vec3::Zero();  ///< Unit: outward normal of the surface, the exit direction.
  double depth = 0;            ///< m: depth below that surface; negative outside.
};

/// A place on the surface of a host that an adjoining body hides. The host's normal there would stop a body
/// that slides over the internal edge between the two, and would clamp one that has come into it. In world
/// space.
struct HiddenFoot {
  Vec3 foot;           ///< m: the hidden place.
  Vec3 others_normal;  ///< Unit: normal of the adjoining body's surface, which goes on from there. Zero if
                       ///< the surfaces face each other.
  int body = -1;       ///< Index of the adjoining body.
};
/// Returns whether an adjoining body hides the surface of `host` at `foot` (m, world), where its outward unit
/// normal is `normal`; nothing if none does.
std::optional<HiddenFoot> hidden_foot(const Bodies& bodies, int host, const Vec3& foot, const Vec3& normal);
/// Returns the exit from the union of `host` and its adjoining bodies, for a point at `x` (m, world) whose
/// exit `way` from the host alone ends at the hidden place `hidden`.
///
/// From inside, the point leaves in the direction `inward` (unit, world) in which the rest of its body lies.
/// If that is zero or leads out only after half the smallest size of these bodies, the result is `way`.
/// Outside of the host, the exit is through the adjoining body's surface; if the surfaces face each other,
/// the point touches nothing (depth -infinity).
Exit exit_from_union(const Bodies& bodies, int host, const Vec3& x, const Vec3& inward, const Exit& way,
                     const HiddenFoot& hidden);

/// Returns whether another static body adjoins `host` at `foot` (m, world), a point of its surface that is
/// known up to `precision` (m).
bool is_at_internal_edge(const Bodies& bodies, int host, const Vec3& foot, double precision);

/// Returns the signed distance (m) of `x` (m, world) from the union of `body`, with the pose `pose`, and the
/// static bodies that adjoin it.
double united_distance(const Bodies& bodies, int body, const Pose& pose, const Vec3& x);

/// Says how a guest's point depends on its host.
enum class PointKind {
  support,  ///< A support point towards this host. Each body that adjoins the host has one of its own.
  fixed     ///< A point that stays where it is on the guest, whatever it touches.
};

/// Finds the plane that contact_plane() finds for `host` at `pose`, but no plane that an adjoining body
/// hides.
///
/// `x` and `inside` are as in contact_plane(), and the result is in the shape space of the host. If a support
/// point is above a hidden place from which the surface of the adjoining body goes on, the plane is that
/// surface's, through the hidden place, with an infinite gap and ContactPlane::continued_by set: the support
/// point towards the hidden edge is not the one towards that plane.
ContactPlane exposed_plane(const Bodies& bodies, int host, const Pose& pose, const Vec3& x,
                           const Vec3& inside, PointKind kind);

}  // namespace duet
