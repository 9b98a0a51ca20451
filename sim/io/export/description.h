// Parts that the exports of a run share: a description of the run as JSON, OBJ materials, and file names
// that are safe on all systems.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/io/export/exported_run.h"

namespace duet::io {

namespace fs = std::filesystem;

/// Returns a description of the exported run without the motion of its bodies. It has "format", "program",
/// "title", "fps", "first_frame", "last_frame", "missing_frames", "up", "units_per_meter", "bodies" (name,
/// kind and look, in the order of the run), "looks" (colors in linear RGB), "camera" (angles in degrees)
/// and "lights". Lengths are in the unit of the export, vectors in its axes; powers of lights are those of
/// the scene. A camera that moves has "motion": its view at each frame from the first to the last. Without
/// ExportedRun::looks() there are no looks, camera and lights.
nlohmann::ordered_json description(const ExportedRun& run, std::string_view format);

/// Writes the object to the file, indented. Bytes that are not UTF-8 become U+FFFD. Throws FileError.
void write_json(const nlohmann::ordered_json& object, const fs::path& path);

/// Returns a file name for each name, in the same order. ASCII letters, digits, underscores, hyphens and
/// full stops stay; each other byte becomes an underscore. The results differ from each other even without
/// regard to case, have at most about 100 bytes, do not begin with a full stop or a hyphen, and are not
/// device names of Windows.
std::vector<std::string> safe_names(const std::vector<std::string>& names);

/// Returns safe_names() of the exported bodies.
std::vector<std::string> safe_body_names(const ExportedRun& run);

/// Writes the looks as a library of OBJ materials, named by material_names(). `more` are further names of
/// materials, each with the index of its look. Throws FileError.
void write_materials(const ExportedRun& run, const fs::path& path,
                     const std::vector<std::pair<std::string, int>>& more = {});

/// Returns safe_names() of the looks, one for each look.
std::vector<std::string> material_names(const ExportedRun& run);

/// Returns sentences that say what materials of one color leave out of the looks of the exported bodies:
/// patterns and spots. The result is empty if nothing is left out.
std::vector<std::string> notes_on_looks(const ExportedRun& run);

}  // namespace duet::io
