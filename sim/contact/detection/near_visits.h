// Visits the points, edges and faces of a guest that are near a rigid body at the present positions, for the
// searches of contact candidates and for measurements of overlap.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>

#include "sim/contact/detection/contact_point.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/contact/detection/support_face_contacts.h"

namespace duet {

/// Returns a pair of rigid bodies with the roles of host and guest swapped.
inline BodyPair reversed(const BodyPair& pair) { return {pair.guest_rigid, pair.host, -1}; }

/// Returns the pose of the shape of the pair's rigid guest in the shape space of its host.
Pose in_host_of(const RigidBodies& rigid, const BodyPair& pair);

/// Appends the edge contacts of the pair's rigid guest with its host whose distance is less than `margin`
/// (m). `direction` is that of the pair. Places at internal edges, and places on the side of a cylinder where
/// contacts of its axis act, are left out.
void find_feature_edges(const Bodies& bodies, const BodyPair& pair, PairDirection direction, double margin,
                        std::vector<EdgeContact>& found);

/// Returns whether forces move neither a point of a deformable body, because all of its particles are held,
/// nor the rigid body `host`. Their contact could do nothing.
bool neither_moves(const Bodies& bodies, const SurfacePoint& point, std::size_t host);

/// Computes the positions of the surface points of the deformable bodies that occur in `pairs`, and divides
/// them into blocks with boxes. Sets `blocks`, `first_block` and `point` of `search`. In `pairs`, those with
/// one deformable body have to follow each other.
void place_points(const Bodies& bodies, const std::vector<BodyPair>& pairs, CandidateSearch& search);

/// A rigid body's level set at its present pose, with the rotation as a matrix, for loops that query it for
/// many points.
struct PosedHost {
  const LevelSet& shape;  ///< The level set, in shape space.
  Mat3 to_shape;          ///< Rotation from the world to shape space.
  Vec3 center;            ///< m, world: origin of shape space.
  Vec3 lower,             ///< m, shape space: lower corner of a box; points outside are beyond the margin.
      upper;              ///< m, shape space: upper corner of that box.

