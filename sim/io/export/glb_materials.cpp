#include "sim/io/export/glb_materials.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace duet::io {
namespace {

// Clamps to [0, 1], the range that glTF allows.
double unit(double x) { return std::clamp(x, 0.0, 1.0); }

}  // namespace

Json gltf_material(const scene::Look& look, double scale) {
  Json material = {{"name", look.name}};
  material["pbrMetallicRoughness"] = {
      {"baseColorFactor",
       {unit(look.color.x()), unit(look.color.y()), unit(look.color.z()), unit(look.opacity)}},
      {"metallicFactor", unit(look.metallic)},
      {"roughnessFactor", unit(look.roughness)}};
  if (look.opacity < 1) material["alphaMode"] = "BLEND";
  if (!look.pattern.empty())
    material["extras"] = {{"pattern", look.pattern},
                          {"color2", json_of(look.color2)},
                          {"pattern_size", scale * look.pattern_size}};
  return material;
}

Json gltf_light(const scene::Light& light, double scale) {
  // The channels of a color are at most 1 in glTF. If one is larger, the color is divided by it and the
  // intensity is multiplied.
  const double brightest = std::max(light.color.maxCoeff(), 1.0);
  const Vec3 color = light.color.cwiseMax(0) / brightest;
  return {{"name", light.name},
          {"type", "point"},
          {"color", json_of(color)},
          {"intensity", std::max(light.power, 0.0) * brightest * scale * scale / (4 * std::numbers::pi)}};
}

Json gltf_camera(const CameraTrack& track, const ExportedLooks& looks) {
  // Distance of the near plane, relative to the least distance of the target. A larger value cuts off
  // bodies near the camera, a smaller one costs precision of the depth buffer.
  constexpr double nearest = 0.01;
  double distance = *std::min_element(track.target_distances.begin(), track.target_distances.end());
  if (!(distance > 0)) distance = 1;
  return {{"name", "camera"},
          {"type", "perspective"},
          {"perspective",
           {{"aspectRatio", static_cast<double>(looks.width) / looks.height},
            {"yfov", track.vertical_fov.front()},
            {"znear", nearest * distance}}}};
}

}  // namespace duet::io
