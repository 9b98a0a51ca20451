#include "sim/contact/detection/vertex_face_contacts.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/near_faces.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

// Least cosine of the angle between the face's normal and the displacement from the nearest place to the
// corner. Between faces that turn by up to 50 degrees the cosine is greater, beside rims of blocks and of
// sheets it is less. Other points touch at rims, and a contact of the corner there would repeat them with a
// slanted normal.
constexpr double min_upright = 0.9;
// Relative difference up to which squared distances are equal, as those of the faces around an edge or a
// particle.
constexpr double same_distance = 1e-9;
// Least cosine of the angle between two faces that lie on each other: 20 degrees.
constexpr double lies_flat = 0.94;
// Distance from a corner at which the host's faces are told apart, relative to the smallest size of the host.
constexpr double way_in = 0.05;
// Distance of a corner from a face below which their displacement has no direction, relative to the face's
// size.
constexpr double at_face = 1e-9;
// Greatest ratio of the size of a face to that of a smaller neighbor. A corner that is as deep as it may be
// below the larger one is then still within reach of the smaller one, which may be the nearest.
constexpr double grading = 2;

// Returns, for two faces that a corner is equally far from across an edge or a particle, whether the corner
// belongs to `face` rather than to that of `nearest`. It belongs to the one whose normal it is nearer to; if
// it lies on both, to the one that the host faces.
bool tells_more(const NearFace& face, const Vec3& way, const Vec3& inward, const VertexSearch& nearest) {
  const double height = std::abs(way.dot(face.normal)), other = std::abs(nearest.way.dot(nearest.normal));
  if (std::max(height, other) > at_face * face.size) return height > other;
  return face.normal.dot(inward) > nearest.normal.dot(inward);
}

// Updates `nearest` with the place of `face` that is nearest to a corner, if that is nearer than the one
// found so far. Corners farther than `reach` (m) are passed over.
void look_at(const NearFace& face, double reach, const Vec3& corner, const Vec3& inward,
             VertexSearch& nearest) {
  const double on_face = at_face * face.size, slack = same_distance * nearest.squared + on_face * on_face;
  const double most = std::min(reach * reach, nearest.squared + slack);
  const double height = face.normal.dot(corner - face.x[0]);
  if (height * height > most || face.box.squaredExteriorDistance(corner) > most) return;
  const Vec3 weight = nearest_weights(face.x[0], face.x[1], face.x[2], corner);
  const Vec3 way = corner - (weight[0] * face.x[0] + weight[1] * face.x[1] + weight[2] * face.x[2]);
  const double squared = way.squaredNorm();
  if (squared > most) return;
  if (nearest.face >= 0 && squared >= nearest.squared - slack && !tells_more(face, way, inward, nearest))
    return;
  nearest.squared = squared;
  nearest.way = way;
  nearest.normal = face.normal;
  nearest.weight = weight;
  nearest.face = face.number;
  nearest.size = face.size;
}

// Searches the faces of one guest, in the shape space of a host, for those nearest to the host's corners.
class VertexFaceSearch {
 public:
  VertexFaceSearch(const Bodies& bodies, const DeformableBody& guest, int host, double margin,
                   VertexSearches& scratch)
      : guest_(guest),
        properties_(bodies.rigid.properties[as_index(host)]),
        margin_(margin),
        scratch_(scratch) {
    scratch.corners.clear();
    scratch.slot.assign(properties_.feature_edges.corner_count(), -1);
  }

  // Updates the nearest places of all corners that are near the face.
  void look_at_face(const NearFace& face) {
    const double reach = margin_ + grading * max_below(guest_, face.size);
    const Vec3 beside = Vec3::Constant(reach);
    properties_.feature_edges.corner_tree->query(
        {face.box.min() - beside, face.box.max() + beside}, [&](int number) {
          int& slot = scratch_.slot[as_index(number)];
          if (slot < 0) {
            slot = static_cast<int>(scratch_.corners.size());
            scratch_.corners.emplace_back().corner = number;
          }
          look_at(face, reach, properties_.feature_edges.corner(number),
                  properties_.feature_edges.inward_of(number), scratch_.corners[as_index(slot)]);
        });
  }

