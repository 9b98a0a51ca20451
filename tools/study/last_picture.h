// Pictures of runs that wrote no meshes.
#pragma once

#include "tools/study/run_result.h"

namespace duet::study {

// Draws the run's last frame into its image folder, unless it is there; returns the file. Throws FileError
// when there is no library to draw with.
fs::path draw_last_frame(const RunResult& result, const Run& run, int width, int height);

}  // namespace duet::study
