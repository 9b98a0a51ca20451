// Looks, camera, lights and poses in the text format of USD.
#pragma once

#include <string>

#include "sim/io/export/tracks.h"
#include "sim/io/export/usd_text.h"

namespace duet::io {

/// Returns a Material with a UsdPreviewSurface of the look's color, metallic, roughness and opacity. Its
/// prim is called `identifier`, and `path` is that of the prim around it.
std::string usd_material(const scene::Look& look, const std::string& identifier, const std::string& path);

/// Returns the beginning of a stage: axes, unit, frames and their rate, title and missing frames of the run.
/// Its default prim is "run".
std::string usd_stage_head(const ExportedRun& run);

/// Returns a Camera whose focal length is 24 mm / (2 tan(vertical_fov / 2)), with a picture 24 mm high.
/// Both are written in tenths of the stage's unit, as the schema of UsdGeomCamera demands.
std::string usd_camera(const CameraTrack& track, const ExportedRun& run);

/// Returns a SphereLight with `normalize`: intensity = power scale^2 / pi. Both kinds of our lights give
/// the irradiance power / (4 pi d^2) at distance d, alike in all directions. A sphere of radius r and
/// radiance L gives pi r^2 L / d^2, and `normalize` makes L = intensity / (4 pi r^2), so the radius has no
/// influence on the intensity. Distances grow by the scale of the export, and power by its square.
std::string usd_light(const scene::Light& light, const std::string& identifier, const ExportedRun& run);

/// Type and name of the attribute of a prim's translation.
inline constexpr const char* usd_translate = "double3 xformOp:translate";
/// Type and name of the attribute of a prim's orientation.
inline constexpr const char* usd_orient = "quatd xformOp:orient";
/// Line that gives the order in which translation and orientation act.
inline constexpr const char* usd_transform_order =
    "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n";

/// Returns the attributes of a prim that moves along `track`: translation and orientation in double
/// precision, and their order. Pose i of the track belongs to frames[i]. Each line begins with `indent`.
std::string usd_transform(const std::string& indent, const std::vector<int>& frames, const PoseTrack& track);

}  // namespace duet::io
