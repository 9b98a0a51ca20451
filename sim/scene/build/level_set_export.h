// Chooses the voxels by which the level set of a rigid shape is sampled for its file.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

/// Returns the size of the voxels (m). It is fine enough for the thickness of `shape`, and has a lower bound
/// so that the number of voxels is limited however thin the body is. `shape` must not be the half space.
double exported_voxel_size(const LevelSet& shape);

}  // namespace duet
