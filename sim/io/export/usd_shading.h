/// Looks, camera and lights as USD has them: text of prims.
#pragma once

#include <string>

#include "sim/io/export/tracks.h"
#include "sim/io/export/usd_text.h"

namespace duet::io {

/// A Material of the name `identifier` at `path` with a UsdPreviewSurface: color, metallic, roughness,
/// opacity.
std::string usd_material(const scene::Look& look, const std::string& identifier, const std::string& path);

/// A Camera whose picture is 24 mm high. Its focal length is 24 mm / (2 tan(vertical_fov / 2)); both are in
/// tenths of the stage's unit, as the schema says.
std::string usd_camera(const CameraTrack& track, const ExportedRun& run);

/// A SphereLight: both kinds of our lights shine alike in all directions, irradiance = power / (4 pi d^2) at
/// distance d. A sphere of radius r and radiance L gives pi r^2 L / d^2, and a light with `normalize` has L =
/// intensity / (4 pi r^2), so intensity = power / pi, whatever the radius. Distances grow by the export's
/// scale, and power by its square.
std::string usd_light(const scene::Light& light, const std::string& identifier, const ExportedRun& run);

/// Types and names of the attributes of a pose, and the line that gives their order.
inline constexpr const char* usd_translate = "double3 xformOp:translate";
inline constexpr const char* usd_orient = "quatd xformOp:orient";
inline constexpr const char* usd_transform_order =
    "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n";

/// Transform of a prim at the frames: translation and orientation in double precision, and their order.
std::string usd_transform(const std::string& indent, const std::vector<int>& frames, const PoseTrack& track);

}  // namespace duet::io
