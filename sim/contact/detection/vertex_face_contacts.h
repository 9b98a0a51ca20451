// Where the corners and bulges of a rigid body touch the boundary of a deformable one, between the points of
// its faces.
#pragma once

#include <limits>
#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/edge_contacts.h"

namespace duet {

// What a search has found so far at one corner or bulge of a host, in its space.
struct CornerSearch {
  int corner = -1;                                           // numbered as in FeatureEdges::corner_tree
  double squared = std::numeric_limits<double>::infinity();  // m^2, of the way
  Vec3 way = Vec3::Zero();                                   // m, from the nearest place to the corner
  Vec3 normal = Vec3::Zero();                                // unit, of the face there
  Vec3 weight = Vec3::Zero();                                // of its particles
  double size = 0;                                           // m, of the face
  int face = -1;
};
struct CornerSearches {  // scratch
  std::vector<CornerSearch> corners;
  std::vector<int> slot;  // of every corner of the host: which of these, or -1
};

// Whether corners or bulges of a host with these ridges can touch the faces of `guest`.
bool corners_count(const DeformableBody& guest, const FeatureEdges& ridges);

// Appends, for each corner of `host`, the nearest place on the boundary of `guest` if the corner is less than
// `margin` (m) outside of it, or no deeper inside than half the way between the points of the face, and the
// rest of the host lies on the outer side; on either side of a sheet. Its plane is the face's, or the host's
// own where that lies flat on it, at the corner; `node` is the number of the corner. The same for each bulge,
// which are numbered on from the corners. `host_bounds` are those of the host.
void find_places_at_corners(const Bodies& bodies, const DeformableBody& guest, const BodyBounds& host_bounds,
                            int host, double margin, CornerSearches& scratch,
                            std::vector<EdgeContact>& found);

// The normal at which `corner` of a host touches a plane with the unit normal `-toward`, the host being in
// the direction `inward` from there: `toward`, or the host's own where it lies flat on that plane. What else
// touches there acts along the normals of the host, and others that are nearly the same would be one
// constraint twice over, badly conditioned. In the host's space.
struct CornerNormal {
  Vec3 normal;  // unit
  bool is_hosts_own = false;
};
CornerNormal normal_at_corner(const LevelSet& host, const Vec3& corner, const Vec3& inward,
                              const Vec3& toward);

}  // namespace duet
