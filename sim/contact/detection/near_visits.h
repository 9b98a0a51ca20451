// The points, edges and places of a guest that are near a rigid body now: what may touch it, and how deep
// bodies overlap.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>

#include "sim/contact/detection/contact_point.h"
#include "sim/contact/detection/deepest_point.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/support_face_contacts.h"

namespace duet {

// Of two rigid bodies, the other way round.
inline BodyPair reversed(const BodyPair& pair) { return {pair.guest_rigid, pair.host, -1}; }

// Of a rigid guest, in the space of the host.
Pose in_host_of(const RigidBodies& rigid, const BodyPair& pair);

// Appends the places on ridges of a rigid guest whose distance from the host is less than `margin`.
void find_feature_edges(const Bodies& bodies, const BodyPair& pair, bool is_reversed, double margin,
                        std::vector<EdgeContact>& found);

// Whether forces move neither the point of a deformable body, all of whose particles are held, nor the host:
// there is nothing that their contact could do.
bool neither_moves(const Bodies& bodies, const SurfacePoint& point, std::size_t host);

// Places the surface points of the deformable bodies that occur in the pairs.
void place_points(const Bodies& bodies, const std::vector<BodyPair>& pairs, CandidateSearch& search);

// A rigid body's level set at its pose now, with the rotation as a matrix: what a loop over many points
// queries.
struct PosedHost {
  const LevelSet& shape;
  Mat3 to_body;
  Vec3 center;
  Vec3 lower, upper;  // m, body space; points outside are farther off than the margin

  PosedHost(const RigidState& state, const RigidProperties& properties, double margin)
      : shape(properties.shape),
        to_body(state.pose.orientation.toRotationMatrix().transpose()),
        center(state.pose.position),
        lower(shape.lower().array() - margin),
        upper(shape.upper().array() + margin) {
    if (shape.kind == LevelSet::Kind::half_space) upper.y() = margin;
  }
  // The box around what is near, in the space of a guest that `rotation` and `offset` take to the host's.
  Eigen::AlignedBox3d region(const Mat3& rotation, const Vec3& offset) const {
    if (shape.kind == LevelSet::Kind::half_space) {
      const Vec3 everywhere = Vec3::Constant(std::numeric_limits<double>::infinity());
      return {-everywhere, everywhere};
    }
    const Vec3 middle = rotation.transpose() * ((lower + upper) / 2 - offset);
    const Vec3 half = rotation.transpose().cwiseAbs() * ((upper - lower) / 2);
    return {middle - half, middle + half};
  }
  Eigen::AlignedBox3d box() const { return {lower, upper}; }
  bool is_near(const Vec3& y) const {
    return (y.array() >= lower.array()).all() && (y.array() <= upper.array()).all();
  }
};

// Calls visit(near) for the deepest points and the samples of a rigid guest whose distance from the host is
// less than `margin`.
template <class Visit>
void visit_near(const RigidBodies& rigid, const BodyPair& pair, double margin, Visit&& visit) {
  const PosedHost host(rigid.state[as_index(pair.host)], rigid.properties[as_index(pair.host)], margin);
  const Pose& pose = rigid.state[as_index(pair.guest_rigid)].pose;
  const RigidProperties& guest = rigid.properties[as_index(pair.guest_rigid)];
  const Vec3 offset = host.to_body * (pose.position - host.center);
  const Pose in_host = in_host_of(rigid, pair);
  for (int k = 0; k < deepest_point_count(guest.shape); ++k) {
    const DeepestPoint deepest = deepest_point(guest.shape, k, in_host, host.shape);
    const double gap = host.shape.distance(deepest.position);
    if (gap < margin)
      visit(NearPoint{.point = -1 - k, .position = deepest.position, .gap = gap}, deepest.inside);
  }
  if (touches_with_deepest_point(host.shape, guest.shape)) return;
  const bool rolls = rolls_over_samples(host.shape);
  const Mat3 rotation = host.to_body * pose.orientation.toRotationMatrix();
  const Eigen::AlignedBox3d region = host.region(rotation, offset);
  for (std::size_t i = 0; i < guest.samples.size(); ++i) {
    if (!region.contains(guest.samples[i]) || (rolls && guest.on_flat[i] != 0)) continue;
    const Vec3 y = rotation * guest.samples[i] + offset;
    if (!host.is_near(y) || is_beside_side(host.shape, y)) continue;
    const double gap = host.shape.distance(y);
    if (gap < margin)
      visit(NearPoint{.point = static_cast<int>(i), .position = y, .gap = gap},
            rotation * guest.inside[i] + offset);
  }
}

// The same for the surface points of a deformable guest; allowances are not part of the gap.
template <class Visit>
void visit_near(const Bodies& bodies, const CandidateSearch& search, const BodyPair& pair, double margin,
                Visit&& visit) {
  const auto h = as_index(pair.host);
  const PosedHost host(bodies.rigid.state[h], bodies.rigid.properties[h], margin);
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
      const Vec3 y = host.to_body * (search.point[as_index(i)] - host.center);
      if (!host.is_near(y)) continue;
      const double gap = host.shape.distance(y);
      if (gap < margin) visit(NearPoint{.point = i, .position = y, .gap = gap});
    }
  }
}

