/// The formats that `duet export` writes, one function each, in a .cpp of the format's name.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"
#include "sim/io/export/staging.h"

namespace duet::io {

/// What is asked of a format beyond the run.
struct FormatOptions {
  bool compress = false;        ///< smaller files where the format knows how
  std::uint64_t max_bytes = 0;  ///< refuse to write more; 0: the format's own bound
};

/// What a format could not carry over, in sentences for the user. They may be many runs' worth: one a kind.
using ExportNotes = std::vector<std::string>;

/// One animated glTF 2.0 binary (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html): rigid bodies as
/// nodes with keyed transforms, deformable bodies as morph targets, materials, camera, lights. Throws Error.
ExportNotes export_glb(const ExportedRun& run, const FormatOptions& options, const fs::path& file);

/// A USD stage as text (.usda) with time samples, in a folder with what it refers to. Throws Error.
ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// Tables of where the rigid bodies are and how they move: transforms.json and transforms.csv in the folder,
/// with all digits of the doubles. Throws Error, also (usage) where no body is rigid.
ExportNotes export_transforms(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// An OBJ file a frame, 0000.obj, with all digits of the positions, and materials.mtl. Throws Error.
ExportNotes export_obj(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// A binary PLY file a frame, 0000.ply, with positions in double precision, normals, texture coordinates,
/// velocities, strain and the index of the body at the vertices. Throws Error.
ExportNotes export_ply(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// For each body NAME.pc2 (3ds Max, Blender), or NAME.mdd (LightWave), and NAME.obj, the mesh at the first
/// frame whose vertices the cache moves, or the OBJ file that the body was made of, as it is; export.json
/// says which, and relative to which origin. Throws Error.
ExportNotes export_pc2(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);
ExportNotes export_mdd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

/// VTK poly data, 0000.vtp a frame, and run.pvd with the times; FormatOptions::compress by zlib. Throws
/// Error.
ExportNotes export_vtk(const ExportedRun& run, const FormatOptions& options, const fs::path& folder);

}  // namespace duet::io
