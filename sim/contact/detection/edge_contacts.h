// Edge contacts: where the feature edges of a rigid body, or the boundary edges of a deformable one, come
// nearest to another rigid body. There edges cross, and rings, rods and rims touch between their samples.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "sim/contact/detection/feature_id.h"
#include "sim/contact/detection/pair_direction.h"
#include "sim/geometry/level_set/feature_edges.h"

namespace duet {

/// A place on a guest, and the plane at which it touches the host there. For edges that cross, both lie in
/// the plane.
struct EdgePoint {
  Vec3 place = Vec3::Zero();  ///< m: in the shape space of a rigid guest; in the host's for a deformable one.
  /// Unit, in the host's shape space: outward normal of the host. Zero if there is no plane.
  Vec3 normal = Vec3::Zero();
  /// m, in the host's shape space: a point of the plane. In contacts with faces of deformable guests it is
  /// the point of the host that touches.
  Vec3 foot = Vec3::Zero();
  double radius = 0;  ///< m: of the ball about `place` whose surface touches; 0 on edges.
  /// Barycentric weights (1) of the particles of a deformable guest's edge (the first two) or face. A ring
  /// contact has the ends and the slack of its arc here, see arc_of() in ring_contacts.h.
  std::array<double, 3> weight{};
  std::ptrdiff_t face = -1;  ///< Index of a deformable guest's face in Bodies::triangles; -1: none.
};

/// Says what the plane of an edge contact or of a contact in a face moves with.
struct PlaneFrame {
  /// Bodies and features that a plane can move with.
  enum class Kind : int {
    host,  ///< The host: the plane stays on it where it was found.
    face,  ///< A deformable guest's face: the host may turn on it.
    edge   ///< A deformable guest's edge: a round host may turn around it.
  };
  Kind kind = Kind::host;  ///< The body or feature that the plane moves with.
  int support_point = -1;  ///< For `face`: number of the host's support point on it; -1: EdgePoint::foot.
};

/// An edge contact, or a contact in a face of a deformable guest, as the searches find it.
struct EdgeContact {
  EdgePoint edge;          ///< The place and its plane.
  PlaneFrame plane_frame;  ///< The body or feature that the plane moves with.
  FeatureId feature;       ///< Name of the place; in the face of a guest, visit_places() adds FeatureId::sub.
  double distance = 0;     ///< m: signed distance of the ball about the place from the host.
  double precision = 0;    ///< m: how precisely the place is known along its line.
};

/// Returns whether a shape is a ball or what a ball sweeps out along a line: a sphere, capsule or torus.
bool is_swept_by_ball(const LevelSet& shape);
/// Returns the radius of the ball that sweeps out a shape, m. It holds for the shapes that is_swept_by_ball()
/// accepts.
double radius_of_ball(const LevelSet& shape);

/// Returns whether the feature edges of a guest can touch a host where no sample or support point of either
/// would show it. `direction` is that of the pair of bodies: two middle lines are searched in one of the
/// two only.
bool can_touch_with_feature_edges(const LevelSet& guest, const LevelSet& host, PairDirection direction);

/// What happens to the places where an edge passes the end of a face that it lies along.
enum class EdgesOnFaces {
  are_found,    ///< They are edge contacts.
  are_left_out  ///< The other body's edges show the same places where they cross, and are searched as well.
};

/// Appends to `found` the edge contacts along the feature edges `feature_edges` of a guest that are less than
/// `margin` (m) from `host`.
///
/// They are local minima of the distance to the host, by golden section on the exact distance. Lines that lie
/// along a flat face have no clear minimum. For the axis of a capsule or cylinder that lies along a flat face
/// or a round side, the ends of the part above it are found instead, except for the axis's own ends, which
/// are support points. For an edge or a ring, the places are found where it passes the end of a face that it
/// lies along. For edges that happens only if EdgesOnFaces says so. On a ball, capsule or torus as host, the
/// center line of a torus has ring contacts instead, see find_ring_contacts(). `pose` is that of the guest in
/// the host's shape space, and everything outside of the box `near` (m, host's shape space) is farther from
/// the host than the margin.
void find_edge_contacts(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host,
                        const Eigen::AlignedBox3d& near, double margin, std::vector<EdgeContact>& found,
                        EdgesOnFaces on_faces = EdgesOnFaces::are_found);

/// Returns whether edges of deformable bodies can touch a host between their surface points, because they
/// cross its feature edges `feature_edges` or are nearest to it as a round body.
bool can_touch_soft_edges(const LevelSet& host, const FeatureEdges& feature_edges);

/// Finds the edge contact of a deformable body's straight edge from `first` to `second` (m, in the host's
/// shape space) with `host`. For a round host it is the place nearest to it; for others, the lowest of the
/// places at which the edge crosses an edge of the host. Returns nothing if there is no such place less than
/// `margin` (m) away. The surface points of the edge divide it into `parts` equal parts, at least 2, which
/// the search looks at. `distance` is scratch whose storage is kept.
std::optional<EdgeContact> edge_contact_on(const Vec3& first, const Vec3& second, int parts,
                                           const LevelSet& host, double margin,
                                           std::vector<double>& distance);

}  // namespace duet
