#include "sim/coupling/corners_in_faces.h"

#include <algorithm>
#include <cmath>

#include "sim/coupling/seams.h"
#include "sim/geometry/closest_points.h"

namespace duet {
namespace {

// Cosine of the angle between the face's normal and the way into the host, at least: from a cube's corner it
// is 0.58 to its faces.
constexpr double least_facing = 0.2;
// The same of the way to the corner and the face's normal: between faces that turn by up to 50 degrees it is
// more, beside rims of blocks and of sheets less. What touches there are other points, and the corner would
// only say what they say, a little askew.
constexpr double least_upright = 0.9;
// Squared distances that are the same but for rounding: of the faces around an edge or a particle.
constexpr double rounding = 1e-9;
// Cosine of the angle between two faces that lie on each other, at least.
constexpr double lies_flat = 0.94;
// Of the smallest size of a host: how far in from a corner its faces are told apart.
constexpr double way_in = 0.05;
// Of the size of a face: from nearer than that the way to the corner has no direction.
constexpr double at_face = 1e-9;
// How much smaller than their neighbours faces may be for the nearest of them to be found where a corner is
// as deep as the points of these are apart.
constexpr double grading = 2;

void look_at(const FourPoints& at, int face, CornerSearch& nearest) {
  const Vec3 weight = nearest_weights(at[1], at[2], at[3], at[0]);
  const Vec3 way = at[0] - (weight[0] * at[1] + weight[1] * at[2] + weight[2] * at[3]);
  const double squared = way.squaredNorm();
  if (!(squared <= (1 + rounding) * nearest.squared)) return;
  const Vec3 normal = (at[2] - at[1]).cross(at[3] - at[1]).normalized();
  // On which side of an edge or a particle the corner is, that face tells which it is the least beside.
  const bool is_nearer = squared < (1 - rounding) * nearest.squared;
  if (!is_nearer && std::abs(way.dot(normal)) <= std::abs(nearest.way.dot(nearest.normal))) return;
  nearest.squared = squared;
  nearest.way = way;
  nearest.normal = normal;
  nearest.weight = weight;
  nearest.face = face;
}

// Faces of particles that move with a body are left to the body, and those that are held to none.
bool counts(const Particles& particles, const Triangle& face) {
  const auto is_left_out = [&](int p) { return particles.mass[as_index(p)] == 0; };
  const auto moves = [&](int p) { return particles.inverse_mass[as_index(p)] > 0; };
  return std::none_of(face.begin(), face.end(), is_left_out) && std::any_of(face.begin(), face.end(), moves);
}

// The host's own face at a corner if it lies flat on one with the unit normal `-toward`: what else touches
// there acts along the normals of the host, and others that are nearly the same would be one constraint twice
// over, badly conditioned. In the host's space.
Vec3 normal_at(const LevelSet& host, const Vec3& corner, const Vec3& inward, const Vec3& toward) {
  const Vec3 way = inward - 0.5 * inward.dot(toward) * toward;  // nearest to the face on that side
  const Vec3 own = host.exact(corner + way_in * host.smallest_size() * way).normal;
  return own.dot(toward) > lies_flat ? own : toward;
}

std::optional<NearRidge> place_at(const CornerSearch& nearest, bool is_sheet, double size, double depth,
                                  double margin, const LevelSet& shape, const Pose& host) {
  const bool is_back = is_sheet && nearest.normal.dot(nearest.inward) < 0;
  const Vec3 outward = is_back ? Vec3(-nearest.normal) : nearest.normal;
  const double height = nearest.way.dot(outward), length = nearest.way.norm();
  if (length > at_face * size && !(std::abs(height) >= least_upright * length)) return std::nullopt;
  if (!(height < margin && height >= -depth)) return std::nullopt;
  if (!(outward.dot(nearest.inward) > least_facing)) return std::nullopt;
  NearRidge found;
  LowestPlace& lowest = found.lowest;
  lowest.place = host.to_body(nearest.x - nearest.way);
  lowest.foot = host.to_body(nearest.x);
  const Quat to_body = host.orientation.conjugate();
  lowest.normal = normal_at(shape, lowest.foot, to_body * nearest.inward, to_body * -outward);
  lowest.weight = {nearest.weight[0], nearest.weight[1], nearest.weight[2]};
  lowest.face = nearest.face;
  found.node = nearest.corner;
  found.distance = lowest.normal.dot(lowest.place - lowest.foot);
  return found;
}

// The corners that may be near, and a box around them.
Eigen::AlignedBox3d begin(const RigidState& state, const Ridges& ridges, const Eigen::AlignedBox3d& guest,
                          std::vector<CornerSearch>& corners) {
  Eigen::AlignedBox3d box;
  corners.clear();
  for (std::size_t k = 0; k < ridges.corners.size(); ++k) {
    const auto node = as_index(ridges.corners[k]);
    CornerSearch corner;
    corner.corner = static_cast<int>(k);
    corner.x = state.pose.to_world(ridges.nodes[node]);
    if (!guest.contains(corner.x)) continue;
    corner.inward = state.pose.orientation * ridges.inward[node];
    corners.push_back(corner);
    box.extend(corner.x);
  }
  return box;
}

}  // namespace

bool corners_count(const DeformableBody& guest, const Ridges& ridges) {
  return guest.triangle_count > 0 && guest.edge_count > 0 && !ridges.corners.empty();
}

void find_places_at_corners(const Bodies& bodies, const DeformableBody& guest, const BodyBounds& bounds,
                            int host, double margin, std::vector<CornerSearch>& scratch,
                            std::vector<NearRidge>& found) {
  const RigidState& state = bodies.rigid.state[as_index(host)];
  const RigidProperties& properties = bodies.rigid.properties[as_index(host)];
  const Eigen::AlignedBox3d box = begin(state, properties.ridges, world_box(bounds, margin), scratch);
  if (scratch.empty()) return;
  const std::vector<Vec3>& x = bodies.particles.x;
  const auto box_of = [&](const Triangle& face) {
    return Eigen::AlignedBox3d(x[as_index(face[0])])
        .extend(x[as_index(face[1])])
        .extend(x[as_index(face[2])]);
  };
  for (int t = guest.first_triangle; t < guest.first_triangle + guest.triangle_count; ++t) {
    const Triangle& face = bodies.triangles[as_index(t)];
    const Eigen::AlignedBox3d around = box_of(face);
    const double reach = margin + grading * around.diagonal().norm() / guest.parts_per_edge;
    if (around.squaredExteriorDistance(box) > reach * reach || !counts(bodies.particles, face)) continue;
    for (CornerSearch& corner : scratch)
      if (around.squaredExteriorDistance(corner.x) <= reach * reach)
        look_at({corner.x, x[as_index(face[0])], x[as_index(face[1])], x[as_index(face[2])]}, t, corner);
  }
  for (const CornerSearch& corner : scratch) {
    if (corner.face < 0 || is_at_seam(bodies, host, corner.x, 0)) continue;
    const double size = box_of(bodies.triangles[as_index(corner.face)]).diagonal().norm();
    const double depth = size / guest.parts_per_edge;
    if (const auto near =
            place_at(corner, guest.thickness > 0, size, depth, margin, properties.shape, state.pose))
      found.push_back(*near);
  }
}

}  // namespace duet
