// Draws the last frame of runs that wrote no meshes.
#pragma once

#include "tools/study/run_result.h"

namespace duet::study {

// A picture and what it cost.
struct Drawing {
  fs::path file;  // PNG file
  // Processor time of a picture over all threads: median of the repetitions; 0 without any.
  double seconds = 0;
  double samples = 0;  // pixel samples, times one plus the number of shadow maps
};

// Draws the last frame into image/last.png of the run's folder, once and then `repetitions` times for the
// clock. Throws FileError if there is no library to draw with.
Drawing draw_last_frame(const RunResult& result, const Run& run, int width, int height, int repetitions);

}  // namespace duet::study
