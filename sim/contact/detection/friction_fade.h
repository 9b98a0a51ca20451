// Whether a point of a deformable body lies on a rigid surface or hangs on its edge.
#pragma once

#include "sim/state/bodies.h"

namespace duet {

// Where the rest of its body lies from a point of a volume: unit, or zero for points of shells and rods.
Vec3 inward_direction(const Bodies& bodies, const SurfacePoint& point);

// The share of friction that a contact of `point` has on a rigid surface with the unit outward `normal`: 1
// where the body lies on the surface, 0 where it goes through. The edge of a rigid body cuts into a coarse
// mesh, as it only touches points: a particle is left behind in front of a step that the rest of its elements
// have passed over, and what pulls it back presses it against the riser, within the cone of friction. It
// would stay there for good and the elements be drawn out to any length, while the body that the mesh stands
// for would slide around the edge. So friction ends where an edge of the boundary meets the surface at more
// than 30 to 45 degrees, where a face does, and where what surrounds a particle is as far behind it.
double lying_share(const Bodies& bodies, const SurfacePoint& point, const Vec3& normal);

// Of every particle those that share a tet with it.
ElementLists neighbours(std::size_t particles, const std::vector<Tet>& tets);

}  // namespace duet
