// The camera and the lamp of scenes that give none.
#pragma once

#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

// Returns the scene with what a picture needs and its file leaves out, by the boxes around the bodies of the
// manifest at frame 0 (m):
//   camera   without [camera]: looks slightly down on what moves, on its way of the first 2 s as it starts,
//            and on the ground below that
//   lamp     without [[lights]] and [sky]: one, behind the camera to its left
// What moves is all bodies that are not static, or all where everything is. A scene that gives both, and the
// run of a program that wrote no boxes, come back as they are.
scene::Scene with_default_view(scene::Scene scene, const io::Manifest& manifest);

}  // namespace duet::render
