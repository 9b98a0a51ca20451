// One contact point for everything. It lies on the surface of one body and near the level set of a rigid one:
//
//   host   the rigid body whose level set gives distance and normal
//   guest  what touches it: a surface point of a deformable body, or a sample point of another rigid body
//
// Impulses act on the guest and, reversed, on the host, at one and the same place, so linear and angular
// momentum are kept to rounding.
#pragma once

#include <array>
#include <vector>

#include "sim/contact/detection/candidate_search.h"
#include "sim/contact/detection/friction.h"

namespace duet {

struct ContactPoint {
  int host = -1;         // rigid body with the level set
  int guest_rigid = -1;  // rigid body that touches it, or -1
  // Index of the deformable's surface point, or the number of all these + i for a place on edge i, or,
  // further on, see at_corner(); of a rigid guest: of its sample, or the number of these + i for a place on a
  // ridge next to node i, or -1 - k for deepest point k, or against_face().
  int guest_point = -1;
  Vec3 normal = Vec3::UnitY();        // unit, outward of the host
  Vec3 first_normal = Vec3::UnitY();  // the same where it was found, at the beginning of the step
  Vec3 host_arm = Vec3::Zero();       // m, from the host's centre of mass to the contact
  Vec3 guest_arm = Vec3::Zero();      // m, from a rigid guest's centre of mass to the contact
  double gap = 0;                     // m, signed distance less the allowance
  double friction = 0, restitution = 0;
  // Of the tolerances of the solvers: 1 for bodies of 5 cm and more, in proportion to the smaller body below.
  double precision = 1;
  ContactResponse response;
  double target = 0;  // m/s, least normal velocity of the guest relative to the host; or minus infinity
  Vec3 impulse = Vec3::Zero();  // N s, accumulated on the guest by the collisions; then by the contact solve
  // m/s, of the guest relative to the host: what the curved paths of a kinematic body's points add over this
  // step to the velocities of the two bodies (sim/step/kinematic_motion.h); zero at one moment in time
  Vec3 path_velocity = Vec3::Zero();
  // Of a point of a flat face that lies on another: which of the pair's faces it is, and the part of the load
  // that the point stands for where pressure is even. Else -1 and 0.
  int patch = -1;
  double share = 0;
  double spread = 0;        // N s, scratch of spread_evenly
  bool takes_part = false;  // scratch of spread_evenly
  EdgePoint edge;           // of a place on a ridge, an edge or a face, as found at the beginning of the step
  PlaneKeeper keeper;       // what its plane goes with
  SurfacePoint on_surface;  // the place on a deformable guest's edge or face
  // m, by how much a pinched guest is thinner there, see pinching.h; what is pinched sticks, if there is
  // friction
  double yielded = 0;
  // Normal and gap are those of the plane that the bodies meet further on in the step, see impact_plane.h.
  bool meets_ahead = false;
  // The plane ahead is level with the point already: what the guest slides or rolls onto.
  bool is_level_ahead = false;
  // Touches, and goes on touching or opens with the velocities of the beginning of the step.
  bool stays = false;
  bool is_rigid_pair() const { return guest_rigid >= 0; }
  bool is_on_edge() const { return !edge.normal.isZero(0); }
  bool is_sample() const { return guest_point >= 0 && !is_on_edge(); }
};

// Contacts of the same two bodies follow each other; a pair is such a range.
struct ContactPair {
  int host = -1;
  int guest_rigid = -1;                 // or -1
  int guest_deformable = -1;            // or -1
  int begin = 0, end = 0;               // range of contact points
  int level = 0;                        // of the contact graph
  bool collided = false;                // found overlapping by step II
  bool active = false;                  // takes part in the contact solve
  int patches = 0;                      // faces that lie on each other: their numbers are 0 ... patches - 1
  double power = 0;                     // N m, scratch of the warm start
  Vec3 angular_impulse = Vec3::Zero();  // N m s, of rolling and spinning friction on a rigid guest
};

// A thin deformable body between two bodies that no force moves, where there is less room than it is thick.
struct Pinch {
  int guest_deformable = -1;
  int first = -1, second = -1;  // rigid bodies, the lesser first
  double room = 0;              // m, between them; negative where they overlap
};

struct ContactSet {
  std::vector<ContactPoint> points;
  std::vector<ContactPair> pairs;
  std::vector<Pose> predicted;  // of the rigid bodies; scratch of predict_contacts
  std::vector<char> is_cold;    // of every island: nothing is remembered of its contacts, see warm_start()
  CandidateSearch search;       // scratch of find_candidates
  std::vector<Pinch> pinches;   // of the step, see pinching.h
  std::vector<Vec3> sheet_normals;  // scratch of yield_where_pinched
};

// Whether an impulse of the contact changes its host's velocity, if that can change at all.
inline bool moves_host(const Bodies& bodies, const ContactPoint& contact) {
  return contact.is_rigid_pair() || bodies.push_back;
}

// Of a deformable guest.
inline const SurfacePoint& surface_point(const Bodies& bodies, const ContactPoint& contact) {
  return contact.is_on_edge() ? contact.on_surface
                              : bodies.points[static_cast<std::size_t>(contact.guest_point)];
}
// Number of the contact of a corner, a bulge or a deepest point of a host with the faces of a deformable
// guest, as ContactPoint::guest_point: of corners and bulges wherever on them it is.
int at_corner(const Bodies& bodies, int guest_deformable, int corner);
// Sets the surface point of a contact on a deformable guest's edge or face by its `guest_point` and `lowest`.
void put_on_surface(const Bodies& bodies, ContactPoint& contact);

// An impulse (N s) on one rigid body, at `arm` (m) from its centre of mass, and one that only turns it (N m
// s). Static bodies stay as they are. These are what contact sweeps spend their time with, so they are
// inline.
inline void apply_angular_impulse(RigidState& state, const RigidProperties& properties, const Vec3& moment) {
  if (!properties.is_dynamic()) return;
  state.angular_momentum += moment;
  state.angular_velocity += state.inverse_inertia * moment;
}
inline void apply_impulse(RigidState& state, const RigidProperties& properties, const Vec3& arm,
                          const Vec3& impulse) {
  if (!properties.is_dynamic()) return;
  state.velocity += properties.inverse_mass * impulse;
  apply_angular_impulse(state, properties, arm.cross(impulse));
}

// Velocity of the guest relative to the host at the contact, m/s.
inline Vec3 relative_velocity(const Bodies& bodies, const ContactPoint& contact) {
  const Vec3 guest = contact.is_rigid_pair()
                         ? point_velocity(bodies.rigid.state[static_cast<std::size_t>(contact.guest_rigid)],
                                          contact.guest_arm)
                         : weighted(surface_point(bodies, contact), bodies.particles.v);
  return guest -
         point_velocity(bodies.rigid.state[static_cast<std::size_t>(contact.host)], contact.host_arm) +
         contact.path_velocity;
}

// Applies `impulse` (N s) to the guest and its opposite to the host; velocities and angular momenta change.
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

// How a guest's point meets its host.
struct Touch {
  Vec3 position;   // m, of the guest's point
  Vec3 normal;     // unit, outward of the host
  double gap = 0;  // m, signed distance less the allowance; infinite beside an edge, see ContactPlane, and
                   // above what is hidden, see hidden_foot()
  Vec3 foot = Vec3::Zero();  // m, of a host that a deformable guest's face or edge keeps the plane of: what
                             // of it touches, or the centre of the ball that does
};

// Of a rigid guest's point, numbered as in ContactPoint, at the given poses.
Touch touch(const RigidProperties& host, const Pose& host_pose, const RigidProperties& guest,
            const Pose& guest_pose, int sample, const EdgePoint& lowest = {});
// The same of two of the bodies, and what adjoins them.
Touch touch(const Bodies& bodies, int host, const Pose& host_pose, int guest, const Pose& guest_pose,
            int sample, const EdgePoint& lowest);
// Of a deformable guest's point at `x` (m), with the host at `host_pose`.
Touch touch(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose, const Vec3& x);
// At the positions now.
Touch touch(const Bodies& bodies, const ContactPoint& contact);
// With rigid bodies at the `predicted` poses, particles after `dt` (s) at their velocities now, and a
// deformable guest's point moved on by `shift` (m).
Touch predicted_touch(const Bodies& bodies, const std::vector<Pose>& predicted, double dt,
                      const ContactPoint& contact, const Vec3& shift);
// Recomputes normal, arms, gap and response from the positions now, and forgets the path velocity.
void update_geometry(const Bodies& bodies, ContactPoint& contact);
// The gap at the positions now, m.
double gap_now(const Bodies& bodies, const ContactPoint& contact);

// K(r) = 1/m + r*^T I^-1 r*: velocity of a rigid body's point per impulse there, 1/kg.
Mat3 impulse_factor(const RigidState& state, double inverse_mass, const Vec3& arm);

}  // namespace duet
