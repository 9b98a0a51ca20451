// Ring contacts: where the center line of a torus comes nearest to a ball, a capsule, another torus, the side
// of a cylinder or an edge of a box.
//
// Coaxial rings touch all along a circle, and rings that are shifted a little touch where they cross: at two
// places that run far around the rings when these shift or tilt a little more. Contacts at the nearest places
// alone would be out of date at the end of the step, and let the rings enter each other. So the center line
// is divided into arcs that stay on the torus, and each arc near the other body has a contact.
#pragma once

#include <vector>

#include "sim/contact/detection/edge_contacts.h"

namespace duet {

struct ContactPoint;

/// How many numbers FeatureId::index of ring contacts takes: the number of the shortest arcs.
constexpr int ring_numbers = 81;

/// Returns whether two shapes touch by ring contacts alone: one is a torus, and the other one a ball, a
/// capsule or a torus.
bool touch_along_ring(const LevelSet& a, const LevelSet& b);
/// Returns whether `guest` is the guest of the ring contacts of two shapes for which touch_along_ring()
/// holds. Of a torus and a capsule it is the torus, and of two tori the smaller one: it is divided into arcs,
/// because circles that cross do so at places farther apart on the smaller one. Of a torus and a ball it is
/// the ball, and the arcs are the host's. `direction` is that of the pair of bodies; it decides between equal
/// shapes.
bool is_guest_of_ring(const LevelSet& guest, const LevelSet& host, PairDirection direction);
/// Returns whether a ball at `center` (m, shape space of the torus) is so near to the axis of `torus` that it
/// touches all around: the difference between its distances from the farthest and the nearest place of the
/// center line is less than a tenth of the tube's radius. Other balls touch with their support point alone,
/// which is exact, and have no ring contacts.
bool is_in_middle(const Vec3& center, const LevelSet& torus);
/// Returns whether a ball, a capsule or a torus as guest leaves the contact with `host` to ring contacts,
/// with the guest at `pose` in the host's shape space.
bool is_left_to_ring(const LevelSet& guest, const Pose& pose, const LevelSet& host);
/// Returns whether `normal` (unit, shape space of a cylinder) is that of its side.
bool is_on_side_of_cylinder(const Vec3& normal);
/// Returns whether a torus has ring contacts with `host` where the host's outward normal is `normal` (unit,
/// shape space of the host): anywhere on balls, capsules and tori, on the side of a cylinder, and at the
/// edges of a box.
bool has_arcs_at(const LevelSet& host, const Vec3& normal);
/// Returns whether a contact is a ring contact. Its place and plane follow the bodies, see place_on_arc().
bool is_ring_contact(const ContactPoint& contact);

/// An arc of a torus's center line.
struct RingArc {
  Vec3 middle = Vec3::Zero();  ///< m, in the shape space of the torus: the middle of the arc.
  double end = 0;              ///< tan(w/2), with the angle w from the middle to either end.
  double slack = 0;            ///< m: by how much the middle may be higher than the lowest place and touch.
  double tube = 0;             ///< m: radius of the tube.
};

/// The place at which an arc touches.
struct RingPlace {
  Vec3 center = Vec3::Zero();  ///< m, in the host's shape space: the place on the center line.
  Vec3 normal = Vec3::Zero();  ///< Unit, in the host's shape space: outward normal of the host there.
  double distance = 0;         ///< m: signed distance of `center` from the host.
};

/// Returns the place at which `arc` touches `host`: its middle as long as that is hardly farther from the
/// host than the nearest place, and else the nearest place. With the distance d(a) of the place at the angle
/// a from the middle, which is least at a0, it is that at
///
///   tan(a/2) = s tan(a0/2),   s = clamp((d(0) - d(a0)) / slack - 1, 0, 1).
///
/// The middles of short arcs, which stay, are the corners of a polygon on which a ring stands where it
/// crosses another one at a small angle. At a greater angle the nearest place moves little, and is exact.
///
/// If the ring touches on one side only, so that the place across the circle from the nearest place is
/// farther from the host by more than a tenth of the tube's radius, it is the nearest place, and beyond an
/// end of the arc where the distance falls on, the next minimum. So the place runs along with a body that
/// rolls in the ring. `pose` is that of the torus in the host's shape space.
RingPlace place_on_arc(const RingArc& arc, const Pose& pose, const LevelSet& host);

/// Appends to `found` the ring contacts of a torus with `host`, at the places for which has_arcs_at() holds.
///
/// The center line is divided into 9 arcs. An arc whose middle is farther from the host than its nearest
/// place by more than 1e-6 of the tube's radius, and by more than twice the height of that place above the
/// lowest one of the ring, is divided into three, and these once more. Coaxial rings touch at 9 places all
/// around, and others at more and nearer places where they cross. The shortest arcs have a slack of 1e-4 of
/// the tube's radius: this is how deep rings may enter each other. Each arc has one contact, if it is less
/// than `margin` (m) from the host; but if the ring touches on one side only, arcs whose nearest place is an
/// end beyond which the distance falls on by a hundredth of the tube's radius leave the contact to the next
/// arc. On cylinders and boxes all such arcs do, so that no arc beside a face touches its edge. Its touch at
/// other poses, with place_on_arc() again, depends on the poses alone. EdgePoint::place is the middle of the
/// arc, and FeatureId::index numbers the middles of the shortest arcs. On cylinders and boxes FeatureId::sub
/// is 0, because other edge contacts have numbers of nodes.
///
/// `feature_edges` are those of the torus, and `pose` is its pose in the host's shape space.
void find_ring_contacts(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host,
                        double margin, std::vector<EdgeContact>& found);
/// Appends the ring contacts of `ball` as guest with a torus as host, whose feature edges are
/// `feature_edges`. They are those of find_ring_contacts() with the roles swapped, so that EdgePoint::place
/// is in the host's shape space. `pose` is that of the ball there.
void find_ring_contacts_of_ball(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& ball,
                                double margin, std::vector<EdgeContact>& found);
/// Returns the arc of a ring contact, from ContactPoint::edge. EdgePoint::weight holds RingArc::end and
/// RingArc::slack over the radius of the tube.
inline RingArc arc_of(const EdgePoint& edge) {
  return {edge.place, edge.weight[0], edge.weight[1] * edge.radius, edge.radius};
}

/// Returns whether an edge contact of a rigid guest is a ring contact: whether it has the end of an arc.
inline bool is_arc(const EdgePoint& edge) { return edge.weight[0] > 0; }

}  // namespace duet
