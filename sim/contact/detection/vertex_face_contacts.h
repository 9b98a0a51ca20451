// Vertex-face contacts: where the corners and convex vertices of a rigid body touch the boundary of a
// deformable one, between the points of its faces.
#pragma once

#include <limits>
#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/edge_contacts.h"

namespace duet {

/// The result so far of a search at one corner or convex vertex of a host. Vectors are in the host's shape
/// space.
struct VertexSearch {
  int corner = -1;  ///< Number of the corner or convex vertex, as in FeatureEdges::corner_tree.
  /// m^2: squared length of `way`.
  double squared = std::numeric_limits<double>::infinity();
  Vec3 way = Vec3::Zero();     ///< m: displacement from the nearest place on the guest to the corner.
  Vec3 normal = Vec3::Zero();  ///< Unit: outward normal of the face with that place.
  Vec3 weight = Vec3::Zero();  ///< Barycentric weights (1) of that place in its face.
  double size = 0;             ///< m: NearFace::size of that face.
  int face = -1;               ///< Index of that face in Bodies::triangles; -1: none found.
};
/// Scratch of find_vertex_face_contacts().
struct VertexSearches {
  std::vector<VertexSearch> corners;  ///< The corners that faces are near.
  std::vector<int> slot;  ///< For every corner of the host: its index in `corners`; -1: not there.
};

/// Returns whether corners or convex vertices of a host with the feature edges `feature_edges` can touch the
/// faces of `guest`.
bool has_vertex_face_contacts(const DeformableBody& guest, const FeatureEdges& feature_edges);

/// Appends the vertex-face contacts of `host` with `guest`: for each corner of `host`, the nearest place on
/// the boundary of `guest`; then for each convex vertex, which are numbered on from the corners.
///
/// The corner has to be less than `margin` (m) outside of the boundary, or no deeper inside than
/// max_below(), with the rest of the host on the outer side. Sheets are looked at from both sides. The plane
/// goes through the corner. Its normal is the face's, or the host's own if that lies flat on the face.
/// FeatureId::index is the number of the corner. `host_bounds` are the bounds of `host`.
void find_vertex_face_contacts(const Bodies& bodies, const DeformableBody& guest,
                               const BodyBounds& host_bounds, int host, double margin,
                               VertexSearches& scratch, std::vector<EdgeContact>& found);

/// The normal of a contact at a corner of a host.
struct VertexNormal {
  Vec3 normal;                ///< Unit, in the host's shape space: outward of the host.
  bool is_hosts_own = false;  ///< True if it is the normal of a face of the host.
};
/// Returns the normal at which a host's corner at `corner` (m) touches a plane with the unit normal
/// `-toward`, where `inward` (unit) leads from the corner into the host. All is in the host's shape space.
///
/// It is `toward`, or the normal of a face of the host that lies flat on the plane, to within 20 degrees.
/// Other contacts there act along the normals of the host, and normals that are nearly equal would be one
/// constraint twice over: the contact problem would be ill-conditioned.
VertexNormal normal_at_vertex(const LevelSet& host, const Vec3& corner, const Vec3& inward,
                              const Vec3& toward);

}  // namespace duet
