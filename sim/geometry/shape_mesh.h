// Points and triangles of analytic shapes: contact samples for the simulator, surfaces for pictures and
// export.
#pragma once

#include <vector>

#include "sim/geometry/level_set.h"
#include "sim/geometry/surface.h"

namespace duet {

// Points on the surface of a box that are tested against other bodies' level sets: a lattice of `intervals`
// intervals along every edge, on faces, edges and corners alike. Spheres have none: their deepest point is
// known (see contact_candidates.h).
std::vector<Vec3> surface_samples(const LevelSet& shape, int intervals = 8);

// The render surface in body space: flat faces for the box (normals by face), latitudes and longitudes for
// the sphere.
Surface shape_surface(const LevelSet& shape);

}  // namespace duet
