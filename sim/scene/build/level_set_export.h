// How the level set of a rigid shape is sampled for its file.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

/// Size of the voxels (m): fine enough for the thickness of `shape`, and bounded from below so that the
/// number of voxels follows the surface, however thin the body is. Not for the half space.
double exported_voxel_size(const LevelSet& shape);

}  // namespace duet