  /// Poses the level set of a body, whose shape is at `pose`, and grows its box by `margin` (m).
  PosedHost(const Pose& pose, const RigidProperties& properties, double margin)
      : shape(properties.shape),
        to_shape(pose.orientation.toRotationMatrix().transpose()),
        center(pose.position),
        lower(shape.lower().array() - margin),
        upper(shape.upper().array() + margin) {
    if (shape.kind == LevelSet::Kind::half_space) upper.y() = margin;
  }
  /// Returns the box around all points nearer than the margin in a guest's shape space. `rotation` and
  /// `offset` (m) take that to the host's shape space: y = rotation x + offset. The box is infinite for half
  /// spaces.
  Eigen::AlignedBox3d region(const Mat3& rotation, const Vec3& offset) const {
    if (shape.kind == LevelSet::Kind::half_space) {
      const Vec3 everywhere = Vec3::Constant(std::numeric_limits<double>::infinity());
      return {-everywhere, everywhere};
    }
    const Vec3 middle = rotation.transpose() * ((lower + upper) / 2 - offset);
    const Vec3 half = rotation.transpose().cwiseAbs() * ((upper - lower) / 2);
    return {middle - half, middle + half};
  }
  /// Returns the box between `lower` and `upper`, m.
  Eigen::AlignedBox3d box() const { return {lower, upper}; }
  /// Returns whether `y` (m, shape space) lies in that box.
  bool is_near(const Vec3& y) const {
    return (y.array() >= lower.array()).all() && (y.array() <= upper.array()).all();
  }
  /// Returns whether a ball about `y` (m, shape space) with radius `reach` (m) meets that box.
  bool is_near(const Vec3& y, double reach) const {
    return (y.array() >= lower.array() - reach).all() && (y.array() <= upper.array() + reach).all();
  }
};

/// Calls visit(near, inside) for the lowest vertices of the guest's round patches whose distance from the
/// host is less than `margin` (m), and for vertices that are level with one of them. `in_host` is the pose of
/// the guest in the host's shape space.
template <class Visit>
void visit_patches(const RigidProperties& guest, const Pose& in_host, const PosedHost& host, double margin,
                   Visit&& visit) {
  const RoundSurface& round = *guest.round;
  const auto tell = [&](FeatureId feature, const RoundPlace& place) {
    visit(
        NearPoint{
            .feature = feature, .position = place.position, .gap = place.distance, .vertex = place.vertex},
        in_host.to_world(round.inside[as_index(place.vertex)]));
  };
  for (std::size_t i = 0; i < guest.samples.size(); ++i) {
    const int start = guest.on_round[i].patch;
    if (start < 0) continue;
    const double reach = round.reach[as_index(start)];
    const Vec3 y = in_host.to_world(round.vertices[as_index(start)]);
    if (!host.is_near(y, reach) || !(host.shape.distance(y) < margin + reach)) continue;
    const std::optional<RoundPlace> lowest = lowest_in_patch(round, start, in_host, host.shape);
    if (!lowest || !(lowest->distance < margin)) continue;
    tell({FeatureId::Kind::round, static_cast<int>(i), -1}, *lowest);
    visit_level_vertices(round, *lowest, in_host, host.shape, [&](const RoundPlace& place) {
      if (place.distance < margin) tell({FeatureId::Kind::vertex, place.vertex, -1}, place);
    });
  }
}

/// Where a sample lies that is between the vertices of round parts.
enum class BesideRound {
  above,   ///< Above the lowest vertex of one of these parts: the guest touches with that vertex instead.
  level,   ///< Level with the lowest vertices of all of these parts.
  between  ///< Above or level with some of them, and lower than others.
};

/// Returns where the sample `sample` of a guest lies, which is at `y` (m) with the distance `gap` (m) from
/// the host. `in_host` is the pose of the guest. Both are in the host's shape space.
BesideRound beside_round(const RigidProperties& guest, const RoundSample& sample, const Pose& in_host,
                         const LevelSet& host, const Vec3& y, double gap);

/// Calls visit(near, inside) for the support points and the samples of the pair's rigid guest whose distance
/// from the host is less than `margin` (m). Samples inside of edges and faces of round parts are left out
/// where they are not level with the lowest vertex: those are reached only as the body lies on a facet.
/// `near` is a NearPoint with number, position and gap; `inside` (m, host's shape space) is a point of the
/// guest some way in from it.
template <class Visit>
void visit_near(const RigidBodies& rigid, const BodyPair& pair, double margin, Visit&& visit) {
  const PosedHost host(shape_pose(rigid, as_index(pair.host)), rigid.properties[as_index(pair.host)], margin);
  const Pose pose = shape_pose(rigid, as_index(pair.guest_rigid));
  const RigidProperties& guest = rigid.properties[as_index(pair.guest_rigid)];
  const Vec3 offset = host.to_shape * (pose.position - host.center);
  const Pose in_host = in_host_of(rigid, pair);
  const bool are_left_out =
      is_left_to_ball(host.shape, guest.shape) || is_left_to_ring(guest.shape, in_host, host.shape);
  const int support_points = are_left_out ? 0 : support_point_count(guest.shape);
  for (int k = 0; k < support_points; ++k) {
    const ShapeSupportPoint support = support_point(guest.shape, k, in_host, host.shape);
    if (guest.shape.kind == LevelSet::Kind::torus && is_beside_side(host.shape, support.position)) continue;
    const double gap = host.shape.distance(support.position);
    if (gap < margin)
      visit(NearPoint{.feature = FeatureId::support(k), .position = support.position, .gap = gap},
            support.inside);
  }
  if (ignores_samples(host.shape, guest.shape)) return;
  const bool rolls = rolls_over_samples(host.shape);
  const Mat3 rotation = host.to_shape * pose.orientation.toRotationMatrix();
  const Eigen::AlignedBox3d region = host.region(rotation, offset);
  const bool has_patches = guest.round && !rolls;
  if (has_patches) visit_patches(guest, in_host, host, margin, visit);
  for (std::size_t i = 0; i < guest.samples.size(); ++i) {
    if (!region.contains(guest.samples[i]) || (rolls && guest.on_flat[i] != 0)) continue;
    if (has_patches && guest.on_round[i].patch >= 0) continue;
    const Vec3 y = rotation * guest.samples[i] + offset;
    if (!host.is_near(y) || is_beside_side(host.shape, y)) continue;
    const double gap = host.shape.distance(y);
    if (!(gap < margin)) continue;
    NearPoint near{.feature = FeatureId::point(static_cast<int>(i)), .position = y, .gap = gap};
    if (has_patches && guest.on_round[i].is_between_vertices()) {
      const BesideRound place = beside_round(guest, guest.on_round[i], in_host, host.shape, y, gap);
      if (place == BesideRound::above) continue;
      near.is_between_lowest = place == BesideRound::level;
    }
    visit(near, rotation * guest.inside[i] + offset);
  }
}

/// Calls visit(near) for the surface points of the pair's deformable guest whose distance from the host is
/// less than `margin` (m). `near` is a NearPoint with number, position and gap; the gap is the distance,
/// without the contact offset of the point. place_points() has to be called before.
template <class Visit>
void visit_near(const Bodies& bodies, const CandidateSearch& search, const BodyPair& pair, double margin,
                Visit&& visit) {
  const auto h = as_index(pair.host);
  const PosedHost host(shape_pose(bodies.rigid, h), bodies.rigid.properties[h], margin);
  const BodyBounds& bounds = search.broad_phase.bounds[h];
  const Eigen::AlignedBox3d box = bounds.is_half_space ? Eigen::AlignedBox3d() : world_box(bounds, margin);
  const auto misses = [&](const Eigen::AlignedBox3d& block) {
    if (!bounds.is_half_space) return !box.intersects(block);
    const Vec3 normal = bounds.axes.col(1);
    return normal.dot(block.center() - bounds.center) - normal.cwiseAbs().dot(block.sizes()) / 2 > margin;
  };
  const DeformableBody& body = bodies.deformable[as_index(pair.guest_deformable)];
  for (auto b = as_index(search.first_block[as_index(pair.guest_deformable)]);
       b < search.blocks.size() && search.blocks[b].begin < body.first_point + body.point_count; ++b) {
    const CandidateSearch::Block& block = search.blocks[b];
    if (misses(block.box)) continue;
    for (int i = block.begin; i < block.end; ++i) {
      const Vec3 y = host.to_shape * (search.point[as_index(i)] - host.center);
      if (!host.is_near(y)) continue;
      const double gap = host.shape.distance(y);
      if (gap < margin) visit(NearPoint{.feature = FeatureId::point(i), .position = y, .gap = gap});
    }
  }
}

/// Calls visit(near) for the edge contacts of the pair's deformable guest with its host, at most one for each
/// boundary edge. `near` is an EdgeContact. Its distance, without the contact offset of the edge, is less
/// than `margin` and margin_of(edge) (both m). Places that are no support points, places at internal edges,
/// and edges that need no contact between their surface points (is_coarse_for()) are left out. `bounds` are
/// those of the host; `scratch` keeps its storage.
template <class MarginOf, class Visit>
void visit_edges(const Bodies& bodies, const BodyBounds& bounds, const BodyPair& pair, double margin,
                 const MarginOf& margin_of, std::vector<double>& scratch, Visit&& visit) {
  const auto h = as_index(pair.host);
  const RigidProperties& properties = bodies.rigid.properties[h];
  const DeformableBody& body = bodies.deformable[as_index(pair.guest_deformable)];
  if (body.edge_count == 0 || !can_touch_soft_edges(properties.shape, properties.feature_edges)) return;
  const Pose pose = shape_pose(bodies.rigid, h);
  const PosedHost host(pose, properties, margin);
  const Eigen::AlignedBox3d box = world_box(bounds, margin);
  const auto hull = [](const Vec3& a, const Vec3& b) {
    return Eigen::AlignedBox3d(a.cwiseMin(b), a.cwiseMax(b));
  };
  const std::vector<Vec3>& x = bodies.particles.x;
  for (int e = body.first_edge; e < body.first_edge + body.edge_count; ++e) {
    const BoundaryEdge& edge = bodies.edges[as_index(e)];
    const Vec3 &a = x[as_index(edge.particle[0])], &b = x[as_index(edge.particle[1])];
    if (!box.intersects(hull(a, b))) continue;
    const Vec3 first = host.to_shape * (a - host.center), second = host.to_shape * (b - host.center);
    if (!host.box().intersects(hull(first, second))) continue;
    if (!is_coarse_for(properties.shape, (second - first).norm() / body.parts_per_edge)) continue;
    std::optional<EdgeContact> near = edge_contact_on(first, second, body.parts_per_edge, host.shape,
                                                      std::min(margin, margin_of(edge)), scratch);
    if (!near) continue;
    near->feature = FeatureId::edge(e);
    SurfacePoint point;
    point.count = 2;
    std::copy(edge.particle.begin(), edge.particle.end(), point.particle.begin());
    std::copy_n(near->edge.weight.begin(), 2, point.weight.begin());
    if (is_support_point(bodies, point, pose.to_world(near->edge.place),
                         pose.orientation * near->edge.normal) &&
        !is_at_internal_edge(bodies, pair.host, pose.to_world(near->edge.foot), near->precision))
      visit(*near);
  }
}

/// Calls visit(near) for the edge contacts that visit_edges() visits, and then for the vertex-face
/// and support-face contacts of the host with the guest's faces. The latter are less than `margin` (m) away.
/// `chunk` is scratch: `edge`, `corners` and `in_faces` are used.
template <class MarginOf, class Visit>
void visit_places(const Bodies& bodies, const BroadPhase& broad_phase, const BodyPair& pair, double margin,
                  const MarginOf& margin_of, CandidateSearch::Chunk& chunk, Visit&& visit) {
  visit_edges(bodies, broad_phase.bounds[as_index(pair.host)], pair, margin, margin_of, chunk.edge, visit);
  const DeformableBody& guest = bodies.deformable[as_index(pair.guest_deformable)];
  const RigidProperties& host = bodies.rigid.properties[as_index(pair.host)];
  const BodyBounds& bounds = broad_phase.bounds[as_index(pair.host)];
  chunk.in_faces.clear();
  if (has_vertex_face_contacts(guest, host.feature_edges))
    find_vertex_face_contacts(bodies, guest, bounds, pair.host, margin, chunk.corners, chunk.in_faces);
  if (has_support_face_contacts(guest, host.shape))
    find_support_face_contacts(bodies, guest, bounds, pair.host, margin, chunk.in_faces);
  for (EdgeContact& near : chunk.in_faces) {
    near.feature.sub = pair.guest_deformable;
    visit(near);
  }
}

}  // namespace duet
