// Friction fade at edges: tells whether a point of a deformable body lies on a rigid surface or hangs on its
// edge, and reduces friction there.
#pragma once

#include "sim/state/bodies.h"

namespace duet {

/// Returns the direction (unit, world) from a point of a volume to the rest of its body: along the mean
/// displacement to the neighbors of its particles. It is zero for points of shells and rods.
Vec3 inward_direction(const Bodies& bodies, const SurfacePoint& point);

/// Returns the fraction of friction, from 0 to 1, that a contact of `point` keeps on a rigid surface with the
/// outward unit normal `normal`: 1 if the body lies on the surface, 0 if it goes through.
///
/// The edge of a rigid body cuts into a coarse mesh, because contact acts on its points alone: a particle is
/// left behind in front of a step that the rest of its elements have passed over. The force that pulls it
/// back presses it against the riser, within the friction cone. With full friction it would stay there for
/// good and its elements be stretched to any length, while the body that the mesh stands for would slide
/// around the edge. So friction fades out between 30 and 45 degrees: of the angle between an edge of the
/// boundary and the surface, of that between a face and the surface, or for a particle of the angle by which
/// inward_direction() leads behind the surface.
double friction_fade_fraction(const Bodies& bodies, const SurfacePoint& point, const Vec3& normal);

/// Returns for every one of `particles` particles those that share a tetrahedron with it, in ascending order
/// and without itself.
ElementLists neighbors(std::size_t particles, const std::vector<Tet>& tets);

}  // namespace duet
