#include "tools/study/last_picture.h"

#include <algorithm>

#include <time.h>

#include "render/sequence.h"
#include "sim/io/run_directory.h"

namespace duet::study {
namespace {

// Returns the processor time of this process so far, over all threads.
double processor_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

Drawing draw_last_frame(const RunResult& result, const Run& run, int width, int height, int repetitions) {
  const io::RunDirectory directory{run.folder};
  scene::Scene scene = result.scene;
  scene.render.width = width;
  scene.render.height = height;
  render::SequenceRenderer renderer(scene, io::read_manifest(directory));
  std::vector<BodySurface> surfaces;
  result.simulation->surfaces(surfaces);
  // Not timed, because the first one also fills caches.
  std::vector<unsigned char> rgb = renderer.draw(surfaces);
  std::vector<double> seconds;
  for (int i = 0; i < repetitions; ++i) {
    const double start = processor_seconds();
    rgb = renderer.draw(surfaces);
    seconds.push_back(processor_seconds() - start);
  }
  Drawing drawing;
  drawing.file = run.folder / "image" / "last.png";
  render::write_png(drawing.file.string(), width, height, rgb);
  std::sort(seconds.begin(), seconds.end());
  if (!seconds.empty()) drawing.seconds = seconds[seconds.size() / 2];
  const double pixel_samples = scene.render.supersampling * scene.render.supersampling;
  drawing.samples = width * height * pixel_samples * (1 + scene.render.shadow_samples);
  return drawing;
}

}  // namespace duet::study
