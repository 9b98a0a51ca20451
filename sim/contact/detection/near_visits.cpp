#include "sim/contact/detection/near_visits.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr std::size_t points_at_once = 32;  // surface points in a block with a box of its own

// Returns whether an edge contact on the side of a cylindrical host is left to the host's axis. Edges touch
// the side where the axis is nearest to their body, and that contact goes along as the cylinder rolls. The
// sides of two cylinders touch the same way, where one of the two axes is enough.
bool is_left_to_axis(const EdgeContact& near, const LevelSet& host, const LevelSet& guest,
                     PairDirection direction) {
  return host.kind == LevelSet::Kind::cylinder && is_on_side_of_cylinder(near.edge.normal) &&
         (near.edge.radius == 0 ||
          (direction == PairDirection::reversed && guest.kind == LevelSet::Kind::cylinder));
}

}  // namespace

Pose in_host_of(const RigidBodies& rigid, const BodyPair& pair) {
  const Pose host = shape_pose(rigid, as_index(pair.host)),
             guest = shape_pose(rigid, as_index(pair.guest_rigid));
  return {host.to_body(guest.position), host.orientation.conjugate() * guest.orientation};
}

BesideRound beside_round(const RigidProperties& guest, const RoundSample& sample, const Pose& in_host,
                         const LevelSet& host, const Vec3& y, double gap) {
  BesideRound place = BesideRound::level;
  for (const int corner : sample.corner) {
    if (corner < 0) break;
    const RoundPlace lowest = lowest_vertex(*guest.round, corner, in_host, host);
    const double above = gap - lowest.distance, level = level_slope * (y - lowest.position).norm();
    if (above > level) return BesideRound::above;
    if (above < -level) place = BesideRound::between;
  }
  return place;
}

void find_feature_edges(const Bodies& bodies, const BodyPair& pair, PairDirection direction, double margin,
                        std::vector<EdgeContact>& found) {
  const RigidBodies& rigid = bodies.rigid;
  const auto h = as_index(pair.host);
  const RigidProperties& guest = rigid.properties[as_index(pair.guest_rigid)];
  const RigidProperties& body = rigid.properties[h];
  const bool is_ball_on_ring =
      guest.shape.kind == LevelSet::Kind::sphere && touch_along_ring(guest.shape, body.shape);
  if ((guest.feature_edges.lines.empty() && !is_ball_on_ring) ||
      !can_touch_with_feature_edges(guest.shape, body.shape, direction))
    return;
  const Pose in_host = in_host_of(rigid, pair);
  if (is_ball_on_ring && !is_in_middle(in_host.position, body.shape)) return;
  const Pose pose = shape_pose(rigid, h);
  const PosedHost host(pose, body, margin);
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  if (is_ball_on_ring)
    find_ring_contacts_of_ball(body.feature_edges, in_host, guest.shape, margin, found);
  else
    find_edge_contacts(guest.feature_edges, in_host, host.shape, host.box(), margin, found,
                       direction == PairDirection::as_found || body.feature_edges.lines.empty()
                           ? EdgesOnFaces::are_found
                           : EdgesOnFaces::are_left_out);
  const auto counts = [&](const EdgeContact& near) {
    return !is_left_to_axis(near, host.shape, guest.shape, direction) &&
           !is_at_internal_edge(bodies, pair.host, pose.to_world(near.edge.foot), near.precision);
  };
  found.erase(std::remove_if(found.begin() + first, found.end(), std::not_fn(counts)), found.end());
}

bool neither_moves(const Bodies& bodies, const SurfacePoint& point, std::size_t host) {
  return point.inverse_mass == 0 && !(bodies.rigid.properties[host].is_dynamic() && bodies.push_back);
}

void place_points(const Bodies& bodies, const std::vector<BodyPair>& pairs, CandidateSearch& search) {
  search.blocks.clear();
  search.first_block.assign(bodies.deformable.size(), 0);
  search.point.resize(bodies.points.size());
  int last = -1;
  for (const BodyPair& pair : pairs) {  // pairs with one deformable body follow each other
    if (pair.guest_deformable == last) continue;
    last = pair.guest_deformable;
    const DeformableBody& body = bodies.deformable[as_index(last)];
    search.first_block[as_index(last)] = static_cast<int>(search.blocks.size());
    const int end = body.first_point + body.point_count, step = static_cast<int>(points_at_once);
    for (int i = body.first_point; i < end; i += step)
      search.blocks.push_back({i, std::min(i + step, end), {}});
  }
  parallel_for(search.blocks.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      auto box = search.blocks[b].box;  // a copy stays in registers
      for (int i = search.blocks[b].begin; i < search.blocks[b].end; ++i) {
        const Vec3 x = weighted(bodies.points[as_index(i)], bodies.particles.x);
        search.point[as_index(i)] = x;
        box.extend(x);
      }
      search.blocks[b].box = box;
    }
  });
}

}  // namespace duet
