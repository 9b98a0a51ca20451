#include "sim/contact/detection/impact_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_plane.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/ring_contacts.h"

namespace duet {
namespace {

// Greatest difference in height of level surfaces, relative to the size of the smaller body. Rounding and the
// tolerances of the solvers leave bodies less than a tenth of that deep. A larger value lets bodies pass over
// higher steps without an impact.
constexpr double same_height = 1e-4;
// The path within a step is searched in steps as long as the distance to the host, but no shorter than the
// lesser of these: a fraction of the path, and a fraction of the host's smallest size.
constexpr double min_part = 1.0 / 32, min_size_part = 0.25;
// Least cosine of the angle between the normals of the plane at the beginning and of the one that is met for
// the former to stay: 0.8 degrees.
constexpr double same_plane_normal = 0.9999;
// Least cosine of that angle for a point that touches already, and for bodies in joints: 8 degrees. A greater
// angle means that the point passes an edge to another face.
constexpr double same_face = 0.99;
// Depth below its plane at which an edge contact takes another plane, relative to level_depth(). Edges that
// cross meet in the plane of both, of which the nearest face says nothing, so that a meeting alone is not
// enough.
constexpr double plane_tolerance = 10;
constexpr int most_looks = 256;         // most steps of the search along a path; then its end counts
constexpr int meeting_bisections = 12;  // of the last step: the time of the meeting is known to 1/4096 of it

// The paths of the two bodies of a contact through a step.
class Path {
 public:
  Path(const Bodies& bodies, const VelocityState& velocity, double dt, OrientationUpdate orientation,
       const ContactPoint& contact)
      : bodies_(bodies), velocity_(velocity), dt_(dt), orientation_(orientation), contact_(contact) {}

  // Returns the touch after the fraction `s` of the step. For an edge contact it is that of the present place
  // on the guest with the nearest surface of the host.
  Touch at(double s) const {
    const Pose host = pose(contact_.host, s), guest = pose(contact_.guest_rigid, s);
    if (!contact_.is_on_edge() || is_ring_contact(contact_))
      return touch(bodies_, contact_.host, host, contact_.guest_rigid, guest, contact_.feature,
                   contact_.edge);
    const LevelSet& shape = bodies_.rigid.properties[as_index(contact_.host)].shape;
    const Vec3 x = guest.to_world(contact_.edge.place);
    const SignedDistance nearest = shape.exact(host.to_body(x));
    const Vec3 normal = host.orientation * nearest.normal;
    return {x - contact_.edge.radius * normal, normal, nearest.distance - contact_.edge.radius};
  }

  // Returns the gap of an edge contact to the plane that it was found with, after the fraction `s` of the
  // step, m.
  double gap_to_plane(double s) const {
    return touch(bodies_, contact_.host, pose(contact_.host, s), contact_.guest_rigid,
                 pose(contact_.guest_rigid, s), contact_.feature, contact_.edge)
        .gap;
  }

  // Returns the velocity of the guest relative to the host along the path, m/s, at the place that `contact`
  // has.
  Vec3 relative_velocity(const ContactPoint& contact) const {
    return point_velocity(state(contact.guest_rigid), contact.guest_arm) -
           point_velocity(state(contact.host), contact.host_arm);
  }

  // Returns the pose of the shape of a body after the fraction `s` of the step.
  Pose pose(int body, double s) const {
    return shape_pose(bodies_.rigid.properties[as_index(body)], body_pose(body, s));
  }

  // Returns the center of mass and principal axes of a body after the fraction `s` of the step.
  Pose body_pose(int body, double s) const {
    const auto b = as_index(body);
    return bodies_.rigid.properties[b].moves() ? evolved_pose(state(body), s * dt_, orientation_)
                                               : bodies_.rigid.state[b].pose;
  }

