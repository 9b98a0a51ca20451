#include "sim/contact/detection/impact_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sim/base/parallel.h"
#include "sim/contact/detection/internal_edges.h"

namespace duet {
namespace {

// Of the smaller body's size: surfaces that differ by less in height are level. Rounding and the tolerances
// of the solvers leave bodies less than a tenth of that deep.
constexpr double level = 1e-4;
// Fractions of the path within a step, and of the host's smallest size: the path is looked at in steps no
// longer than the distance to the host or this much.
constexpr double least_part = 1.0 / 32, least_size_part = 0.25;
constexpr double same_normal = 0.9999;  // cosine of 0.8 degrees: the plane at the beginning serves
constexpr double same_face =
    0.99;  // cosine, of the planes of a point that touches already: else it is at an edge
// Of the depth at which a meeting is noticed: edges that cross meet in the plane of both, of which the
// nearest face says nothing.
constexpr double plane_tolerance = 10;
constexpr int most_looks = 256;
constexpr int bisections = 12;

class Path {
 public:
  Path(const Bodies& bodies, const VelocityState& velocity, double dt, OrientationUpdate orientation,
       const ContactPoint& contact)
      : bodies_(bodies), velocity_(velocity), dt_(dt), orientation_(orientation), contact_(contact) {}

  // After the part `s` of the step. On a ridge the distance of the place there at the beginning.
  Touch at(double s) const {
    const Pose host = pose(contact_.host, s), guest = pose(contact_.guest_rigid, s);
    if (!contact_.is_on_edge())
      return touch(bodies_, contact_.host, host, contact_.guest_rigid, guest, contact_.guest_point,
                   contact_.edge);
    const LevelSet& shape = bodies_.rigid.properties[as_index(contact_.host)].shape;
    const Vec3 x = guest.to_world(contact_.edge.place);
    const SignedDistance nearest = shape.exact(host.to_body(x));
    const Vec3 normal = host.orientation * nearest.normal;
    return {x - contact_.edge.radius * normal, normal, nearest.distance - contact_.edge.radius};
  }

  // m, of a place on a ridge to the plane that it was found with.
  double gap_to_plane(double s) const {
    return touch(bodies_, contact_.host, pose(contact_.host, s), contact_.guest_rigid,
                 pose(contact_.guest_rigid, s), contact_.guest_point, contact_.edge)
        .gap;
  }

  // Velocity along the path of the guest relative to the host, m/s, at the place that `contact` has.
  Vec3 relative_velocity(const ContactPoint& contact) const {
    return point_velocity(state(contact.guest_rigid), contact.guest_arm) -
           point_velocity(state(contact.host), contact.host_arm);
  }

  Pose pose(int body, double s) const {
    const auto b = as_index(body);
    return bodies_.rigid.properties[b].moves() ? evolved_pose(state(body), s * dt_, orientation_)
                                               : bodies_.rigid.state[b].pose;
  }

 private:
  RigidState state(int body) const {
    const auto b = as_index(body);
    RigidState state = bodies_.rigid.state[b];
    const RigidProperties& properties = bodies_.rigid.properties[b];
    if (!properties.is_dynamic()) return state;
    state.velocity = velocity_.rigid[b];
    state.angular_momentum = velocity_.rotation[b];
    state.angular_velocity = state.inverse_inertia * state.angular_momentum;
    return state;
  }

