#include "sim/contact/detection/contact_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/contact/detection/edge_contacts.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/friction_fade.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/contact/detection/shape_support_point.h"

namespace duet {
Mat3 impulse_factor(const RigidState& state, double inverse_mass, const Vec3& arm) {
  const Mat3 cross = skew(arm);
  return inverse_mass * Mat3::Identity() - cross * state.inverse_inertia * cross;
}

namespace {

constexpr double no_distance = 1e-9;  // distance that counts as none, relative to the host's smallest size
// Greatest squared sine of the angle between two axes that are parallel (0.6 degrees). Nearer to parallel,
// the place where they cross is ill-conditioned, and the place found at the beginning of the step is kept.
constexpr double parallel = 1e-4;
constexpr double turned = 1e-6;  // greatest sine of the angle between equal normals: rounding
// Greatest component of a normal along the axis of a host that is touched on its side.
constexpr double side_slope = 1e-3;

// Returns the pose of the guest in the shape space of the host.
Pose in_space_of(const Pose& host, const Pose& guest) {
  return {host.to_body(guest.position), host.orientation.conjugate() * guest.orientation};
}

// Returns a rigid guest's sample or support point in the shape space of the host.
ShapeSupportPoint in_space_of(const RigidProperties& host, const Pose& host_pose,
                              const RigidProperties& guest, const Pose& guest_pose,
                              const FeatureId& feature) {
  const Pose in_host = in_space_of(host_pose, guest_pose);
  if (feature.is_support()) return support_point(guest.shape, feature.index, in_host, host.shape);
  const auto i = as_index(feature.index);
  const auto vertex = [&](int v) -> ShapeSupportPoint {
    return {in_host.to_world(guest.round->vertices[as_index(v)]),
            in_host.to_world(guest.round->inside[as_index(v)])};
  };
  if (feature.kind == FeatureId::Kind::vertex) return vertex(feature.index);
  if (feature.kind == FeatureId::Kind::round)
    return vertex(lowest_vertex(*guest.round, guest.on_round[i].patch, in_host, host.shape).vertex);
  return {in_host.to_world(guest.samples[i]), in_host.to_world(guest.inside[i])};
}

// Returns the touch of an edge contact whose plane stays where it was found on the host. Of two edges that
// cross, neither leads through the plane, so that it stays right while they slide along each other. Only
// their turning within a step changes it, in the second order.
Touch touch_at(const EdgePoint& edge, const Pose& host_pose, const Pose& guest_pose) {
  const Vec3 normal = host_pose.orientation * edge.normal, x = guest_pose.to_world(edge.place);
  return {x - edge.radius * normal, normal, normal.dot(x - host_pose.to_world(edge.foot)) - edge.radius};
}

bool has_round_side(const LevelSet& shape) {
  return shape.kind == LevelSet::Kind::capsule || shape.kind == LevelSet::Kind::cylinder;
}

// Returns the touch of a place on the axis of a guest with a round side, against the side of a host that has
// one as well. A plane that stays on a turning host would turn with it. So the nearest places of the two axes
// are found again, no farther from the place given than the sum of the two radii.
Touch touch_of_sides(const EdgePoint& edge, const LevelSet& host, const Pose& host_pose,
                     const Pose& guest_pose) {
  const Pose in_host = in_space_of(host_pose, guest_pose);
  const auto across = [](const Vec3& v) { return Vec3(v.x(), 0, v.z()); };
  Vec3 x = in_host.to_world(edge.place);
  const Vec3 along = in_host.orientation * Vec3::UnitY(), along_across = across(along);
  const double farthest = edge.radius + host.radius;
  if (const double squared = along_across.squaredNorm(); squared > parallel)
    x += std::clamp(-across(x).dot(along_across) / squared, -farthest, farthest) * along;
  const Vec3 out = across(x);
  const double distance = out.norm();
  const Vec3 normal = distance > 0 ? Vec3(out / distance) : edge.normal;
  return {host_pose.to_world(x - edge.radius * normal), host_pose.orientation * normal,
          distance - host.radius - edge.radius};
}

// Returns the touch of a place on the axis of a guest with a round side. On a face of the host the plane
// stays where it was found, also if the place has gone a little beyond the end of the face; around an edge of
// the host it turns.
Touch touch_of_side(const EdgePoint& edge, const LevelSet& host, const Pose& host_pose, const LevelSet& guest,
                    const Pose& guest_pose) {
  const Vec3 axis = guest_pose.orientation * Vec3::UnitY(), x = guest_pose.to_world(edge.place);
  const auto across = [&](const Vec3& v) { return Vec3(v - v.dot(axis) * axis); };
  const SignedDistance now = host.exact(host_pose.to_body(x));
  const Vec3 normal = host_pose.orientation * edge.normal, plane = across(normal),
             out = across(now.distance * (host_pose.orientation * now.normal));
  const double distance = out.norm(), length = plane.norm();
  if (now.distance > 0 && distance > 0 && plane.cross(out).norm() > turned * length * distance)
    return {x - edge.radius / distance * out, out / distance, distance - edge.radius};
  if (guest.kind == LevelSet::Kind::capsule) return touch_at(edge, host_pose, guest_pose);
  return {x - edge.radius / length * plane, normal,
          normal.dot(x - host_pose.to_world(edge.foot)) - length * edge.radius};
}

// Returns the touch of an arc of a guest's ring, at the place that is nearest to the host with these poses.
Touch touch_of_arc(const EdgePoint& arc, const LevelSet& host, const Pose& host_pose,
                   const Pose& guest_pose) {
  const RingPlace nearest = place_on_arc(arc_of(arc), in_space_of(host_pose, guest_pose), host);
  return {host_pose.to_world(nearest.center - arc.radius * nearest.normal),
          host_pose.orientation * nearest.normal, nearest.distance - arc.radius};
}

// Returns the touch of a ball with an arc of a host's ring. The ball is the guest, so that the arm on which
// an impulse acts leads to its center.
Touch touch_of_ball_on_arc(const EdgePoint& arc, const Pose& host_pose, const LevelSet& ball,
                           const Pose& ball_pose) {
  const RingPlace nearest = place_on_arc(arc_of(arc), in_space_of(ball_pose, host_pose), ball);
  const Vec3 normal = ball_pose.orientation * -nearest.normal;
  return {ball_pose.position - ball.radius * normal, normal, nearest.distance - arc.radius};
}

// Returns the touch of an edge contact of a rigid guest.
Touch touch_at_edge(const EdgePoint& edge, const LevelSet& host, const Pose& host_pose, const LevelSet& guest,
                    const Pose& guest_pose) {
  if (is_arc(edge))
    return guest.kind == LevelSet::Kind::sphere ? touch_of_ball_on_arc(edge, host_pose, guest, guest_pose)
                                                : touch_of_arc(edge, host, host_pose, guest_pose);
  if (!(edge.radius > 0 && has_round_side(guest))) return touch_at(edge, host_pose, guest_pose);
  if (has_round_side(host) && std::abs(edge.normal.y()) < side_slope)
    return touch_of_sides(edge, host, host_pose, guest_pose);
  return touch_of_side(edge, host, host_pose, guest, guest_pose);
}

// Returns the touch of support point k of a guest against the plane of `edge`, one of several faces of a
// mesh.
Touch touch_of_face(const EdgePoint& edge, const Pose& host_pose, const LevelSet& guest,
                    const Pose& guest_pose, int k) {
  const Vec3 normal = host_pose.orientation * edge.normal;
  const ShapeSupportPoint support = support_point(guest, k, guest_pose.orientation.conjugate() * normal);
  const Vec3 x = guest_pose.to_world(support.position);
  return {x, normal, normal.dot(x - host_pose.to_world(edge.foot))};
}

// Returns the touch of a point at `x` (m, host's shape space) against `plane`. Its gap is infinite if it is
// beside an edge.
Touch in_world(const Vec3& x, const ContactPlane& plane, const Pose& host_pose) {
  return {host_pose.to_world(x), host_pose.orientation * plane.normal,
          plane.faces || plane.gap < 0 ? plane.gap : std::numeric_limits<double>::infinity()};
}

// Returns the touch of support point k of a guest towards the plane through `foot` (m, world) with the unit
// normal `normal`. The plane goes on from the host, whose smallest size is `size` (m), as the surface of the
// body `other`. The gap is infinite if the point is beside that surface.
Touch touch_of_continued(const Bodies& bodies, const Vec3& normal, const Vec3& foot, double size, int other,
                         const Pose& guest_pose, const LevelSet& guest, int k) {
  constexpr double near = 1e-3;  // greatest distance of its foot beside the surface, relative to `size`
  const ShapeSupportPoint support = support_point(guest, k, guest_pose.orientation.conjugate() * normal);
  const Vec3 x = guest_pose.to_world(support.position);
  const double gap = normal.dot(x - foot);
  const LevelSet& shape = bodies.rigid.properties[as_index(other)].shape;
  const double beside = shape.distance(shape_pose(bodies.rigid, as_index(other)).to_body(x - gap * normal));
  if (std::abs(beside) > near * size) return {x, normal, std::numeric_limits<double>::infinity()};
  return {x, normal, gap};
}

// Returns the adjoining body that goes on with the host's plane below support point k of the guest; -1 if the
// point is over the host, or over none of them. `found` is the touch with the host. When a rim has rolled
// almost onto the host, its point nearest to the host is on the other side of the internal edge from its
// support point towards the plane, and goes down as the rim rolls on.
int body_below_support_point(const Bodies& bodies, int host, const Touch& found, const Pose& guest_pose,
                             const LevelSet& guest, int k) {
  if (bodies.adjoining.first.empty() || !std::isfinite(found.gap)) return -1;
  const auto others = bodies.adjoining.of(host);
  if (others.begin() == others.end()) return -1;
  const Vec3 x = guest_pose.to_world(
      support_point(guest, k, guest_pose.orientation.conjugate() * found.normal).position);
  const Vec3 foot = found.position - found.gap * found.normal;
  const Vec3 below = x - found.normal.dot(x - foot) * found.normal;
  const auto above = [&](int body) {  // signed distance of `below` from the body, m
    return bodies.rigid.properties[as_index(body)].shape.distance(
        shape_pose(bodies.rigid, as_index(body)).to_body(below));
  };
  const double nothing = no_distance * bodies.rigid.properties[as_index(host)].shape.min_size();
  if (above(host) <= nothing) return -1;
  const auto other =
      std::find_if(others.begin(), others.end(), [&](int body) { return std::abs(above(body)) <= nothing; });
  return other == others.end() ? -1 : *other;
}

// Returns the touch of the support point `point` of a ball with a plane: the place right above the plane. The
// support point is that towards the surface nearest to the center, whose normal differs by some degrees
// beside the edges of a mesh. An impulse along the plane's normal would then turn a ball without friction. If
// it differs by more, the plane is that of another side.
Touch of_ball_in_world(const ShapeSupportPoint& point, ContactPlane plane, const Pose& host_pose) {
  constexpr double one_side = 0.98;  // least cosine of the angle: 11 degrees
  const double radius = (point.position - point.inside).norm();
  if (plane.normal.dot(point.inside - point.position) < one_side * radius)
    return in_world(point.position, plane, host_pose);
  const Vec3 x = point.inside - radius * plane.normal;
  plane.gap += plane.normal.dot(x - point.position);
  return in_world(x, plane, host_pose);
}

// Returns whether `feature` of a guest is the support point of a ball.
bool is_of_ball(const RigidProperties& guest, const FeatureId& feature) {
  return feature.is_support() && guest.shape.kind == LevelSet::Kind::sphere;
}

}  // namespace

Touch touch(const RigidProperties& host, const Pose& host_pose, const RigidProperties& guest,
            const Pose& guest_pose, const FeatureId& feature, const EdgePoint& edge) {
  if (feature.uses_edge_point()) return touch_at_edge(edge, host.shape, host_pose, guest.shape, guest_pose);
  if (feature.is_support() && !edge.normal.isZero(0))
    return touch_of_face(edge, host_pose, guest.shape, guest_pose, feature.index);
  const ShapeSupportPoint point = in_space_of(host, host_pose, guest, guest_pose, feature);
  const ContactPlane plane = contact_plane(host.shape, point.position, point.inside);
  return is_of_ball(guest, feature) ? of_ball_in_world(point, plane, host_pose)
                                    : in_world(point.position, plane, host_pose);
}

Touch touch(const Bodies& bodies, int host, const Pose& host_pose, int guest, const Pose& guest_pose,
            const FeatureId& feature, const EdgePoint& edge) {
  const std::vector<RigidProperties>& properties = bodies.rigid.properties;
  if (feature.uses_edge_point() || (feature.is_support() && !edge.normal.isZero(0)))
    return touch(properties[as_index(host)], host_pose, properties[as_index(guest)], guest_pose, feature,
                 edge);
  const ShapeSupportPoint point =
      in_space_of(properties[as_index(host)], host_pose, properties[as_index(guest)], guest_pose, feature);
  const ContactPlane plane = exposed_plane(bodies, host, host_pose, point.position, point.inside,
                                           feature.is_support() ? PointKind::support : PointKind::fixed);
  const bool is_ball = is_of_ball(properties[as_index(guest)], feature);
  const Touch found =
      is_ball ? of_ball_in_world(point, plane, host_pose) : in_world(point.position, plane, host_pose);
  if (!feature.is_support()) return found;
  const LevelSet& shape = properties[as_index(guest)].shape;
  const int k = feature.index,
            other = plane.continued_by >= 0
                        ? plane.continued_by
                        : body_below_support_point(bodies, host, found, guest_pose, shape, k);
  if (other < 0) return found;
  const double size = properties[as_index(host)].shape.min_size();
  return touch_of_continued(bodies, found.normal, host_pose.to_world(plane.foot), size, other, guest_pose,
                            shape, k);
}

namespace {

// Returns the touch of a deformable guest's surface point at `x` (m, world) with the nearest surface of the
// host that it can touch.
Touch touch(const Bodies& bodies, int host, const Pose& host_pose, const SurfacePoint& point, const Vec3& x) {
  const LevelSet& shape = bodies.rigid.properties[as_index(host)].shape;
  const Vec3 in_host = host_pose.to_body(x);
  const NearestSurface nearest{in_host, shape.distance(in_host), shape.normal(in_host)};
  Exit way{host_pose.orientation * nearest.normal, -nearest.distance};
  if (const auto hidden = hidden_foot(bodies, host, x + way.depth * way.normal, way.normal))
    way = exit_from_union(bodies, host, x, inward_direction(bodies, point), way, *hidden);
  else
    way = faced_exit(bodies, host, host_pose, point, x, nearest);
  return {x, way.normal, point.contact_offset - way.depth};
}

// Returns the touch of a contact whose plane is that of a deformable guest's face. Its normal is the one of
// the face's two that is nearer to `outward` (unit, world). The host touches it with its present support
// point, or with EdgePoint::foot.
Touch touch_on_face(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose,
                    const Vec3& outward, const Vec3& x) {
  const std::array<int, 4>& p = contact.on_surface.particle;
  const auto at = [&](std::size_t i) -> const Vec3& { return bodies.particles.x[as_index(p[i])]; };
  const Vec3 area = (at(1) - at(0)).cross(at(2) - at(0));
  const double length = area.norm();
  Vec3 normal = length > 0 ? Vec3(area / length) : outward;
  if (normal.dot(outward) < 0) normal = -normal;
  Vec3 foot = contact.edge.foot;
  if (contact.plane_frame.support_point >= 0)
    foot = support_point(bodies.rigid.properties[as_index(contact.host)].shape,
                         contact.plane_frame.support_point, host_pose.orientation.conjugate() * -normal)
               .position;
  foot = host_pose.to_world(foot);
  return {x, normal, normal.dot(x - foot), foot};
}

// Returns the touch of a place on a deformable guest's edge with a round host. The normal is at right angles
// to the edge. The gap is that of the place on the line of the edge that is nearest to the ball about the
// middle of the host there: a host that rolls moves it away from the place.
Touch touch_on_edge(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose, const Vec3& x) {
  const LevelSet& shape = bodies.rigid.properties[as_index(contact.host)].shape;
  const std::array<int, 4>& p = contact.on_surface.particle;
  const Vec3 along = (bodies.particles.x[as_index(p[1])] - bodies.particles.x[as_index(p[0])]).normalized();
  const Vec3 in_host = host_pose.to_body(x), nearest = host_pose.orientation * shape.normal(in_host);
  const Vec3 across = nearest - nearest.dot(along) * along;
  const double length = across.norm();
  const double radius = radius_of_ball(shape), to_middle = shape.distance(in_host) + radius;
  return {x, length > 0 ? Vec3(across / length) : nearest, to_middle * length - radius,
          x - to_middle * nearest};
}

// Returns the touch of a contact on an edge or a face of a deformable guest, with the place at `x` (m,
// world).
Touch touch_on_plane(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose,
                     const Vec3& x) {
  const Vec3 normal = host_pose.orientation * contact.edge.normal;
  switch (contact.plane_frame.kind) {
    case PlaneFrame::Kind::face:
      return touch_on_face(bodies, contact, host_pose, normal, x);
    case PlaneFrame::Kind::edge:
      return touch_on_edge(bodies, contact, host_pose, x);
    case PlaneFrame::Kind::host:
      break;
  }
  return {x, normal, normal.dot(x - host_pose.to_world(contact.edge.foot))};
}

}  // namespace

Touch touch(const Bodies& bodies, const ContactPoint& contact, const Pose& host_pose, const Vec3& x) {
  const SurfacePoint& point = surface_point(bodies, contact);
  Touch found = contact.is_on_edge() ? touch_on_plane(bodies, contact, host_pose, x)
                                     : touch(bodies, contact.host, host_pose, point, x);
  found.gap += contact.is_on_edge() ? point.contact_offset + contact.yielded : contact.yielded;
  return found;
}

void put_on_surface(const Bodies& bodies, ContactPoint& contact) {
  SurfacePoint& point = contact.on_surface = SurfacePoint();
  point.count = 0;
  const auto add = [&](int particle) {
    const auto i = as_index(point.count++);
    point.particle[i] = particle;
    point.weight[i] = contact.edge.weight[i];
    point.inverse_mass +=
        point.weight[i] * point.weight[i] * bodies.particles.inverse_mass[as_index(particle)];
  };
  if (contact.feature.kind == FeatureId::Kind::edge) {
    const BoundaryEdge& edge = bodies.edges[as_index(contact.feature.index)];
    for (const int particle : edge.particle) add(particle);
    point.contact_offset = edge.contact_offset;
  } else {
    for (const int particle : bodies.triangles[static_cast<std::size_t>(contact.edge.face)]) add(particle);
    point.contact_offset = -bodies.deformable[as_index(contact.feature.sub)].thickness / 2;
  }
}

Touch touch(const Bodies& bodies, const ContactPoint& contact) {
  const Pose pose = shape_pose(bodies.rigid, as_index(contact.host));
  if (contact.is_rigid_pair())
    return touch(bodies, contact.host, pose, contact.guest_rigid,
                 shape_pose(bodies.rigid, as_index(contact.guest_rigid)), contact.feature, contact.edge);
  return touch(bodies, contact, pose, weighted(surface_point(bodies, contact), bodies.particles.x));
}

Touch predicted_touch(const Bodies& bodies, const std::vector<Pose>& predicted, double dt,
                      const ContactPoint& contact, const Vec3& shift) {
  const Pose& pose = predicted[as_index(contact.host)];
  if (contact.is_rigid_pair())
    return touch(bodies, contact.host, pose, contact.guest_rigid, predicted[as_index(contact.guest_rigid)],
                 contact.feature, contact.edge);
  const SurfacePoint& point = surface_point(bodies, contact);
  const Vec3 x = weighted(point, bodies.particles.x) + dt * weighted(point, bodies.particles.v) + shift;
  return touch(bodies, contact, pose, x);
}

double delayed_gap(const Bodies& bodies, const ContactPoint& contact) {
  const RigidState &host = bodies.rigid.state[as_index(contact.host)],
                   &guest = bodies.rigid.state[as_index(contact.guest_rigid)];
  return contact.gap + contact.normal.dot(guest.delay - host.delay);
}

double gap_now(const Bodies& bodies, const ContactPoint& contact) { return touch(bodies, contact).gap; }

namespace {

// Moves a point on a face to the place nearest to `x` (m, world) in the face's plane, also beyond the rim of
// the face.
void move_on_face(const Bodies& bodies, const Vec3& x, SurfacePoint& point) {
  const auto at = [&](std::size_t i) -> const Vec3& {
    return bodies.particles.x[as_index(point.particle[i])];
  };
  const Vec3 area = (at(1) - at(0)).cross(at(2) - at(0));
  const double squared = area.squaredNorm();
  if (!(squared > 0)) return;
  point.weight[0] = area.dot((at(1) - x).cross(at(2) - x)) / squared;
  point.weight[1] = area.dot((at(2) - x).cross(at(0) - x)) / squared;
  point.weight[2] = 1 - point.weight[0] - point.weight[1];
}

// Moves contacts with the faces and edges of a deformable body along with the host. At a place that stays
// behind they would turn the host.
void follow_host(const Bodies& bodies, ContactPoint& contact) {
  if (contact.plane_frame.kind == PlaneFrame::Kind::host) return;
  SurfacePoint& point = contact.on_surface;
  const Pose pose = shape_pose(bodies.rigid, as_index(contact.host));
  const Touch now = touch(bodies, contact, pose, weighted(point, bodies.particles.x));
  if (contact.plane_frame.kind == PlaneFrame::Kind::face) {
    move_on_face(bodies, now.foot, point);
  } else {
    const Vec3 &first = bodies.particles.x[as_index(point.particle[0])],
               &second = bodies.particles.x[as_index(point.particle[1])];
    const Vec3 edge = second - first;
    if (!(edge.squaredNorm() > 0)) return;
    point.weight[1] = edge.dot(now.foot - first) / edge.squaredNorm();
    point.weight[0] = 1 - point.weight[1];
  }
  // The next step begins with this place and plane, from the contact cache.
  contact.edge.normal = pose.orientation.conjugate() * now.normal;
  const LevelSet& shape = bodies.rigid.properties[as_index(contact.host)].shape;
  const double to_surface = contact.plane_frame.kind == PlaneFrame::Kind::edge ? radius_of_ball(shape) : 0;
  contact.edge.foot = pose.to_body(now.foot + to_surface * now.normal);
  std::copy_n(point.weight.begin(), 3, contact.edge.weight.begin());
  point.inverse_mass = 0;
  for (std::size_t i = 0; i < as_index(point.count); ++i)
    point.inverse_mass +=
        point.weight[i] * point.weight[i] * bodies.particles.inverse_mass[as_index(point.particle[i])];
}

// Sets what update_geometry() recomputes from the touch of the contact at the present positions.
[[gnu::always_inline]] inline void take_touch(const Bodies& bodies, const Touch& now, ContactPoint& contact) {
  const auto host = as_index(contact.host);
  const RigidState& host_state = bodies.rigid.state[host];
  const RigidProperties& host_properties = bodies.rigid.properties[host];
  const Vec3& x = now.position;
  contact.meets_ahead = contact.is_level_ahead = contact.stays = false;
  contact.normal = now.normal;
  contact.gap = now.gap;
  contact.host_arm = x - host_state.pose.position;
  Mat3 K = Mat3::Zero();
  if (moves_host(bodies, contact))
    K = impulse_factor(host_state, host_properties.inverse_mass, contact.host_arm);
  if (contact.is_rigid_pair()) {
    const auto guest = as_index(contact.guest_rigid);
    contact.guest_arm = x - bodies.rigid.state[guest].pose.position;
    K += impulse_factor(bodies.rigid.state[guest], bodies.rigid.properties[guest].inverse_mass,
                        contact.guest_arm);
  } else {
    K.diagonal().array() += surface_point(bodies, contact).inverse_mass;
  }
  contact.response = ContactResponse(K, contact.normal);
  contact.path_velocity.setZero();
}

bool are_equal(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

// It runs three times a step for every contact. What it calls becomes part of it, so that touches and
// responses are not written to memory on their way.
[[gnu::flatten]] void update_geometry(const Bodies& bodies, ContactPoint& contact) {
  follow_host(bodies, contact);
  take_touch(bodies, touch(bodies, contact), contact);
}

void update_geometry(const Bodies& bodies, const Touch& now, ContactPoint& contact) {
  take_touch(bodies, now, contact);
}

void MeasuredTouches::keep(const Bodies& bodies) {
  x = bodies.particles.x;
  pose.resize(bodies.rigid.size());
  for (std::size_t i = 0; i < pose.size(); ++i) pose[i] = bodies.rigid.state[i].pose;
}

bool MeasuredTouches::hold(const Bodies& bodies, std::size_t contacts) const {
  if (touch.size() != contacts || pose.size() != bodies.rigid.size() || x != bodies.particles.x) return false;
  for (std::size_t i = 0; i < pose.size(); ++i)
    if (!are_equal(pose[i], bodies.rigid.state[i].pose)) return false;
  return true;
}

}  // namespace duet