  // Returns the contact of a corner at its nearest place, if they touch there.
  std::optional<EdgeContact> place_at(const VertexSearch& nearest) const {
    const FeatureEdges& feature_edges = properties_.feature_edges;
    const Vec3 &corner = feature_edges.corner(nearest.corner),
               &inward = feature_edges.inward_of(nearest.corner);
    const bool is_back = guest_.thickness > 0 && nearest.normal.dot(inward) < 0;
    const Vec3 outward = is_back ? Vec3(-nearest.normal) : nearest.normal;
    const double height = nearest.way.dot(outward), length = nearest.way.norm();
    if (length > at_face * nearest.size && !(std::abs(height) >= min_upright * length)) return std::nullopt;
    if (!(height < margin_ && height >= -max_below(guest_, nearest.size))) return std::nullopt;
    if (!(outward.dot(inward) > min_facing)) return std::nullopt;
    EdgeContact found;
    EdgePoint& edge = found.edge;
    edge.place = corner - nearest.way;
    edge.foot = corner;
    const VertexNormal at_corner = normal_at_vertex(properties_.shape, corner, inward, -outward);
    edge.normal = at_corner.normal;
    edge.weight = {nearest.weight[0], nearest.weight[1], nearest.weight[2]};
    edge.face = nearest.face;
    // Over a face the plane moves with the face. A corner beside the rim of the boundary is above no face
    // that it could slide over, so that its plane stays on the host.
    const bool is_above = (nearest.way - height * outward).norm() <= at_face * nearest.size;
    if (is_above && !at_corner.is_hosts_own) found.plane_frame.kind = PlaneFrame::Kind::face;
    found.feature = {FeatureId::Kind::in_face, nearest.corner};
    found.distance = edge.normal.dot(edge.place - edge.foot);
    return found;
  }

 private:
  const DeformableBody& guest_;
  const RigidProperties& properties_;
  double margin_;
  VertexSearches& scratch_;
};

}  // namespace

VertexNormal normal_at_vertex(const LevelSet& host, const Vec3& corner, const Vec3& inward,
                              const Vec3& toward) {
  // This direction leads to the place where the face on the side of the plane is nearest.
  const Vec3 way = inward - 0.5 * inward.dot(toward) * toward;
  const Vec3 own = host.normal(corner + way_in * host.min_size() * way);
  if (own.dot(toward) > lies_flat) return {own, true};
  return {toward, false};
}

bool has_vertex_face_contacts(const DeformableBody& guest, const FeatureEdges& feature_edges) {
  return guest.triangle_count > 0 && guest.edge_count > 0 && feature_edges.corner_count() > 0;
}

void find_vertex_face_contacts(const Bodies& bodies, const DeformableBody& guest,
                               const BodyBounds& host_bounds, int host, double margin,
                               VertexSearches& scratch, std::vector<EdgeContact>& found) {
  const RigidProperties& properties = bodies.rigid.properties[as_index(host)];
  const Pose pose = shape_pose(bodies.rigid, as_index(host));
  VertexFaceSearch search(bodies, guest, host, margin, scratch);
  visit_near_faces(bodies, guest, host, world_box(host_bounds, margin), margin,
                   [&](const NearFace& face) { search.look_at_face(face); });
  std::sort(scratch.corners.begin(), scratch.corners.end(),
            [](const VertexSearch& a, const VertexSearch& b) { return a.corner < b.corner; });
  for (const VertexSearch& nearest : scratch.corners) {
    if (nearest.face < 0) continue;
    const Vec3& corner = properties.feature_edges.corner(nearest.corner);
    const auto place = search.place_at(nearest);
    if (place && !is_at_internal_edge(bodies, host, pose.to_world(corner), 0)) found.push_back(*place);
  }
}

}  // namespace duet
