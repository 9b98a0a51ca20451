// Where the ridges of a rigid body and the boundary edges of a deformable one come nearest to another rigid
// body: where edges cross, and where rings, rods and rims touch beside their samples.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "sim/geometry/level_set/feature_edges.h"

namespace duet {

// A place on a ridge of a guest, and the plane at which it touches the host: for crossing edges the one that
// both edges lie in.
struct EdgePoint {
  Vec3 place = Vec3::Zero();   // m, guest's body space; of a deformable guest, the host's
  Vec3 normal = Vec3::Zero();  // unit, outward of the host, in its body space
  Vec3 foot = Vec3::Zero();    // m, of the plane, in the host's body space
  double radius = 0;           // m, of the ball about the place that touches
  // Of a deformable guest: of the particles of its edge or face, of which the number among the boundaries'
  // triangles is told.
  std::array<double, 3> weight{};
  std::ptrdiff_t face = -1;
};

// What the plane at such a place goes with: the host, on which it stays where it was found, or a deformable
// guest's face or edge, around which the host may turn. Of a face, which of the host's deepest points touches
// it, or -1 for the foot.
struct PlaneKeeper {
  enum class Kind : int { host, face, edge };
  Kind kind = Kind::host;
  int deepest = -1;
};

struct EdgeContact {
  EdgePoint edge;
  PlaneKeeper keeper;
  int node = -1;         // of the guest's ridges, next to the place
  double distance = 0;   // m, from the ball about the place to the host
  double precision = 0;  // m, of the place along its line
};

// Whether a ball sweeps out the shape, or it is one.
bool is_swept_by_ball(const LevelSet& shape);
// Of that ball, m.
double radius_of_ball(const LevelSet& shape);

// Whether the ridges of a guest of shape `guest` can touch a `host` where neither its own samples and deepest
// points nor those of the host would show it; `is_reversed` for one of the two ways round of a pair.
bool feature_edges_count(const LevelSet& guest, const LevelSet& host, bool is_reversed);

// Appends the local minima of the distance to `host` along the ridges that are less than `margin` (m). They
// are minima by a margin, which what lies along a flat face has none of. Instead, of the axis of a capsule or
// cylinder that lies along a flat face or a round side, the ends of the part over it that are not its own
// ends, which are deepest points; and of an edge or a ring, the places where it passes the end of a face that
// it lies along: edges only `with_edges_on_faces`, as where two cross those of the other body tell the same.
// `pose` is that of the ridges' body in the host's space, `near` a box of it out of which everything is
// farther than the margin.
void find_edge_contacts(const FeatureEdges& ridges, const Pose& pose, const LevelSet& host,
                        const Eigen::AlignedBox3d& near, double margin, std::vector<EdgeContact>& found,
                        bool with_edges_on_faces = true);

// Whether edges of deformable bodies can touch such a host beside their points: cross its edges, or be
// nearest to a round one.
bool edges_count(const LevelSet& host, const FeatureEdges& ridges);

// The same along the straight edge from `first` to `second` (m, in the host's space) of a deformable body:
// the lowest of its places where it crosses an edge of the host, or the one nearest to a round host, less
// than `margin` (m) away. Its surface points divide it into `parts`, 2 at least, which are as far apart as
// what the search looks at; `distance` is scratch that keeps its storage.
std::optional<EdgeContact> edge_contact_on(const Vec3& first, const Vec3& second, int parts,
                                           const LevelSet& host, double margin,
                                           std::vector<double>& distance);

}  // namespace duet