// Calls visit(number as ContactPoint::guest_point, lowest) for the lowest place of every boundary edge of a
// deformable guest that crosses an edge of the host, where that is less than `margin` and margin_of(edge)
// away; allowances are not part of its distance.
template <class MarginOf, class Visit>
void visit_edges(const Bodies& bodies, const BodyBounds& bounds, const BodyPair& pair, double margin,
                 const MarginOf& margin_of, std::vector<double>& scratch, Visit&& visit) {
  const auto h = as_index(pair.host);
  const RigidProperties& properties = bodies.rigid.properties[h];
  const DeformableBody& body = bodies.deformable[as_index(pair.guest_deformable)];
  if (body.edge_count == 0 || !edges_count(properties.shape, properties.ridges)) return;
  const PosedHost host(bodies.rigid.state[h], properties, margin);
  const Eigen::AlignedBox3d box = world_box(bounds, margin);
  const auto hull = [](const Vec3& a, const Vec3& b) {
    return Eigen::AlignedBox3d(a.cwiseMin(b), a.cwiseMax(b));
  };
  const std::vector<Vec3>& x = bodies.particles.x;
  for (int e = body.first_edge; e < body.first_edge + body.edge_count; ++e) {
    const BoundaryEdge& edge = bodies.edges[as_index(e)];
    const Vec3 &a = x[as_index(edge.particle[0])], &b = x[as_index(edge.particle[1])];
    if (!box.intersects(hull(a, b))) continue;
    const Vec3 first = host.to_body * (a - host.center), second = host.to_body * (b - host.center);
    if (!host.box().intersects(hull(first, second))) continue;
    if (!is_coarse_for(properties.shape, (second - first).norm() / body.parts_per_edge)) continue;
    const std::optional<EdgeContact> near = edge_contact_on(first, second, body.parts_per_edge, host.shape,
                                                            std::min(margin, margin_of(edge)), scratch);
    if (!near) continue;
    const Pose& pose = bodies.rigid.state[h].pose;
    SurfacePoint point;
    point.count = 2;
    std::copy(edge.particle.begin(), edge.particle.end(), point.particle.begin());
    std::copy_n(near->edge.weight.begin(), 2, point.weight.begin());
    if (is_support_point(bodies, point, pose.to_world(near->edge.place),
                         pose.orientation * near->edge.normal) &&
        !is_at_seam(bodies, pair.host, pose.to_world(near->edge.foot), near->precision))
      visit(static_cast<int>(bodies.points.size()) + e, *near);
  }
}

// The same, and the places on the guest's faces where corners or deepest points of the host touch them.
template <class MarginOf, class Visit>
void visit_places(const Bodies& bodies, const BroadPhase& broad_phase, const BodyPair& pair, double margin,
                  const MarginOf& margin_of, CandidateSearch::Chunk& chunk, Visit&& visit) {
  visit_edges(bodies, broad_phase.bounds[as_index(pair.host)], pair, margin, margin_of, chunk.edge, visit);
  const DeformableBody& guest = bodies.deformable[as_index(pair.guest_deformable)];
  const RigidProperties& host = bodies.rigid.properties[as_index(pair.host)];
  const BodyBounds& bounds = broad_phase.bounds[as_index(pair.host)];
  chunk.in_faces.clear();
  if (corners_count(guest, host.ridges))
    find_places_at_corners(bodies, guest, bounds, pair.host, margin, chunk.corners, chunk.in_faces);
  if (deepest_points_count(guest, host.shape))
    find_places_at_deepest_points(bodies, guest, bounds, pair.host, margin, chunk.in_faces);
  for (const EdgeContact& near : chunk.in_faces)
    visit(at_corner(bodies, pair.guest_deformable, near.node), near);
}

}  // namespace duet