  const Bodies& bodies_;
  const VelocityState& velocity_;
  double dt_;
  OrientationUpdate orientation_;
  const ContactPoint& contact_;
};

struct Meeting {
  double time = 0;  // part of the step
  Touch touch;
};

// Where the path first leads deeper than `depth` (m), or its end.
Meeting first_meeting(const Path& path, double length, double depth, double least_step) {
  double outside = 0;
  Touch touch = path.at(0);
  for (int look = 0; look < most_looks && outside < 1; ++look) {
    const double step = std::max(touch.gap, least_step) / length;
    const double next = std::min(1.0, outside + (std::isfinite(step) ? step : least_part));
    touch = path.at(next);
    if (touch.gap >= -depth) {
      outside = next;
      continue;
    }
    double inside = next;
    for (int i = 0; i < bisections; ++i) {
      const double middle = (outside + inside) / 2;
      const Touch there = path.at(middle);
      if (there.gap < -depth) {
        inside = middle;
        touch = there;
      } else {
        outside = middle;
      }
    }
    return {inside, touch};
  }
  return {1, outside < 1 ? path.at(1) : touch};
}

// Whether the touch is that of a plane that stays where it was found on the host.
bool keeps_plane(const LevelSet& guest, const ContactPoint& contact) {
  const bool is_round = guest.kind == LevelSet::Kind::capsule || guest.kind == LevelSet::Kind::cylinder;
  return contact.is_on_edge() && !(is_round && contact.edge.radius > 0);
}

// Gives the contact the plane that the bodies `meet` at. A place on a ridge takes its plane with it.
void put_on_edge(const Bodies& bodies, const Path& path, const Meeting& meeting, double depth,
                 ContactPoint& contact) {
  const Pose pose = path.pose(contact.host, meeting.time);
  const Vec3 foot = meeting.touch.position - meeting.touch.gap * meeting.touch.normal;
  contact.edge.normal = pose.orientation.conjugate() * meeting.touch.normal;
  contact.edge.foot = pose.to_body(foot);
  update_geometry(bodies, contact);
  contact.is_level_ahead = std::abs(contact.gap) <= depth;
}

// Other points have it for this step only. `dt`: s.
void put_at_point(const Bodies& bodies, const Path& path, const Meeting& meeting, double dt, double depth,
                  ContactPoint& contact) {
  const Pose pose = path.pose(contact.guest_rigid, meeting.time);
  const RigidState &h = bodies.rigid.state[as_index(contact.host)],
                   &g = bodies.rigid.state[as_index(contact.guest_rigid)];
  contact.normal = meeting.touch.normal;
  // Fixed points turn with their body; where round bodies touch does not.
  contact.guest_arm = contact.is_sample() ? Vec3(g.pose.orientation * pose.to_body(meeting.touch.position))
                                          : Vec3(meeting.touch.position - pose.position);
  contact.host_arm = g.pose.position + contact.guest_arm - h.pose.position;
  contact.gap = std::max(meeting.touch.gap, 0.0) -
                meeting.time * dt * contact.normal.dot(path.relative_velocity(contact));
  contact.meets_ahead = true;
  contact.is_level_ahead = std::abs(contact.gap) <= depth;
  const auto factor = [&](const RigidState& state, int body, const Vec3& arm) {
    return impulse_factor(state, bodies.rigid.properties[as_index(body)].inverse_mass, arm);
  };
  contact.response = ContactResponse(
      factor(h, contact.host, contact.host_arm) + factor(g, contact.guest_rigid, contact.guest_arm),
      contact.normal);
}

// Whether the host meets the guest's surface at a sample from outside of it, rather than along it: the sample
// x is nearest of the guest's surface to the point x - e n just inside of the host,
//   distance from the guest(x - e n) = e,
// for the host's normal n. A point on a straight edge cannot be hit in the direction of the edge, nor a point
// of a face in a direction within the face: there the host slides along, and edges that cross carry it.
bool meets_from_outside(const Bodies& bodies, const Path& path, const Meeting& meeting,
                        const ContactPoint& contact) {
  constexpr double probe = 0.01;          // e, of the guest's smallest size
  constexpr double least_distance = 0.8;  // of e; smooth meshes of flat faces reach 0.9
  if (!contact.is_sample()) return true;
  const LevelSet& guest = bodies.rigid.properties[as_index(contact.guest_rigid)].shape;
  const double e = probe * guest.smallest_size();
  const Vec3 x = meeting.touch.position - e * meeting.touch.normal;
  return united_distance(bodies, contact.guest_rigid, path.pose(contact.guest_rigid, meeting.time), x) >
         least_distance * e;
}

// Whether the host is round where the bodies meet: a plane that stays on it turns with it.
bool is_round_at(const Bodies& bodies, const Path& path, const Meeting& meeting,
                 const ContactPoint& contact) {
  constexpr double along_axis = 0.999;
  const LevelSet& host = bodies.rigid.properties[as_index(contact.host)].shape;
  if (is_swept_by_ball(host)) return true;
  const Vec3 normal = path.pose(contact.host, meeting.time).orientation.conjugate() * meeting.touch.normal;
  return host.kind == LevelSet::Kind::cylinder && std::abs(normal.y()) < along_axis;
}

// Joints bend the path of a body, which this page takes for straight: there a plane is exchanged for another
// face's alone.
bool is_linked(const Bodies& bodies, int body) {
  return as_index(body) < bodies.linked.size() && bodies.linked[as_index(body)] >= 0;
}

// Where the path leads deeper than `depth` (m), or its end; nothing if the plane of now serves: what is not
// reached though the bodies fall by `fall` (m), what touches and leaves the level, and what meets the same
// face.
std::optional<Meeting> meeting_of(const Bodies& bodies, const Path& path, double length, double depth,
                                  double fall, const ContactPoint& contact) {
  const Touch end = path.at(1);
  const bool is_ridge = contact.is_on_edge(), is_apart = contact.gap > depth;
  if (end.gap > depth + fall && (!is_ridge || path.gap_to_plane(1) > 0)) return {};
  if (!is_apart) {
    // At an edge of the host the nearest face may be either side of it: a ridge's plane that still touches
    // there serves.
    if (is_ridge && std::abs(path.gap_to_plane(1)) <= depth) return {};
    return std::abs(end.gap) <= depth ? std::optional(Meeting{1, end}) : std::nullopt;
  }
  if (!is_ridge && end.gap >= -depth) return Meeting{1, end};
  if (!is_ridge && end.normal.dot(contact.normal) > same_normal) return Meeting{1, end};
  const LevelSet& host = bodies.rigid.properties[as_index(contact.host)].shape;
  return first_meeting(path, length, depth,
                       std::min(least_part * length, least_size_part * host.smallest_size()));
}

void look_ahead(const Bodies& bodies, const Path& path, double dt, double fall, ContactPoint& contact) {
  const Vec3 velocity = path.relative_velocity(contact);
  const double length = dt * velocity.norm(), depth = level_depth(bodies, contact);
  contact.stays = contact.gap <= depth && contact.normal.dot(velocity) >= -depth / dt;
  if (contact.gap < -depth || length < depth || (contact.gap > length && std::isfinite(contact.gap))) return;
  const std::optional<Meeting> found = meeting_of(bodies, path, length, depth, fall, contact);
  if (!found) return;
  const Meeting& meeting = *found;
  const bool is_apart = contact.gap > depth, ends_level = std::abs(meeting.touch.gap) <= depth;
  if (std::isinf(meeting.touch.gap) || (!is_apart && !ends_level)) return;
  if (is_apart && meeting.touch.gap < -depth && !meets_from_outside(bodies, path, meeting, contact)) {
    contact.meets_ahead = true;
    contact.gap = std::numeric_limits<double>::infinity();
    return;
  }
  const bool takes_all =
      is_apart && !is_linked(bodies, contact.host) && !is_linked(bodies, contact.guest_rigid);
  if (meeting.touch.normal.dot(contact.normal) > (takes_all ? same_normal : same_face)) return;
  if (keeps_plane(bodies.rigid.properties[as_index(contact.guest_rigid)].shape, contact)) {
    const bool keeps = meeting.time < 1 || is_round_at(bodies, path, meeting, contact);
    if (keeps && path.gap_to_plane(meeting.time) > -plane_tolerance * depth) return;
    put_on_edge(bodies, path, meeting, depth, contact);
    return;
  }
  ContactPoint ahead = contact;
  put_at_point(bodies, path, meeting, dt, depth, ahead);
  if (is_apart || ahead.is_level_ahead) contact = ahead;
}

}  // namespace

double level_depth(const Bodies& bodies, const ContactPoint& contact) {
  const auto size = [&](int body) { return bodies.rigid.properties[as_index(body)].shape.smallest_size(); };
  return level * std::min(size(contact.host), size(contact.guest_rigid));
}

void find_impact_planes(const Bodies& bodies, const VelocityState& velocity, double dt,
                        OrientationUpdate orientation, double fall, ContactSet& contacts) {
  parallel_for(contacts.points.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ContactPoint& contact = contacts.points[i];
      const bool is_against_face = contact.is_on_edge() && contact.guest_point < 0;
      if (!contact.is_rigid_pair() || is_against_face) continue;
      look_ahead(bodies, Path(bodies, velocity, dt, orientation, contact), dt, fall, contact);
    }
  });
}

Touch touch_ahead(const Bodies& bodies, const ContactPoint& contact, double dt, const Vec3& change) {
  const RigidState& guest = bodies.rigid.state[as_index(contact.guest_rigid)];
  const Vec3 velocity = relative_velocity(bodies, contact) + change;
  const Vec3 x = guest.pose.position + contact.guest_arm;
  // Where a round body touches does not turn with it.
  const Vec3 way = dt * (contact.is_sample() ? point_velocity(guest, contact.guest_arm) : guest.velocity);
  return {x + way, contact.normal, contact.gap + dt * contact.normal.dot(velocity)};
}

}  // namespace duet
