/// What the exports of a run share: a description of the run as JSON, and names that are safe in all systems.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/io/export/exported_run.h"

namespace duet::io {

namespace fs = std::filesystem;

/// The exported run without the motion of its bodies: "format", "program", "title", "fps", "first_frame",
/// "last_frame", "missing_frames", "up", "units_per_meter", "bodies" (name, kind and look, in the order of
/// the run), "looks" (colors in linear RGB), "camera" and "lights", these in the axes and unit of the export.
/// A camera that moves has "motion", where it is at each frame from the first to the last one. Powers are
/// those of the scene.
nlohmann::ordered_json description(const ExportedRun& run, std::string_view format);

/// Writes the object to the file, indented. Throws FileError.
void write_json(const nlohmann::ordered_json& object, const fs::path& path);

/// Names of files for the names, one each: letters, digits, `_`, `-` and `.` stay, all else becomes `_`. They
/// differ also where upper and lower case are the same, do not begin with `.` or `-`, and are no names that
/// Windows keeps for devices.
std::vector<std::string> safe_names(const std::vector<std::string>& names);
std::vector<std::string> safe_body_names(const ExportedRun& run);

/// Writes the looks as a library of OBJ materials, named by material_names. Throws FileError.
/// `more` are further names, each with the index of its look.
void write_materials(const ExportedRun& run, const fs::path& path,
                     const std::vector<std::pair<std::string, int>>& more = {});
std::vector<std::string> material_names(const ExportedRun& run);  ///< one a look

/// What OBJ materials, and any other format of plain colors, leave out of the looks of the exported bodies.
std::vector<std::string> notes_on_looks(const ExportedRun& run);

}  // namespace duet::io
