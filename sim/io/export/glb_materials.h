/// Looks, camera and lights as glTF has them.
#pragma once

#include "sim/io/export/exporters.h"
#include "sim/io/export/glb_document.h"
#include "sim/io/export/tracks.h"

namespace duet::io {

/// A material of the core specification: base color, metallic, roughness, opacity as alpha.
Json gltf_material(const scene::Look& look);

/// A light of KHR_lights_punctual, for a node at the light's position. Both kinds of our lights shine alike
/// in all directions: irradiance = power / (4 pi d^2) at distance d, facing the light. A point light of glTF
/// has the illuminance intensity / d^2, so intensity = power / (4 pi), with radiometric units in place of
/// photometric ones. `scale`: units of the export in a meter; distances grow by it, and power by its square.
Json gltf_light(const scene::Light& light, double scale);

/// A perspective camera with the picture's shape that sees from a hundredth of the distance of its target on.
Json gltf_camera(const CameraTrack& track, const ExportedLooks& looks);

}  // namespace duet::io
