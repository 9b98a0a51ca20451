// Which plane of a body's surface another body's point rests against.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

struct ContactPlane {
  Vec3 normal;     // unit, outward of the shape
  double gap = 0;  // m, signed distance of the point from the plane
  Vec3 foot;       // m, point of the surface that has the normal
  // Whether the other body lies on the outer side. Where it does not, the point is beside an edge over which
  // the body reaches, or level with it, so that the body slides over it; it touches nothing.
  bool faces = true;
  int continued_by = -1;  // the body whose surface goes on from a hidden foot, see exposed_plane(); or -1
};

// Whether a body faces a surface of unit normal `normal`: the angle between the normal and `way`, the way (m)
// from a point on the body's surface into it, is below 73 degrees. From a box's corner it is 55 degrees.
bool faces(const Vec3& normal, const Vec3& way);

// The nearest surface of a level set tells little about a point near an edge: a corner that stands a
// millimetre inside the rim of a table and a hundredth of one deeper is nearest to the table's side, and
// would be pushed off. So the plane is looked for from `inside`, a point of the other body some way in from
// `x`, where the side on which that body lies is plain; bodies thinner than this way are then left by the
// face through which they were entered. Where x is not opposite the surface so found (beside an edge), the
// nearest surface counts. Both points in the shape's body space.
ContactPlane contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside);

// The same with LevelSet::exact(): the foot is on the surface also where it is far from `inside`.
ContactPlane exact_contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside);

}  // namespace duet
