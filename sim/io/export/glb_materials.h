// Looks, camera and lights in the form of glTF.
#pragma once

#include "sim/io/export/exporters.h"
#include "sim/io/export/glb_document.h"
#include "sim/io/export/tracks.h"

namespace duet::io {

/// Returns a material of the core specification: base color, metallic, roughness, and opacity as alpha,
/// each clamped to [0, 1]. A pattern is not drawn, and is described in `extras`, with the size of its cells
/// in the unit of the export. `scale` is the units of the export in a meter.
Json gltf_material(const scene::Look& look, double scale);

/// Returns a point light of KHR_lights_punctual, for a node at the light's position: intensity = power
/// scale^2 / (4 pi). Both kinds of our lights give the irradiance power / (4 pi d^2) at distance d, facing
/// the light, and a point light of glTF gives the illuminance intensity / d^2. Radiometric units take the
/// place of photometric ones. `scale` is the units of the export in a meter: distances grow by it, and
/// power by its square.
Json gltf_light(const scene::Light& light, double scale);

/// Returns a perspective camera with the picture's aspect ratio and the field of view at the first frame.
/// Its near plane lies at a hundredth of the least distance of the target.
Json gltf_camera(const CameraTrack& track, const ExportedLooks& looks);

}  // namespace duet::io
