#include "tools/study/last_picture.h"

#include <fmt/format.h>

#include "render/sequence.h"
#include "sim/io/files.h"

namespace duet::study {

fs::path draw_last_frame(const RunResult& result, const Run& run, int width, int height) {
  const io::RunDirectory directory{run.folder};
  const fs::path file = run.folder / "image" / fmt::format("last-{}x{}.png", width, height);
  if (fs::exists(file)) return file;
  scene::Scene scene = result.scene;
  scene.render.width = width;
  scene.render.height = height;
  render::SequenceRenderer renderer(scene, io::read_manifest(directory));
  std::vector<BodySurface> surfaces;
  result.simulation->surfaces(surfaces);
  render::write_png(file.string(), width, height, renderer.draw(surfaces));
  return file;
}

}  // namespace duet::study
