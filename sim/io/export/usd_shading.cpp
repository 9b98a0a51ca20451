#include "sim/io/export/usd_shading.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/base/elementary.h"

namespace duet::io {
namespace {

// Returns the tangent of an angle, rad. It has the same bits on every processor (elementary.h).
double tangent(double angle) { return math::sin(angle) / math::cos(angle); }

// Returns the metadata "(displayName = ...)" of a prim; empty if the identifier is the name.
std::string metadata(const std::string& name, const std::string& identifier) {
  const std::string text = usd_display_name(name, identifier);
  return text.empty() ? text : fmt::format(" (\n            {}\n        )", text);
}

}  // namespace

std::string usd_material(const scene::Look& look, const std::string& identifier, const std::string& path) {
  constexpr const char* form = R"(
        def Material "{0}"{1}
        {{
            token outputs:surface.connect = <{2}/{0}/surface.outputs:surface>

            def Shader "surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor = {3}
                float inputs:metallic = {4}
                float inputs:roughness = {5}
                float inputs:opacity = {6}
                token outputs:surface
            }}
        }}
)";
  return fmt::format(form, identifier, metadata(look.name, identifier), path, usd_tuple(look.color),
                     look.metallic, look.roughness, look.opacity);
}

std::string usd_transform(const std::string& indent, const std::vector<int>& frames, const PoseTrack& track) {
  UsdSamples translate, orient;
  for (std::size_t i = 0; i < track.positions.size(); ++i) {
    translate.add(frames[i], usd_tuple(track.positions[i]));
    orient.add(frames[i], usd_tuple(track.orientations[i]));
  }
  return translate.text(indent, usd_translate) + orient.text(indent, usd_orient) + indent +
         usd_transform_order;
}

std::string usd_stage_head(const ExportedRun& run) {
  const Manifest& manifest = run.manifest();
  return fmt::format(
      "#usda 1.0\n(\n    customLayerData = {{\n        string generator = {}\n"
      "        string title = {}\n        int[] missingFrames = {}\n    }}\n"
      "    defaultPrim = \"run\"\n    endTimeCode = {}\n    framesPerSecond = {}\n"
      "    metersPerUnit = {}\n    startTimeCode = {}\n    timeCodesPerSecond = {}\n"
      "    upAxis = \"{}\"\n)\n\n",
      usd_string(program_text(manifest.origin)), usd_string(manifest.title), usd_array(run.missing()),
      run.frames().back(), manifest.fps, 1 / run.scale(), run.frames().front(), manifest.fps,
      run.up() == 'z' ? 'Z' : 'Y');
}

std::string usd_camera(const CameraTrack& track, const ExportedRun& run) {
  constexpr double height = 0.024;  // height of the picture, m: that of a 35 mm film
  // Clipping planes relative to the least and to the greatest distance of the target. A nearer range cuts
  // off bodies, a wider one costs precision of depth buffers.
  constexpr double nearest = 0.01, farthest = 1e4;
  const double tenths = 10 * run.scale();  // tenths of the stage's unit in a meter
  const ExportedLooks& looks = run.looks();
  UsdSamples focal_length, focus_distance;
  double near_target = track.target_distances.front(), far_target = near_target;
  for (std::size_t i = 0; i < track.vertical_fov.size(); ++i) {
    const double length = tenths * height / (2 * tangent(track.vertical_fov[i] / 2));
    focal_length.add(run.frames()[i], fmt::format("{}", length));
    focus_distance.add(run.frames()[i], fmt::format("{}", track.target_distances[i]));
    near_target = std::min(near_target, track.target_distances[i]);
    far_target = std::max(far_target, track.target_distances[i]);
  }
  std::string text = "\n    def Camera \"camera\"\n    {\n";
  const std::string indent(8, ' ');
  text += fmt::format("{}float2 clippingRange = ({}, {})\n", indent, nearest * near_target,
                      farthest * far_target);
  text +=
      fmt::format("{}float horizontalAperture = {}\n", indent, tenths * height * looks.width / looks.height);
  text += fmt::format("{}float verticalAperture = {}\n", indent, tenths * height);
  text += focal_length.text(indent, "float focalLength") + focus_distance.text(indent, "float focusDistance");
  return text + usd_transform(indent, run.frames(), track.poses) + "    }\n";
}

std::string usd_light(const scene::Light& light, const std::string& identifier, const ExportedRun& run) {
  // A point light becomes a ball whose radius is this fraction of the distance to its target: too small to
  // be seen from there. The radius does not change the light's intensity.
  constexpr double point = 1e-4;
  const bool is_area = light.kind == scene::LightKind::area;
  const double radius = is_area ? light.radius : point * (light.target - light.position).norm();
  constexpr const char* form = R"(
        def SphereLight "{}"{}
        {{
            color3f inputs:color = {}
            float inputs:intensity = {}
            bool inputs:normalize = 1
            float inputs:radius = {}
{}            double3 xformOp:translate = {}
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
)";
  return fmt::format(form, identifier, metadata(light.name, identifier), usd_tuple(light.color),
                     light.power * run.scale() * run.scale() / std::numbers::pi, run.scale() * radius,
                     is_area ? "" : "            bool treatAsPoint = 1\n",
                     usd_tuple(Vec3(run.scale() * (run.axes() * light.position))));
}

}  // namespace duet::io
