#include "sim/contact/detection/internal_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/elementary.h"
#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/friction_fade.h"

namespace duet {
namespace {

// Distance outside of bodies at which a point has left them, relative to their smallest size.
constexpr double left_within = adjoin_within;
constexpr double
    // Greatest cosine of the angle between the normals of faces that hide each other: 120 degrees.
    face_each_other = -0.5,
    // Least cosine of the angle between the normals of one face: rounding.
    one_face = 1 - 1e-9,
    // Least sine of the angle at which the adjoining body's normal leads off the host's surface.
    leads_off = 0.3;
// Longest exit, relative to the smallest size of the host and its adjoining bodies. A larger value would let
// a point leave small bodies on the far side.
constexpr double longest_joint_exit = 0.5;
constexpr int exit_bisections = 20;  // of the length of an exit: it is known to a millionth

// Number of directions that are evenly spread over a sphere.
constexpr int directions = 400;
// Least fraction of a small ball about a point that is inside of bodies if the point is on a flat face, or
// almost: half of the ball, less what 400 directions and faces that are not quite flat leave.
constexpr double half_inside = 0.47;
// Returns direction number `i` (unit): a spiral with the golden angle.
Vec3 direction(int i) {
  const double z = 1 - (2 * i + 1.0) / directions, angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {std::sqrt(1 - z * z) * math::cos(angle), std::sqrt(1 - z * z) * math::sin(angle), z};
}

// The body that is nearest to a point.
struct NearestBody {
  int body = -1;
  double distance = std::numeric_limits<double>::infinity();  // m: signed distance from it
};

// Returns the signed distance of `x` (m, world) from a rigid body, m.
double distance_to(const RigidBodies& rigid, int body, const Vec3& x) {
  const auto b = as_index(body);
  return rigid.properties[b].shape.distance(shape_pose(rigid, b).to_body(x));
}

// Returns the normal (unit, world) of a rigid body's surface nearest to `x` (m, world).
Vec3 normal_of(const RigidBodies& rigid, int body, const Vec3& x) {
  const auto b = as_index(body);
  const Pose pose = shape_pose(rigid, b);
  return pose.orientation * rigid.properties[b].shape.normal(pose.to_body(x));
}

// Returns the least of the smallest sizes of the host and its adjoining bodies, m. The adjoining ones count
// because the ground has no size of its own.
double smallest_size(const Bodies& bodies, int host) {
  double size = bodies.rigid.properties[as_index(host)].shape.min_size();
  for (const int other : bodies.adjoining.of(host))
    size = std::min(size, bodies.rigid.properties[as_index(other)].shape.min_size());
  return size;
}

// Returns which of the host and its adjoining bodies is nearest to `x` (m, world).
NearestBody nearest(const Bodies& bodies, int host, const Vec3& x) {
  NearestBody result{host, distance_to(bodies.rigid, host, x)};
  for (const int other : bodies.adjoining.of(host)) {
    const double distance = distance_to(bodies.rigid, other, x);
    if (distance < result.distance) result = {other, distance};
  }
  return result;
}

// Returns the normal of the surface below `exit` (m, world), which is `normal` at the nearest place of the
// body `left`. If that place is an edge beside a gap, the surface goes on to the body on the other side: with
// the displacement t from the edge to that body's nearest place, the result is n - (n . t) t / t^2,
// normalized. The direction from one of the edges would lean by any angle over a gap however narrow. The
// other body is at most `beyond` (m) farther away.
Vec3 normal_over_gap(const Bodies& bodies, int host, const Vec3& exit, const NearestBody& left,
                     const Vec3& normal, double beyond) {
  const auto over_gap_to = [&](int other) -> std::optional<Vec3> {
    if (other == left.body) return std::nullopt;
    const double distance = distance_to(bodies.rigid, other, exit);
    if (distance > left.distance + beyond) return std::nullopt;
    const Vec3 foot = exit - distance * normal_of(bodies.rigid, other, exit);
    const Vec3 gap = foot - (exit - left.distance * normal);
    if (!(normal.dot(gap) > 0)) return std::nullopt;
    // Beside a face, unlike beside an edge, the normal is the same a little farther away from the gap.
    if (normal_of(bodies.rigid, left.body, exit - gap).dot(normal) > one_face) return std::nullopt;
    const Vec3 level = normal - normal.dot(gap) / gap.squaredNorm() * gap;
    return level.norm() > leads_off ? std::optional<Vec3>(level.normalized()) : std::nullopt;
  };
  if (const std::optional<Vec3> level = over_gap_to(host)) return *level;
  for (const int other : bodies.adjoining.of(host))
    if (const std::optional<Vec3> level = over_gap_to(other)) return *level;
  return normal;
}

// Returns whether a point at `x` (m, world) outside is above the surface of the exit `way`. That surface may
// be the host's or an adjoining body's, from which the point may slide onto the host within the step.
bool is_over(const Bodies& bodies, int host, const Vec3& x, const Exit& way) {
  return nearest(bodies, host, x + way.depth * way.normal).distance <=
         left_within * smallest_size(bodies, host);
}

// Returns for each node of the feature edges of a static body whether it stays. stays(x) says so for a node
// of a sharp edge and for a convex vertex at `x` (m, world). A node of a center line is inside of its body.
// It goes where the ball that sweeps along the line is inside of an adjoining body.
template <class Stays>
std::vector<char> exposed_nodes(const Bodies& bodies, int body, Stays&& stays) {
  const RigidProperties& properties = bodies.rigid.properties[as_index(body)];
  const FeatureEdges& feature_edges = properties.feature_edges;
  std::vector<double> radius(feature_edges.nodes.size(), 0.0);  // m, of the ball
  for (const FeatureEdges::Line& line : feature_edges.lines)
    for (int i = line.begin; i < line.end; ++i) radius[as_index(i)] = line.radius;
  const double near = left_within * properties.shape.min_size();
  std::vector<char> result;
  for (std::size_t i = 0; i < radius.size(); ++i) {
    const Vec3 x = shape_pose(bodies.rigid, as_index(body)).to_world(feature_edges.nodes[i]);
    const auto others = bodies.adjoining.of(body);
    const auto contains = [&](int other) { return distance_to(bodies.rigid, other, x) <= near - radius[i]; };
    result.push_back(radius[i] > 0 ? std::none_of(others.begin(), others.end(), contains) : stays(x));
  }
  return result;
}

}  // namespace

ElementLists adjoining_bodies(const Bodies& bodies) {
  std::vector<BodyBounds> bounds;
  bound_bodies(bodies, bounds);
  bounds.resize(bodies.rigid.size());
  ElementLists lists;
  lists.first.push_back(0);
  for (std::size_t a = 0; a < bounds.size(); ++a) {
    for (std::size_t b = 0; bounds[a].is_static && b < bounds.size(); ++b) {
      if (b == a || !bounds[b].is_static) continue;
      if (separation(bounds[a], bounds[b]) <=
          left_within * std::min(bounds[a].thickness, bounds[b].thickness))
        lists.items.push_back(static_cast<int>(b));
    }
    lists.first.push_back(static_cast<int>(lists.items.size()));
  }
  return lists;
}

void remove_hidden_samples(Bodies& bodies) {
  for (std::size_t b = 0; b < bodies.rigid.size(); ++b) {
    const int body = static_cast<int>(b);
    RigidProperties& properties = bodies.rigid.properties[b];
    const Pose pose = shape_pose(bodies.rigid, b);
    const double near = left_within * properties.shape.min_size();
    // A node or sample stays if no other body adjoins it, or if most of a small ball about it is outside of
    // all bodies, as at a convex edge. About a point of a face half of the ball is.
    const auto stays = [&](const Vec3& x) {
      const auto others = bodies.adjoining.of(body);
      if (std::none_of(others.begin(), others.end(),
                       [&](int other) { return distance_to(bodies.rigid, other, x) <= near; }))
        return true;
      int inside = 0;
      for (int i = 0; i < directions; ++i)
        if (nearest(bodies, body, x + 10 * near * direction(i)).distance < 0) ++inside;
      return inside < half_inside * directions;
    };
    std::size_t kept = 0;
    for (std::size_t i = 0; i < properties.samples.size(); ++i) {
      if (!stays(pose.to_world(properties.samples[i]))) continue;
      properties.samples[kept] = properties.samples[i];
      properties.on_flat[kept] = properties.on_flat[i];
      if (properties.round) properties.on_round[kept] = properties.on_round[i];
      properties.inside[kept++] = properties.inside[i];
    }
    properties.samples.resize(kept);
    properties.inside.resize(kept);
    properties.on_flat.resize(kept);
    if (properties.round) properties.on_round.resize(kept);
    keep_nodes(exposed_nodes(bodies, body, stays), properties.feature_edges);
  }
}

std::optional<HiddenFoot> hidden_foot(const Bodies& bodies, int host, const Vec3& foot, const Vec3& normal) {
  if (bodies.adjoining.first.empty()) return {};
  for (const int other : bodies.adjoining.of(host)) {
    const double near = left_within * std::min(bodies.rigid.properties[as_index(host)].shape.min_size(),
                                               bodies.rigid.properties[as_index(other)].shape.min_size());
    const double distance = distance_to(bodies.rigid, other, foot);
    if (distance > near) continue;
    if (distance < -near) return HiddenFoot{foot, Vec3::Zero(), other};
    // The foot is on the surfaces of both bodies. A host that rises from the other's surface, as a riser
    // does, is not hidden. The other's normal is taken a little above the foot, from a start on the other's
    // surface: beside an edge of the other body, points above the foot would be nearest to that edge, with
    // normals of all directions.
    const Vec3 start = distance > 0 ? Vec3(foot - distance * normal_of(bodies.rigid, other, foot)) : foot;
    const Vec3 others_normal = normal_of(bodies.rigid, other, start + near * normal);
    const double cosine = others_normal.dot(normal);
    if (cosine < face_each_other) return HiddenFoot{foot, Vec3::Zero(), other};
    if (cosine < one_face &&
        distance_to(bodies.rigid, host, foot + 2 * near * others_normal) > leads_off * 2 * near)
      return HiddenFoot{foot, others_normal, other};
  }
  return {};
}

bool is_at_internal_edge(const Bodies& bodies, int host, const Vec3& foot, double precision) {
  if (bodies.adjoining.first.empty()) return false;
  for (const int other : bodies.adjoining.of(host))
    if (distance_to(bodies.rigid, other, foot) - precision <=
        left_within * std::min(bodies.rigid.properties[as_index(host)].shape.min_size(),
                               bodies.rigid.properties[as_index(other)].shape.min_size()))
      return true;
  return false;
}

double united_distance(const Bodies& bodies, int body, const Pose& pose, const Vec3& x) {
  double distance = bodies.rigid.properties[as_index(body)].shape.exact(pose.to_body(x)).distance;
  if (bodies.adjoining.first.empty()) return distance;
  for (const int other : bodies.adjoining.of(body)) {
    const auto b = as_index(other);
    const Vec3 there = shape_pose(bodies.rigid, b).to_body(x);
    distance = std::min(distance, bodies.rigid.properties[b].shape.exact(there).distance);
  }
  return distance;
}

Exit exit_from_union(const Bodies& bodies, int host, const Vec3& x, const Vec3& inward, const Exit& way,
                     const HiddenFoot& hidden) {
  const double size = smallest_size(bodies, host);
  const double beyond = left_within * size;
  if (way.depth < -beyond) {
    if (hidden.others_normal.isZero()) return {way.normal, -std::numeric_limits<double>::infinity()};
    return {hidden.others_normal, (hidden.foot - x).dot(hidden.others_normal)};
  }
  const auto is_out = [&](double length) {
    return nearest(bodies, host, x + length * inward).distance >= beyond;
  };
  double in = 0, out = beyond;  // m
  for (; !is_out(out); out *= 2) {
    if (inward.isZero() || out > longest_joint_exit * size) return way;
    in = out;
  }
  for (int i = 0; i < exit_bisections; ++i) {
    const double middle = 0.5 * (in + out);
    (is_out(middle) ? out : in) = middle;
  }
  const Vec3 exit = x + out * inward;
  const NearestBody left = nearest(bodies, host, exit);
  const Vec3 edge_normal = normal_of(bodies.rigid, left.body, exit);
  const Vec3 foot = exit - left.distance * edge_normal;
  const Vec3 normal = normal_over_gap(bodies, host, exit, left, edge_normal, beyond);
  return {normal, (foot - x).dot(normal)};
}

ContactPlane exposed_plane(const Bodies& bodies, int host, const Pose& pose, const Vec3& x,
                           const Vec3& inside, PointKind kind) {
  const LevelSet& shape = bodies.rigid.properties[as_index(host)].shape;
  ContactPlane plane = contact_plane(shape, x, inside);
  // Between the nodes of its grid the surface of a mesh is not known precisely enough to tell whether a foot
  // is at an internal edge. So the exact plane counts there.
  if (shape.kind == LevelSet::Kind::grid &&
      is_at_internal_edge(bodies, host, pose.to_world(plane.foot), shape.tolerance()))
    plane = exact_contact_plane(shape, x, inside);
  const Vec3 normal = pose.orientation * plane.normal, position = pose.to_world(x);
  const std::optional<HiddenFoot> hidden = hidden_foot(bodies, host, pose.to_world(plane.foot), normal);
  if (!hidden) return plane;
  if (kind == PointKind::support && !hidden->others_normal.isZero(0)) {
    plane.normal = pose.orientation.conjugate() * hidden->others_normal;
    plane.gap = std::numeric_limits<double>::infinity();
    plane.continued_by = hidden->body;
    return plane;
  }
  const Vec3 inward = pose.orientation * (inside - x).normalized();
  const Exit way = exit_from_union(bodies, host, position, inward, {normal, -plane.gap}, *hidden);
  plane.normal = pose.orientation.conjugate() * way.normal;
  plane.gap = -way.depth;
  if (plane.gap >= 0 && std::isfinite(plane.gap) && inside != x)
    plane.faces = faces(way.normal, inward) && is_over(bodies, host, position, way);
  return plane;
}

}  // namespace duet
