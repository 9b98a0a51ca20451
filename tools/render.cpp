// `duet render`: draws frames of a run directory.
#include <algorithm>
#include <array>
#include <chrono>

#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/io/run_folder.h"
#include "sim/io/run_journal.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Throws Error (usage) unless the key belongs to pictures alone. Motion cannot be changed any more: it is in
// the meshes.
void require_picture_key(const std::string& override_text) {
  static constexpr std::array<std::string_view, 5> tables = {"camera.", "lights.", "looks.", "render.",
                                                             "sky."};
  if (std::any_of(tables.begin(), tables.end(), [&](auto table) { return override_text.starts_with(table); }))
    return;
  throw Error(ExitStatus::usage,
              fmt::format("--set {}: changes no picture of a run that is simulated already (keys of "
                          "camera, lights, looks, render and sky do; for others: `duet run`)",
                          override_text));
}

// Throws FileError if a mesh that the journal lists is gone or has another size: the video would have a gap
// there, or show an older picture. The bytes are compared later, when the mesh is drawn.
void require_listed_meshes(const io::RunDirectory& run, int last) {
  if (!run.journal) return;
  for (const auto& [name, entry] : run.journal->entries()) {
    const int frame = fs::path(name).parent_path() == "mesh" ? io::frame_of_file(name, ".obj") : -1;
    if (frame < 0 || frame > last || entry.state != io::RunJournal::Entry::State::whole) continue;
    std::error_code missing;
    if (fs::file_size(run.mesh(frame), missing) != entry.mark.bytes) run.require_whole(run.mesh(frame));
  }
}

// Returns the frames to draw, sorted. `last` is the last frame of the run.
std::vector<int> frames_to_draw(const RenderOptions& options, const io::RunDirectory& run, int last) {
  std::vector<int> frames;
  if (options.frames) {  // a missing frame that was asked for is an error when it is read
    for (int frame = options.frames->first.value_or(options.frames->last); frame <= options.frames->last;
         ++frame)
      frames.push_back(frame);
    return frames;
  }
  for (const fs::path& file : io::files_in(run.mesh(0).parent_path()))
    if (const int frame = io::frame_of_file(file, ".obj"); frame >= 0 && frame <= last)
      frames.push_back(frame);
  std::sort(frames.begin(), frames.end());
  require_listed_meshes(run, last);
  if (frames.empty())
    throw FileError((run.root / "mesh").string(), "has no frames", "simulate the scene first: `duet sim`");
  return frames;
}

// Removes the frames whose pictures are whole and have the size `size`. Returns how many they are.
int drop_drawn(const io::RunDirectory& to, const scene::Render& size, std::vector<int>& frames) {
  const auto is_drawn = [&](int frame) {
    const fs::path image = to.image(frame);
    return io::holds_bytes(image) && render::is_whole_png(io::read_file(image), size.width, size.height) &&
           (!to.journal || to.journal->fault(image).empty());
  };
  return static_cast<int>(std::erase_if(frames, is_drawn));
}

}  // namespace

Outcome render(const RenderOptions& options, Report& report) {
  const OrderlyStop orderly;
  for (const std::string& text : options.set) require_picture_key(text);
  const io::RunDirectory run = find_run(options.run);
  const io::Manifest manifest = io::read_manifest(run);
  run.require_whole(run.scene());
  const scene::Scene scene = scene::read(run.scene().string(), options.set, scene::Meshes::leave).scene;
  const io::RunDirectory to = options.out.empty() ? run : io::RunDirectory{options.out};
  std::vector<int> frames = frames_to_draw(options, run, manifest.frames);
  const int skipped = options.skip_existing ? drop_drawn(to, scene.render, frames) : 0;
  render::SequenceRenderer renderer(scene, manifest);
  io::create_folder(to.image(0).parent_path());

  const auto begin = std::chrono::steady_clock::now();
  if (!frames.empty())
    report.start(manifest.title, to.root.string(), frames.front(), frames.back(),
                 static_cast<int>(frames.size()));
  for (const int frame : frames) {
    if (interrupted())
      return {ExitStatus::interrupted, fmt::format("before frame {} was drawn; continue with --frames {}:{}",
                                                   frame, frame, frames.back())};
    const auto start = std::chrono::steady_clock::now();
    renderer.render_frame(run, frame, to);
    report.drawn(frame, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::string video;
  if (!options.frames)
    video = "; " + render::encode_video(to, io::video_path(run, manifest).stem().string(), manifest.fps,
                                        "ffmpeg", &stop_flag());
  if (interrupted() && !options.frames)
    return {ExitStatus::interrupted,
            "after all pictures were drawn, before their video was encoded; the same "
            "command draws them again and encodes it"};
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return {ExitStatus::done,
          fmt::format("{} picture{} in {}{}, {:.1f} s{}", frames.size(), frames.size() == 1 ? "" : "s",
                      to.image(0).parent_path().string(),
                      skipped > 0 ? fmt::format(" ({} were there)", skipped) : "", seconds, video)};
}

}  // namespace duet::tools
