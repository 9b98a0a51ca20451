// The contact point, one record for all kinds of contact. It lies on the surface of one body and near the
// level set of a rigid one:
//
//   host   the rigid body whose level set gives distance and normal (reference body)
//   guest  the body whose point touches the host (incident body): a surface point of a deformable body, or a
//          point of another rigid body
//
// Impulses act on the guest and, reversed, on the host, at one and the same place, so linear and angular
// momentum are kept to rounding.
#pragma once

#include <array>
#include <vector>

#include "sim/contact/detection/candidate_search.h"
#include "sim/contact/detection/friction.h"

namespace duet {

/// One point at which two bodies touch or may touch within a step, with what the solvers keep about it.
/// Positions and directions are in world space unless a member says otherwise.
struct ContactPoint {
  int host = -1;         ///< Index of the rigid body with the level set.
  int guest_rigid = -1;  ///< Index of the rigid body that touches the host; -1: the guest is deformable.
  FeatureId feature;     ///< Place on the guest; host, guest and place name the contact from step to step.
  Vec3 normal = Vec3::UnitY();        ///< Unit: outward normal of the host.
  Vec3 first_normal = Vec3::UnitY();  ///< Unit: `normal` at the beginning of the step, when it was found.
  Vec3 host_arm = Vec3::Zero();       ///< m: from the host's center of mass to the contact.
  Vec3 guest_arm = Vec3::Zero();      ///< m: from a rigid guest's center of mass to the contact.
  double gap = 0;       ///< m: Touch::gap, and after find_impact_planes() the gap to the plane ahead.
  double friction = 0,  ///< Coulomb coefficient.
      restitution = 0;  ///< Coefficient of restitution; 0 for deformable guests.
  /// Factor on the tolerances of the solvers: 1 for bodies of 5 cm and more, in proportion to the size of the
  /// smaller body below that. The size of a deformable guest is the diameter of its box.
  double precision = 1;
  ContactResponse response;  ///< Change of the relative velocity by impulses at the contact.
  /// m/s: least normal velocity of the guest relative to the host, set by find_speculative_targets(). Minus
  /// infinity: the contact is out of reach and exerts nothing.
  double target = 0;
  /// m/s: the part of `target` in step III that lets another vertex of a round surface land in the step, see
  /// find_speculative_targets(). 0 if the same vertex touches at the end.
  double landing = 0;
  /// N s: impulse on the guest, accumulated by the collisions and later by the contact solve.
  Vec3 impulse = Vec3::Zero();
  /// m/s, guest relative to host: what the curved paths of the bodies' points, and the motion of the place of
  /// contact, add over this step to the velocities of the two bodies (sim/step/kinematic_motion.h,
  /// find_speculative_targets()). Zero for velocities at one moment in time.
  Vec3 path_velocity = Vec3::Zero();
  int patch = -1;     ///< Number of the ContactPatch that the point belongs to; -1: none.
  double share = 0;   ///< Fraction of an even load on `patch` that the point stands for; 0 without a patch.
  double spread = 0;  ///< N s: scratch of spread_evenly(), the normal impulse that it finds.
  bool takes_part = false;  ///< Scratch of spread_evenly(): whether the point is among those that carry load.
  /// Plane of an edge contact, or of a contact in a face, as found at the beginning of the step. Its normal
  /// is zero for all other contacts.
  EdgePoint edge;
  PlaneFrame plane_frame;   ///< The body or feature that the plane of `edge` moves with.
  SurfacePoint on_surface;  ///< Place of the contact on an edge or a face of a deformable guest.
  /// m: by how much a guest may come nearer to its host at the contact, because it is pinched (pinching.h) or
  /// held there (held_places.h).
  double yielded = 0;
  bool is_pinched = false;  ///< Whether two hosts pinch the guest there: it sticks if there is friction.
  bool is_carried = false;  ///< Whether a support point acts for it in step III, see SampleCulling.
  /// True if `normal` and `gap` belong to the plane that the bodies meet later in the step, see
  /// impact_plane.h.
  bool meets_ahead = false;
  /// True if the point is already level with the plane that it meets later in the step, because the guest
  /// slides or rolls onto it.
  bool is_level_ahead = false;
  /// True if the point touches, and goes on touching or opens, with the velocities of the beginning of the
  /// step.
  bool stays = false;
  /// Returns whether the guest is rigid.
  bool is_rigid_pair() const { return guest_rigid >= 0; }
  /// Returns whether the contact has a plane of its own in `edge`: edge contacts, contacts in faces of
  /// deformable guests, and points against one of several faces of a mesh.
  bool is_on_edge() const { return !edge.normal.isZero(0); }
  /// Returns whether a sample of a rigid guest, or a surface point of a deformable one, touches the nearest
  /// surface of the host.
  bool is_sample() const { return !feature.follows() && !is_on_edge(); }
};

/// Returns whether the contact is that of the lowest vertex of a patch of a rigid guest's round surface.
inline bool is_on_round_surface(const ContactPoint& contact) {
  return contact.is_rigid_pair() && contact.feature.kind == FeatureId::Kind::round;
}

/// The contacts between two bodies: a range of ContactSet::points.
struct ContactPair {
  int host = -1;  ///< Index of the rigid body that is listed as host; some points have the roles swapped.
  int guest_rigid = -1;       ///< Index of the rigid guest; -1: the guest is deformable.
  int guest_deformable = -1;  ///< Index of the deformable guest; -1: the guest is rigid.
  int begin = 0,              ///< First contact point.
      end = 0;                ///< One past the last contact point.
  int level = 0;              ///< Layer of the contact graph: the higher one of those of the two bodies.
  bool collided = false;      ///< True if step II found the bodies overlapping.
  bool active = false;        ///< True if the pair takes part in the contact solve.
  int patches = 0;   ///< Number of flat faces that lie on each other; ContactPoint::patch is below it.
  double power = 0;  ///< J: scratch of the warm start, the work of the impulses.
  /// N m s: impulse of rolling and spinning friction on a rigid guest.
  Vec3 angular_impulse = Vec3::Zero();
};

/// A thin deformable body between two bodies that no force moves, at a place where these leave less room than
/// it is thick.
struct Pinch {
  int guest_deformable = -1;  ///< Index of the deformable body.
  int first = -1,             ///< Index of one of the rigid bodies.
      second = -1;            ///< Index of the other rigid body, greater than `first`.
  double room = 0;            ///< m: distance of the rigid bodies there; negative if they overlap.
};

/// Geometry of one contact at given positions of the bodies, in world space.
struct Touch {
  Vec3 position;  ///< m: the guest's point.
  Vec3 normal;    ///< Unit: outward normal of the host.
  /// m: signed distance of the point from the host, plus SurfacePoint::contact_offset on a deformable guest
  /// and ContactPoint::yielded on a pinched one. It is infinite if the point is beside an edge, see
  /// ContactPlane::faces, or above a surface that a neighbor of the host hides, see hidden_foot().
  double gap = 0;
  /// m: point of the host that touches, if the plane moves with a face of a deformable guest; if it moves
  /// with an edge, the center of the ball of the host that touches. Not set for other contacts.
  Vec3 foot = Vec3::Zero();
};

/// The touches of the contacts with deformable guests as step IV.2 has measured them last. Step V takes them,
/// if nothing has moved in between.
struct MeasuredTouches {
  std::vector<Touch> touch;  ///< For each contact; only those with deformable guests are measured.
  std::vector<Vec3> x;       ///< m: positions of the particles that they belong to; empty: there are none.
  std::vector<Pose> pose;    ///< Poses of the rigid bodies that they belong to.
  /// Says that the touches belong to the present positions.
  void keep(const Bodies& bodies);
  /// Returns whether the touches of `contacts` contacts belong to the present positions.
  bool hold(const Bodies& bodies, std::size_t contacts) const;
};

/// All contacts of a step, with the scratch of their search.
struct ContactSet {
  std::vector<ContactPoint> points;  ///< Contact points, those of each pair next to each other.
  std::vector<ContactPair> pairs;    ///< Pairs of bodies that have contact points.
  std::vector<Pose>
      predicted;  ///< Scratch of find_speculative_targets(): poses of the shapes of rigid bodies.
  /// For every island: whether the contact cache holds none of its contacts, see warm_start().
  std::vector<char> is_cold;
  CandidateSearch search;            ///< Scratch of find_candidates().
  MeasuredTouches measured;          ///< Touches at the end of step IV.2.
  std::vector<Pinch> pinches;        ///< Pinches of this step, see pinching.h.
  std::vector<Vec3> sheet_normals;   ///< Scratch of yield_where_pinched().
  std::vector<double> sheet_yields;  ///< Scratch of yield_where_pinched().
};

/// Returns whether an impulse of the contact acts on its host. It changes the velocity of dynamic hosts only.
inline bool moves_host(const Bodies& bodies, const ContactPoint& contact) {
  return contact.is_rigid_pair() || bodies.push_back;
}

/// Returns the place of a contact on its deformable guest.
inline const SurfacePoint& surface_point(const Bodies& bodies, const ContactPoint& contact) {
  return contact.is_on_edge() ? contact.on_surface
                              : bodies.points[static_cast<std::size_t>(contact.feature.index)];
}
/// Sets `contact.on_surface` for a contact on an edge or a face of a deformable guest, from its `feature` and
/// `edge`: particles, weights, inverse mass and contact offset.
void put_on_surface(const Bodies& bodies, ContactPoint& contact);

/// Applies an impulse that only turns to one rigid body: `moment` (N m s, world). Bodies that are not dynamic
/// stay as they are. It is inline because contact sweeps spend their time here.
inline void apply_angular_impulse(RigidState& state, const RigidProperties& properties, const Vec3& moment) {
  if (!properties.is_dynamic()) return;
  state.angular_momentum += moment;
  state.angular_velocity += state.inverse_inertia * moment;
}
/// Applies `impulse` (N s, world) to one rigid body at `arm` (m, world) from its center of mass. Bodies that
/// are not dynamic stay as they are. It is inline because contact sweeps spend their time here.
inline void apply_impulse(RigidState& state, const RigidProperties& properties, const Vec3& arm,
                          const Vec3& impulse) {
  if (!properties.is_dynamic()) return;
  state.velocity += properties.inverse_mass * impulse;
  apply_angular_impulse(state, properties, arm.cross(impulse));
}

/// Returns the velocity of the guest relative to the host at the contact, with the path velocity, m/s.
inline Vec3 relative_velocity(const Bodies& bodies, const ContactPoint& contact) {
  const Vec3 guest = contact.is_rigid_pair()
                         ? point_velocity(bodies.rigid.state[static_cast<std::size_t>(contact.guest_rigid)],
                                          contact.guest_arm)
                         : weighted(surface_point(bodies, contact), bodies.particles.v);
  return guest -
         point_velocity(bodies.rigid.state[static_cast<std::size_t>(contact.host)], contact.host_arm) +
         contact.path_velocity;
}

/// Applies `impulse` (N s, world) to the guest of a contact and its opposite to the host. Changes velocities
/// and angular momenta, but not ContactPoint::impulse.
inline void apply_impulse(Bodies& bodies, const ContactPoint& contact, const Vec3& impulse) {
  const auto host = static_cast<std::size_t>(contact.host);
  if (contact.is_rigid_pair()) {
    const auto guest = static_cast<std::size_t>(contact.guest_rigid);
    apply_impulse(bodies.rigid.state[guest], bodies.rigid.properties[guest], contact.guest_arm, impulse);
  } else {
    apply_impulse(surface_point(bodies, contact), impulse, bodies.particles);
  }
  if (moves_host(bodies, contact))
    apply_impulse(bodies.rigid.state[host], bodies.rigid.properties[host], contact.host_arm, -impulse);
}

/// Returns the touch of the place `feature` of a rigid guest, with the shapes of the bodies at the given
/// poses, see shape_pose(). `edge` is ContactPoint::edge.
Touch touch(const RigidProperties& host, const Pose& host_pose, const RigidProperties& guest,
            const Pose& guest_pose, const FeatureId& feature, const EdgePoint& edge = {});
/// Returns the touch of the place `feature` of the rigid body `guest` with the rigid body `host` and the
/// static bodies that adjoin it, with the shapes of both at the given poses. `edge` is ContactPoint::edge.
Touch touch(const Bodies& bodies, int host, const Pose& host_pose, int guest, const Pose& guest_pose,
            const FeatureId& feature, const EdgePoint& edge);
/// Returns the touch of a contact with a deformable guest, with its point at `x` (m) and the host's shape at
/// `host_pose`.
Touch touch(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose, const Vec3& x);
/// Returns the touch of a contact at the present positions.
Touch touch(const Bodies& bodies, const ContactPoint& contact);
/// Returns the touch of a contact with the shapes of all rigid bodies at the poses `predicted`, and all
/// particles moved for `dt` (s) with their present velocities. The point of a deformable guest is moved on by
/// `shift` (m).
Touch predicted_touch(const Bodies& bodies, const std::vector<Pose>& predicted, double dt,
                      const ContactPoint& contact, const Vec3& shift);
/// Recomputes normal, arms, gap and response of a contact from the present positions. Moves contacts in faces
/// and on edges of deformable guests along with the host, sets the path velocity to zero, and drops a plane
/// that the contact met ahead.
void update_geometry(const Bodies& bodies, ContactPoint& contact);
/// The same for a contact whose touch at the present positions is known: `now`. Its plane must not follow a
/// face or an edge of a deformable guest.
void update_geometry(const Bodies& bodies, const Touch& now, ContactPoint& contact);
/// Returns ContactPoint::gap of a rigid pair with the delays of its bodies, m: the gap at the beginning of
/// the step on the straight paths that lead to its end.
double delayed_gap(const Bodies& bodies, const ContactPoint& contact);
/// Returns the gap of a contact at the present positions, m.
double gap_now(const Bodies& bodies, const ContactPoint& contact);

/// K(r) = 1/m + r*^T I^-1 r*: change of the velocity of a rigid body's point per impulse at that point, 1/kg
/// (paper section 6.1). `arm` (m, world) is r, the displacement of the point from the center of mass.
Mat3 impulse_factor(const RigidState& state, double inverse_mass, const Vec3& arm);

}  // namespace duet
