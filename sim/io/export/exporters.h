// The formats that `duet export` writes: one function each, most in a .cpp of the format's name.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"
#include "sim/io/export/staging.h"

namespace duet::io {

/// Options of the user for a format.
struct FormatOptions {
  bool compress = false;  ///< true: files are compressed; formats without a compressed form ignore it
  /// Size beyond which nothing is written, bytes. 0: the bound of the format, 2e9 for GLB and none for USD.
  /// Other formats ignore it.
  std::uint64_t max_bytes = 0;
  /// Width of the voxels of the level sets of deformable bodies, m; 0: they have none. For VDB alone.
  double voxel = 0;
};

/// Sentences for the user that say what a format could not carry over, one for each kind of loss.
using ExportNotes = std::vector<std::string>;

/// Writes one animated binary file of glTF 2.0 (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html).
/// Rigid bodies are nodes with keyed transforms, deformable bodies have morph targets; materials, camera
/// and lights are included. Throws Error (usage) if the file would exceed its bound, before anything is
/// written. Throws FileError.
ExportNotes export_glb(const ExportedRun& run, const FormatOptions& options, const fs::path& file);

/// Writes a USD stage as text (.usda), in a folder with the files that it refers to. Long runs, and all with
/// FormatOptions::compress, have the values of each frame in a binary file of value clips (.usdc).
/// Throws Error (usage) once it exceeds FormatOptions::max_bytes, and FileError.
ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes tables of the poses and velocities of rigid bodies: transforms.json and transforms.csv, with all
/// digits of the doubles. Throws Error (usage) if no body is rigid, and FileError.
ExportNotes export_transforms(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes an OBJ file a frame, 0000.obj, with all digits of the positions, and materials.mtl. Bodies that
/// were made of OBJ files are written as these files, with other positions. Throws FileError.
ExportNotes export_obj(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes a binary PLY file a frame, 0000.ply. Its vertices have positions in double precision, normals,
/// texture coordinates, velocities, strain and the index of the body. Throws Error (usage) if there are
/// more vertices than the format can count, and FileError.
ExportNotes export_ply(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes for each body a point cache NAME.pc2 (3ds Max, Blender) and the mesh NAME.obj whose vertices it
/// moves. The mesh is that of the first frame, or a copy of the OBJ file that the body was made of;
/// export.json says which, and gives the origin of the cache's coordinates. Throws FileError.
ExportNotes export_pc2(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes the same files as export_pc2(), with caches NAME.mdd (LightWave) instead of NAME.pc2. Throws
/// FileError.
ExportNotes export_mdd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes VTK poly data, 0000.vtp for each frame, and run.pvd with their times. FormatOptions::compress
/// compresses by zlib. Throws Error (usage) if there are more vertices than 2^31, and FileError.
ExportNotes export_vtk(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Writes level sets as OpenVDB files, run.usda, a USD stage that moves them, and the files of
/// export_transforms(). shapes/NAME.vdb has the grid of a rigid body in the axes of its pose; bodies of one
/// shape share it. With FormatOptions::voxel, frames/NAME.0000.vdb has that of a deformable body at a frame,
/// in the axes of the export. Each file has one grid, called "surface". Throws Error (usage) if no body has a
/// level set, or one would have too many voxels, and FileError.
ExportNotes export_vdb(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

}  // namespace duet::io
