// How the level set of a rigid shape is sampled for its file.
#pragma once

#include "sim/geometry/level_set.h"

namespace duet {

/// Signed distance (m) from the surface of `shape`, `x` in body space. That of a mesh is the distance to its
/// triangles: in the grid of LevelSet::distance, a wall thinner than a cell may have no inside.
double exported_distance(const LevelSet& shape, const Vec3& x);

/// Size of the voxels (m): fine enough for the thickness of `shape`, and bounded from below so that the
/// number of voxels follows the surface, however thin the body is. Not for the half space.
double exported_voxel_size(const LevelSet& shape);

}  // namespace duet