 private:
  // Returns the state of a body at the beginning, with the velocities of the path.
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

// The moment at which the bodies meet, and their touch then.
struct Meeting {
  double time = 0;  // fraction of the step
  Touch touch;
};

// Returns where the path first leads deeper than `depth` (m), or its end. `length` (m) is the length of the
// path, `min_step` (m) the shortest step of the search along it.
Meeting first_meeting(const Path& path, double length, double depth, double min_step) {
  double outside = 0;
  Touch touch = path.at(0);
  for (int look = 0; look < most_looks && outside < 1; ++look) {
    const double step = std::max(touch.gap, min_step) / length;
    const double next = std::min(1.0, outside + (std::isfinite(step) ? step : min_part));
    touch = path.at(next);
    if (touch.gap >= -depth) {
      outside = next;
      continue;
    }
    double inside = next;
    for (int i = 0; i < meeting_bisections; ++i) {
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

// Returns whether the contact has a plane that stays where it was found on the host.
bool keeps_plane(const Bodies& bodies, const ContactPoint& contact) {
  if (is_ring_contact(contact)) return false;
  const LevelSet& guest = bodies.rigid.properties[as_index(contact.guest_rigid)].shape;
  const bool is_round = guest.kind == LevelSet::Kind::capsule || guest.kind == LevelSet::Kind::cylinder;
  return contact.is_on_edge() && !(is_round && contact.edge.radius > 0);
}

// Gives an edge contact the plane at which the bodies meet, in ContactPoint::edge, so that it keeps the
// plane.
void put_on_edge(const Bodies& bodies, const Path& path, const Meeting& meeting, double depth,
                 ContactPoint& contact) {
  const Pose pose = path.pose(contact.host, meeting.time);
  const Vec3 foot = meeting.touch.position - meeting.touch.gap * meeting.touch.normal;
  contact.edge.normal = pose.orientation.conjugate() * meeting.touch.normal;
  contact.edge.foot = pose.to_body(foot);
  update_geometry(bodies, contact);
  contact.is_level_ahead = std::abs(contact.gap) <= depth;
}

// Gives a contact that is no edge contact the plane at which the bodies meet, for this step only. `dt` is the
// step (s).
void put_at_point(const Bodies& bodies, const Path& path, const Meeting& meeting, double dt, double depth,
                  ContactPoint& contact) {
  const Pose pose = path.body_pose(contact.guest_rigid, meeting.time);
  const RigidState &h = bodies.rigid.state[as_index(contact.host)],
                   &g = bodies.rigid.state[as_index(contact.guest_rigid)];
  contact.normal = meeting.touch.normal;
  // Samples turn with their body. The place at which a round body touches does not, about the origin of its
  // shape.
  contact.guest_arm = contact.is_sample() ? Vec3(g.pose.orientation * pose.to_body(meeting.touch.position))
                                          : Vec3(meeting.touch.position - pose.position);
  if (const auto& frame = bodies.rigid.properties[as_index(contact.guest_rigid)].shape_frame;
      frame && !contact.is_sample())
    contact.guest_arm += g.pose.orientation * frame->position - pose.orientation * frame->position;
  // Both arms lead to one place, which keeps angular momentum. A guest that does not move takes none, so that
  // the arm is that at the meeting.
  contact.host_arm = bodies.rigid.properties[as_index(contact.guest_rigid)].is_dynamic()
                         ? Vec3(g.pose.position + contact.guest_arm - h.pose.position)
                         : Vec3(meeting.touch.position - path.body_pose(contact.host, meeting.time).position);
  // At the end of the step the gap keeps its sign: at zero, rounding would decide between an impact and none.
  const double least = meeting.time < 1 ? 0 : -depth;
  contact.gap = std::max(meeting.touch.gap, least) -
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

//   distance from the guest(x - e n) = e
// holds if the host meets the guest's surface at the sample or edge's place x from outside, rather than along
// it: x is then the point of the guest nearest to x - e n, a point just inside of the host, with the host's
// normal n. A point on a straight edge cannot be hit in the direction of the edge, nor a point of a face in a
// direction within the face: there the host slides along, and contacts of crossing edges carry it. Returns
// whether the equation holds nearly; for support points and the axes of round bodies it returns true.
bool meets_from_outside(const Bodies& bodies, const Path& path, const Meeting& meeting,
                        const ContactPoint& contact) {
  constexpr double probe = 0.01;        // e, relative to the guest's smallest size
  constexpr double min_distance = 0.8;  // relative to e: smooth meshes with flat faces reach 0.9
  const bool is_on_axis = contact.is_on_edge() && contact.edge.radius > 0;
  if (contact.feature.follows() || is_on_axis) return true;
  const LevelSet& guest = bodies.rigid.properties[as_index(contact.guest_rigid)].shape;
  const double e = probe * guest.min_size();
  const Vec3 x = meeting.touch.position - e * meeting.touch.normal;
  return united_distance(bodies, contact.guest_rigid, path.pose(contact.guest_rigid, meeting.time), x) >
         min_distance * e;
}

// Returns whether the host is round where the bodies meet, so that a plane that stays on it would turn with
// it.
bool is_round_at(const Bodies& bodies, const Path& path, const Meeting& meeting,
                 const ContactPoint& contact) {
  constexpr double along_axis = 0.999;  // least component of a cap's normal along the axis of a cylinder
  const LevelSet& host = bodies.rigid.properties[as_index(contact.host)].shape;
  if (is_swept_by_ball(host)) return true;
  const Vec3 normal = path.pose(contact.host, meeting.time).orientation.conjugate() * meeting.touch.normal;
  return host.kind == LevelSet::Kind::cylinder && std::abs(normal.y()) < along_axis;
}

// Returns whether joints hold the body. They bend its path, which is taken for straight here. So contacts of
// such bodies get another plane only if it is that of another face.
bool is_linked(const Bodies& bodies, int body) {
  return as_index(body) < bodies.linked.size() && bodies.linked[as_index(body)] >= 0;
}

// Returns whether two dynamic balls meet. However little the line of their centers turns on the way, an
// impulse beside it would spin them.
bool are_moving_balls(const Bodies& bodies, const ContactPoint& contact) {
  const auto is_one = [&](int body) {
    const RigidProperties& properties = bodies.rigid.properties[as_index(body)];
    return properties.is_dynamic() && properties.is_ball();
  };
  return is_one(contact.host) && is_one(contact.guest_rigid);
}

// Returns where two balls touch first, or nothing if they pass each other. With the distance d of the guest's
// center from the host's, which changes by w in the step, and the distance r at which they touch:
//   |d + s w|^2 = r^2.
std::optional<Meeting> meeting_of_balls(const Path& path, const ContactPoint& contact) {
  const auto distance = [&](double s) -> Vec3 {
    return path.pose(contact.guest_rigid, s).position - path.pose(contact.host, s).position;
  };
  const Vec3 d = distance(0), w = distance(1) - d;
  const double r = d.norm() - contact.gap, apart = d.squaredNorm() - r * r;
  const double approach = -d.dot(w), root = approach * approach - w.squaredNorm() * apart;
  if (!(approach > 0 && root >= 0)) return {};
  const double s = apart / (approach + std::sqrt(root));
  if (s > 1) return {};
  return Meeting{s, path.at(s)};
}

// Returns where the path first leads deeper than `depth` (m), or its end. Returns nothing if the contact can
// keep its plane: because it is not reached even if the bodies fall by `fall` (m), because it touches already
// and does not end level, or because an edge contact that touches still touches its plane.
std::optional<Meeting> meeting_of(const Bodies& bodies, const Path& path, double length, double depth,
                                  double fall, const ContactPoint& contact) {
  const Touch end = path.at(1);
  const bool is_feature_edge = contact.is_on_edge(), is_apart = contact.gap > depth;
  if (end.gap > depth + fall && (!is_feature_edge || path.gap_to_plane(1) > 0)) return {};
  if (!is_apart) {
    // At an edge of the host the nearest face may be on either side of it. An edge contact whose plane still
    // touches there keeps it.
    if (is_feature_edge && std::abs(path.gap_to_plane(1)) <= depth) return {};
    return std::abs(end.gap) <= depth ? std::optional(Meeting{1, end}) : std::nullopt;
  }
  if (!is_feature_edge && end.gap >= -depth) return Meeting{1, end};
  if (!is_feature_edge && end.normal.dot(contact.normal) > same_plane_normal) return Meeting{1, end};
  const LevelSet& host = bodies.rigid.properties[as_index(contact.host)].shape;
  return first_meeting(path, length, depth, std::min(min_part * length, min_size_part * host.min_size()));
}

// Returns the displacement from the place of an edge contact some way into its guest, in the world's axes, m.
Vec3 way_into_guest(const Bodies& bodies, const ContactPoint& contact) {
  constexpr double way = 0.25;  // relative to the guest's smallest size
  const RigidProperties& guest = bodies.rigid.properties[as_index(contact.guest_rigid)];
  const Quat turn = shape_pose(bodies.rigid, as_index(contact.guest_rigid)).orientation;
  const auto node = as_index(contact.feature.index);
  const std::vector<Vec3>& inward = guest.feature_edges.inward;
  if (contact.feature.kind != FeatureId::Kind::edge || node >= inward.size()) return Vec3::Zero();
  return way * guest.shape.min_size() * (turn * inward[node]);
}

// Returns whether the plane of an edge contact ends where the guest's edge is level with its end, so that the
// guest slides over that end.
bool slides_over_end(const Bodies& bodies, const ContactPoint& contact) {
  const Quat turn = shape_pose(bodies.rigid, as_index(contact.host)).orientation;
  return ends_at(bodies.rigid.properties[as_index(contact.host)].shape, contact.edge.foot,
                 contact.edge.normal, turn.conjugate() * way_into_guest(bodies, contact));
}

// Gives one contact the plane in which its bodies meet, if it needs another one than it has, and sets
// ContactPoint::stays. See find_impact_planes().
void look_ahead(const Bodies& bodies, const Path& path, double dt, double fall, ContactPoint& contact) {
  const Vec3 velocity = path.relative_velocity(contact);
  const double length = dt * velocity.norm(), depth = level_depth(bodies, contact);
  contact.stays = contact.gap <= depth && contact.normal.dot(velocity) >= -depth / dt;
  if (contact.gap < -depth || length < depth || (contact.gap > length && std::isfinite(contact.gap))) return;
  const bool are_free = !is_linked(bodies, contact.host) && !is_linked(bodies, contact.guest_rigid);
  const bool is_apart = contact.gap > depth;
  const bool are_balls = are_free && contact.gap > 0 && are_moving_balls(bodies, contact) &&
                         (is_apart || path.at(1).gap < -depth);
  const std::optional<Meeting> found =
      are_balls ? meeting_of_balls(path, contact) : meeting_of(bodies, path, length, depth, fall, contact);
  if (!found) return;
  const Meeting& meeting = *found;
  const bool ends_level = std::abs(meeting.touch.gap) <= depth;
  if (std::isinf(meeting.touch.gap) || (!is_apart && !ends_level)) return;
  if (is_apart && contact.is_sample() && meeting.touch.gap < -depth &&
      !meets_from_outside(bodies, path, meeting, contact)) {
    contact.meets_ahead = true;
    contact.gap = std::numeric_limits<double>::infinity();
    return;
  }
  const double same = is_apart && are_free ? same_plane_normal : same_face;
  if (!are_balls && meeting.touch.normal.dot(contact.normal) > same) return;
  if (keeps_plane(bodies, contact)) {
    const bool keeps = meeting.time < 1 || is_round_at(bodies, path, meeting, contact);
    if (keeps && path.gap_to_plane(meeting.time) > -plane_tolerance * depth) return;
    if (meets_from_outside(bodies, path, meeting, contact) || slides_over_end(bodies, contact))
      put_on_edge(bodies, path, meeting, depth, contact);
    return;
  }
  ContactPoint ahead = contact;
  put_at_point(bodies, path, meeting, dt, depth, ahead);
  if (!is_apart && !ahead.is_level_ahead) return;
  contact = ahead;
  if (are_balls) contact.is_level_ahead = false;  // they do not roll onto each other, but strike
}

}  // namespace

double level_depth(const Bodies& bodies, int a, int b) {
  const auto size = [&](int body) { return bodies.rigid.properties[as_index(body)].shape.min_size(); };
  return same_height * std::min(size(a), size(b));
}

double level_depth(const Bodies& bodies, const ContactPoint& contact) {
  return level_depth(bodies, contact.host, contact.guest_rigid);
}

void find_impact_planes(const Bodies& bodies, const VelocityState& velocity, double dt,
                        OrientationUpdate orientation, double fall, ContactSet& contacts) {
  parallel_for(contacts.points.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ContactPoint& contact = contacts.points[i];
      const bool is_against_face = contact.is_on_edge() && contact.feature.is_support();
      if (!contact.is_rigid_pair() || is_against_face) continue;
      look_ahead(bodies, Path(bodies, velocity, dt, orientation, contact), dt, fall, contact);
    }
  });
}

Touch touch_ahead(const Bodies& bodies, const ContactPoint& contact, double dt, const Vec3& change) {
  const auto g = as_index(contact.guest_rigid);
  const RigidState& guest = bodies.rigid.state[g];
  const Vec3 velocity = relative_velocity(bodies, contact) + change;
  const Vec3 x = guest.pose.position + contact.guest_arm;
  // The place at which a round body touches does not turn with it.
  const Vec3 way = dt * (contact.is_sample() ? point_velocity(guest, contact.guest_arm)
                                             : shape_velocity(guest, bodies.rigid.properties[g]));
  return {x + guest.delay + way, contact.normal,
          delayed_gap(bodies, contact) + dt * contact.normal.dot(velocity)};
}

}  // namespace duet
