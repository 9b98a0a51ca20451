/// Run directories of small scenes, for what reads runs.
#pragma once

#include <functional>

#include "sim/io/export/exported_run.h"

namespace duet::test {

/// Simulates the scene and records manifest.json and values/ of frames 0 to `last` in the folder. `change`
/// may change the values of a frame before they are written.
io::RunDirectory record_run(const scene::Scene& scene, int last, const io::fs::path& folder,
                            const std::function<void(io::FrameValues&)>& change = {});

/// Camera, lights and looks of the scene; bodies without a look wear the first, which is plain and gray.
io::ExportedLooks looks_of(const scene::Scene& scene, const io::Manifest& manifest);

/// A static floor, three boxes, of which two are alike, a kinematic ball, a soft box, a pinned cloth and a
/// rod, all in free fall but for what is held, around `center`.
scene::Scene one_of_each(const Vec3& center = Vec3::Zero());

}  // namespace duet::test
