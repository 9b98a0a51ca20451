// Level sets of the bodies of a run: those of rigid bodies as the run has them, in the axes of the body, and
// those of deformable bodies from their surfaces at a frame.
#pragma once

#include <vector>

#include <openvdb/openvdb.h>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// Name of the grid in each file of an export: the customary name of a level set.
inline constexpr const char* vdb_grid_name = "surface";

/// The level set of the shape of one or more rigid bodies.
struct ShapeGrid {
  std::size_t body = 0;          ///< first exported body with the shape, an index in ExportedRun::bodies()
  openvdb::FloatGrid::Ptr grid;  ///< in the axes of the body's pose and the unit of the export
};

/// The level sets of all exported rigid bodies.
struct ShapeGrids {
  std::vector<ShapeGrid> shapes;  ///< one for each shape
  /// For each exported body the index of its shape in `shapes`; -1 for deformable bodies.
  std::vector<int> of_body;
};

/// Reads the level sets of the exported rigid bodies from levelset/, at the first exported frame that has
/// them. Bodies whose voxels the run shares have one shape. Throws FileError if they are missing or damaged,
/// or belong to other poses than those of values/.
ShapeGrids read_shape_grids(const ExportedRun& run);

/// Returns true if every edge of the surface joins an even number of its triangles, so that it has an inside.
bool has_inside(const Surface& surface);

/// Returns about how many voxels the narrow band of the level set of a surface has.
double band_voxels(const Surface& surface, double voxel);

/// Returns the level set of a closed surface, with voxels of the width `voxel` in the unit of the surface, in
/// a band of three voxels on either side. Parts that are thinner than a voxel may be lost.
openvdb::FloatGrid::Ptr surface_grid(const Surface& surface, double voxel);

}  // namespace duet::io
