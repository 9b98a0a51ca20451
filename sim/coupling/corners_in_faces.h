// Where the corners of a rigid body touch the boundary of a deformable one, between the points of its faces.
#pragma once

#include <limits>
#include <vector>

#include "sim/coupling/body_bounds.h"
#include "sim/coupling/lowest_places.h"

namespace duet {

// What a search has found so far at one corner of a host; scratch.
struct CornerSearch {
  int corner = -1;                                           // of the host's
  Vec3 x = Vec3::Zero(), inward = Vec3::Zero();              // m, and unit: into the host
  double squared = std::numeric_limits<double>::infinity();  // m^2, of the way
  Vec3 way = Vec3::Zero();                                   // m, from the nearest place to x
  Vec3 normal = Vec3::Zero();                                // unit, of the face there
  Vec3 weight = Vec3::Zero();                                // of its particles
  int face = -1;
};

// Whether corners of a host with these ridges can touch the faces of `guest`.
bool corners_count(const DeformableBody& guest, const Ridges& ridges);

// Appends, for each corner of `host`, the nearest place on the boundary of `guest` if the corner is less than
// `margin` (m) outside of it, or no deeper inside than the points of the face are apart, and the rest of the
// host lies on the outer side; on either side of a sheet. Its plane is the face's, or the host's own where
// that lies flat on it, at the corner; `node` is the number of the corner. `bounds` are those of the guest.
void find_places_at_corners(const Bodies& bodies, const DeformableBody& guest, const BodyBounds& bounds,
                            int host, double margin, std::vector<CornerSearch>& scratch,
                            std::vector<NearRidge>& found);

}  // namespace duet
