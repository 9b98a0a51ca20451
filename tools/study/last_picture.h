// Pictures of runs that wrote no meshes.
#pragma once

#include "tools/study/run_result.h"

namespace duet::study {

struct Drawing {
  fs::path file;
  double seconds = 0;  // processor time of a picture, all threads: the median of the repetitions
  double samples = 0;  // of pixels and shadow maps
};

// Draws the run's last frame into its image folder, `repetitions` times. Throws FileError when there is no
// library to draw with.
Drawing draw_last_frame(const RunResult& result, const Run& run, int width, int height, int repetitions);

}  // namespace duet::study
