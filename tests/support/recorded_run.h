// Run directories of small scenes, to test code that reads runs.
#pragma once

#include <functional>

#include "sim/io/export/exported_run.h"

namespace duet::test {

// Simulates a scene and records manifest.json and values/ of the frames 0 to `last` in `folder`. `change` may
// alter the values of a frame before they are written.
io::RunDirectory record_run(const scene::Scene& scene, int last, const io::fs::path& folder,
                            const std::function<void(io::FrameValues&)>& change = {});

// Returns camera, lights and looks of the scene. Bodies without a look have the first one, which is plain and
// gray.
io::ExportedLooks looks_of(const scene::Scene& scene, const io::Manifest& manifest);

// Returns a scene with one body of each kind around `center` (m): a static floor, three boxes of which two
// are alike, a kinematic ball, a soft box, a pinned cloth and a pinned rod. Bodies that are not held fall
// freely.
scene::Scene one_of_each(const Vec3& center = Vec3::Zero());

}  // namespace duet::test
