// Camera and lamp of scenes that describe none.
#pragma once

#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

/// Returns `scene` with a camera and a lamp where its file gives none. Both follow from the boxes around the
/// moving bodies at frame 0, which `manifest` holds (m, world frame); moving bodies are all that are not
/// static, or all bodies if every one is static.
/// - The camera is added without [camera]. It looks slightly down on the moving bodies, on the place that
/// they reach at their first velocities within 2 s (or until they have passed through the other bodies), on
/// the places of kinematic motions, and on the ground below them, as near as all of it fits into the picture.
/// - The lamp is added without [[lights]] and [sky]. It stands behind the camera, to its left.
///
/// A scene that has both comes back unchanged. So does one whose manifest holds no boxes of a finite size:
/// old runs hold none.
scene::Scene with_default_view(scene::Scene scene, const io::Manifest& manifest);

}  // namespace duet::render
