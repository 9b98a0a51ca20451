// Exports a run as a Blender scene, which Blender itself makes by tools/blender/duet_import.py.
#pragma once

#include <filesystem>

#include "sim/io/export/exporters.h"

namespace duet::tools {

/// Runs the program `blender`, which must be in PATH, and writes the run as a .blend file to `path`.
///
/// The caches of deformable bodies, which the file refers to, and the looks are in RUN/export/blender. The
/// whole run is imported: no part, axis and unit can be chosen. Throws Error (files) if Blender is missing or
/// fails, and Interrupted.
io::ExportNotes export_blend(const io::ExportedRun& run, const io::FormatOptions& options,
                             const std::filesystem::path& path);

/// Returns whether a file begins as Blender's files do, plain or compressed.
bool is_blend(const std::filesystem::path& path);

}  // namespace duet::tools
