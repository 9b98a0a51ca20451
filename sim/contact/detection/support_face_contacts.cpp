#include "sim/contact/detection/support_face_contacts.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/near_faces.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/contact/detection/vertex_face_contacts.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

// Greatest distance between surface points at which a ball needs no contacts between them, relative to its
// radius. Between points that are nearer to each other it sinks in by less than 1/200 of its radius, an
// eighth of the depth that contact may leave (2 % of a body).
constexpr double coarse = 0.2;
constexpr double beside_face =
    1e-9;                    // greatest distance of a point beside a face, relative to the face's size
constexpr double cap = 0.9;  // least component of a cap's normal along the axis of a cylinder
constexpr int numbers_of_a_face = 4;  // numbers that each face has: two support points for either side

// Returns whether the support points of a shape lie on rims.
bool is_rim(const LevelSet& shape) { return shape.kind == LevelSet::Kind::cylinder; }

// Returns whether support point k of a shape can touch a plane with the unit normal `n` (its shape
// space). Only the lower one of the two caps of a capsule can, or both if they are equally low.
bool has_support_point(const LevelSet& shape, int k, const Vec3& n) {
  const double side = k == 0 ? 1 : -1;
  return shape.kind != LevelSet::Kind::capsule || side * n.y() <= beside_face;
}

// Searches the faces of one guest for support-face contacts with one host.
class SupportFaceSearch {
 public:
  SupportFaceSearch(const Bodies& bodies, const DeformableBody& guest, int host, double margin,
                    std::vector<EdgeContact>& found)
      : bodies_(bodies),
        guest_(guest),
        host_(host),
        shape_(bodies.rigid.properties[as_index(host)].shape),
        first_number_(static_cast<int>(bodies.rigid.properties[as_index(host)].feature_edges.corner_count())),
        margin_(margin),
        first_(found.size()),
        found_(found) {}

  // Appends the contacts of all support points of the host with one face.
  void look_at_face(const NearFace& face) {
    if (!is_coarse_for(shape_, face.size / guest_.parts_per_edge)) return;
    const int number = first_number_ + numbers_of_a_face * (face.number - guest_.first_triangle);
    for (int k = 0; k < support_point_count(shape_); ++k) {
      look_at_side(face, face.normal, k, number + k);
      if (guest_.thickness > 0) look_at_side(face, -face.normal, k, number + 2 + k);
    }
  }

 private:
  // Appends the contact of support point k with the side of the face that has the normal `outward`, if they
  // touch.
  void look_at_side(const NearFace& face, const Vec3& outward, int k, int number) {
    if (!has_support_point(shape_, k, outward)) return;
    const ShapeSupportPoint point = support_point(shape_, k, outward);
    const Vec3& x = point.position;
    const double height = outward.dot(x - face.x[0]);
    if (!(height < margin_ && height >= -max_below(guest_, face.size))) return;
    const Vec3 weight = nearest_weights(face.x[0], face.x[1], face.x[2], x);
    const Vec3 place = weight[0] * face.x[0] + weight[1] * face.x[1] + weight[2] * face.x[2];
    if (!((x - height * outward - place).norm() <= beside_face * face.size)) return;
    const Vec3 inward = (point.inside - x).normalized();
    if (!(outward.dot(inward) > min_facing)) return;
    EdgeContact near;
    EdgePoint& edge = near.edge;
    edge.place = place;
    edge.foot = x;
    // A rim touches as a corner does. The plane is that of the cap, and stays on the host, for a cylinder
    // that stands on the face. For one that rolls it is the face's, and moves with the face.
    VertexNormal normal{-outward, false};
    if (is_rim(shape_)) normal = normal_at_vertex(shape_, x, inward, -outward);
    const bool stands = normal.is_hosts_own && std::abs(normal.normal.y()) > cap;
    edge.normal = stands || !normal.is_hosts_own ? normal.normal : Vec3(-outward);
    if (!stands) near.plane_frame.kind = PlaneFrame::Kind::face;
    edge.weight = {weight[0], weight[1], weight[2]};
    edge.face = face.number;
    near.plane_frame.support_point = k;
    near.feature = {FeatureId::Kind::in_face, number};
    near.distance = edge.normal.dot(place - x);
    if (!is_found(near, face.size) &&
        !is_at_internal_edge(bodies_, host_, shape_pose(bodies_.rigid, as_index(host_)).to_world(x), 0))
      found_.push_back(near);
  }

  // Returns whether the contact has been found before. A support point above the edge between two faces of
  // one plane is above both.
  bool is_found(const EdgeContact& near, double size) const {
    return std::any_of(found_.begin() + static_cast<std::ptrdiff_t>(first_), found_.end(),
                       [&](const EdgeContact& other) {
                         return (other.edge.place - near.edge.place).norm() <= 4 * beside_face * size &&
                                (other.edge.foot - near.edge.foot).norm() <= 4 * beside_face * size;
                       });
  }

  const Bodies& bodies_;
  const DeformableBody& guest_;
  int host_;
  const LevelSet& shape_;
  int first_number_;
  double margin_;
  std::size_t first_;
  std::vector<EdgeContact>& found_;
};

}  // namespace

bool has_support_face_contacts(const DeformableBody& guest, const LevelSet& host) {
  return guest.triangle_count > 0 && guest.edge_count > 0 && support_point_count(host) > 0;
}

bool is_coarse_for(const LevelSet& host, double apart) {
  return !is_swept_by_ball(host) || apart > coarse * radius_of_ball(host);
}

void find_support_face_contacts(const Bodies& bodies, const DeformableBody& guest,
                                const BodyBounds& host_bounds, int host, double margin,
                                std::vector<EdgeContact>& found) {
  SupportFaceSearch search(bodies, guest, host, margin, found);
  visit_near_faces(bodies, guest, host, world_box(host_bounds, margin), margin,
                   [&](const NearFace& face) { search.look_at_face(face); });
}

}  // namespace duet
