// `duet render`: draws frames of a run directory.
#include <algorithm>
#include <array>
#include <chrono>
#include <iterator>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/wording.h"
#include "sim/io/run_check.h"
#include "sim/io/run_claim.h"
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

// Throws FileError if a mesh of the frames `first` to `last` that the journal lists is gone or has another
// size: the video would have a gap there, or show an older picture. The bytes are compared later, when the
// mesh is drawn.
void require_listed_meshes(const io::RunDirectory& run, int first, int last) {
  if (!run.journal) return;
  for (const auto& [name, entry] : run.journal->entries()) {
    const int frame = fs::path(name).parent_path() == "mesh" ? io::frame_of_file(name, ".obj") : -1;
    if (frame < std::max(first, 0) || frame > last || entry.state != io::RunJournal::Entry::State::whole)
      continue;
    std::error_code missing;
    if (fs::file_size(run.mesh(frame), missing) != entry.mark.bytes) run.require_whole(run.mesh(frame));
  }
}

// Frames of a run, in ascending order.
struct ChosenFrames {
  std::vector<int> there;  // frames to draw
  std::vector<int>
      missing;  // frames that are asked for, or lie between others, and that the run does not have
};

// Returns the frames to draw, of which there is at least one. `last` is the last frame of the run. Throws
// FileError if the run has no frame, or lost one, and Error (usage) if it has none of --frames.
ChosenFrames frames_to_draw(const RenderOptions& options, const io::RunDirectory& run, int last) {
  const int first = options.frames ? options.frames->first.value_or(options.frames->last) : 0;
  if (options.frames) last = options.frames->last;
  std::vector<int> all;
  for (const fs::path& file : io::files_in(run.mesh(0).parent_path()))
    if (const int frame = io::frame_of_file(file, ".obj"); frame >= 0) all.push_back(frame);
  std::sort(all.begin(), all.end());
  require_listed_meshes(run, first, last);
  if (all.empty())
    throw FileError((run.root / "mesh").string(), "has no frames", "simulate the scene first: `duet sim`");
  ChosenFrames chosen;
  std::copy_if(all.begin(), all.end(), std::back_inserter(chosen.there),
               [&](int frame) { return frame >= first && frame <= last; });
  if (chosen.there.empty())
    throw Error(ExitStatus::usage,
                fmt::format("{}: has none of the frames that are asked for; it has frames {} to {}",
                            run.root.string(), all.front(), all.back()));
  const int begin = options.frames ? first : chosen.there.front(),
            end = options.frames ? last : chosen.there.back();
  for (int frame = begin; frame <= end; ++frame)
    if (!std::binary_search(chosen.there.begin(), chosen.there.end(), frame)) chosen.missing.push_back(frame);
  return chosen;
}

// Returns the run, or the folder that --out names, into which pictures and video are to be written. Throws
// Error (usage) if that folder holds another run, whose pictures would be replaced.
io::RunDirectory folder_of_pictures(const RenderOptions& options, const io::RunDirectory& run) {
  std::error_code missing;
  if (options.out.empty() || fs::equivalent(options.out, run.root, missing)) return run;
  const io::RunDirectory folder{options.out};
  if (fs::exists(folder.manifest(), missing))
    throw Error(ExitStatus::usage,
                fmt::format("{}: the folder holds another run, whose pictures stay untouched (give another "
                            "folder with --out, or draw that run: `duet render {}`)",
                            options.out, shell_word(options.out)));
  return folder;
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

// Draws pictures of a run and shows the progress.
class Drawing {
 public:
  Drawing(const io::RunDirectory& run, const io::RunDirectory& to, const io::Manifest& manifest,
          const scene::Scene& scene, Report& report)
      : run_(run), to_(to), manifest_(manifest), scene_(scene), report_(report) {}

  // Announces the frames, of which there is at least one. The pictures are listed in a part of the journal.
  void begin(const std::vector<int>& frames) {
    if (to_.journal) to_.journal->begin_part();
    renderer_ = std::make_unique<render::SequenceRenderer>(scene_, manifest_);
    io::create_folder(to_.image(0).parent_path());
    report_.start(manifest_.title, to_.root.string(), frames.front(), frames.back(),
                  static_cast<int>(frames.size()));
  }
  // Draws a frame.
  void draw(int frame) {
    const auto start = std::chrono::steady_clock::now();
    renderer_->render_frame(run_, frame, to_);
    report_.drawn(frame, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    ++drawn_;
  }
  // Ends the part of the journal.
  void end() {
    if (to_.journal) to_.journal->end_part();
  }
  // Returns the number of frames that were drawn.
  int drawn() const { return drawn_; }

 private:
  const io::RunDirectory& run_;
  const io::RunDirectory& to_;
  const io::Manifest& manifest_;
  const scene::Scene& scene_;
  Report& report_;
  std::unique_ptr<render::SequenceRenderer> renderer_;
  int drawn_ = 0;
};

// Frames of a run that a simulation may still write, and that are to be drawn as they come.
class ComingFrames {
 public:
  ComingFrames(const RenderOptions& options, const io::RunDirectory& run, int last)
      : run_(run), wait_(options.wait) {
    const int first = options.frames ? options.frames->first.value_or(options.frames->last) : 0;
    const int end = options.frames ? std::min(options.frames->last, last) : last;
    for (int frame = first; frame <= end; ++frame) left_.push_back(frame);
  }

  // Returns the frames that are to be drawn and can be, in ascending order. If there is none, waits for the
  // next one until a simulation has not written one for the time of --wait, or does not go on. Empty: no
  // frame comes any more.
  std::vector<int> next() {
    // Time in which a simulation may be between two tasks of a queue, or about to begin.
    const double pause = std::min(10.0, wait_ / 60);
    const Clock::time_point begin = Clock::now();
    Clock::time_point last_alive = begin;
    std::vector<int> ready = take_ready();
    for (int look = 1; ready.empty() && !left_.empty() && !interrupted() && seconds_since(begin) < wait_;
         ++look) {
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(wait_ / 10, 1.0)));
      const auto holder = io::RunClaim::holder(run_.root);
      if (holder && !holder->work.ends_with("journal")) last_alive = Clock::now();
      // Frames come in their order: as long as the first one is not there, a look at all files would only
      // burden the file server. It may be one that is never written.
      const bool is_over = seconds_since(last_alive) > pause;
      if (is_over || look % looks_at_first == 0 || fs::exists(run_.mesh(left_.front()))) ready = take_ready();
      if (is_over) break;
    }
    return ready;
  }
  // Returns whether frames are left that were not there.
  bool is_any_left() const { return !left_.empty(); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr int looks_at_first = 30;  // looks at the first frame alone between two looks at all files
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }
  static std::set<int> frames_in(const fs::path& folder, const char* extension) {
    std::set<int> frames;
    for (const fs::path& file : io::files_in(folder))
      if (const int frame = io::frame_of_file(file, extension); frame >= 0) frames.insert(frame);
    return frames;
  }
  // Removes the frames that can be drawn from those that are left, and returns them. Of a frame that is being
  // written the values, where a run has them, come after the mesh.
  std::vector<int> take_ready() {
    const std::set<int> meshes = frames_in(run_.mesh(0).parent_path(), ".obj"),
                        values = frames_in(run_.values(0).parent_path(), ".npy");
    const bool has_values = fs::exists(run_.body_values());  // written before the first mesh
    std::vector<int> ready;
    for (const int frame : left_)
      if (meshes.contains(frame) && (!has_values || values.contains(frame))) ready.push_back(frame);
    std::erase_if(left_, [&](int frame) { return std::binary_search(ready.begin(), ready.end(), frame); });
    return ready;
  }

  const io::RunDirectory& run_;
  const double wait_;      // s
  std::vector<int> left_;  // ascending
};

// A run and what pictures need of it.
struct OpenedRun {
  io::RunDirectory run;
  io::Manifest manifest;
  scene::Scene scene;
};

// Opens a run. If a simulation is about to begin, waits for up to `options.wait` until the folder holds a
// run. A simulation that continues the run replaces the manifest, so that a single look may find it changed.
OpenedRun open_coming_run(const RenderOptions& options) {
  constexpr int looks = 5;
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(std::min(options.wait, 1e9));
  const auto is_there = [&](const fs::path& folder) { return fs::exists(io::RunDirectory{folder}.scene()); };
  while (!interrupted() && std::chrono::steady_clock::now() < end && !is_there(options.run) &&
         !is_there(fs::path("out") / options.run))
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(options.wait / 10, 1.0)));
  for (int look = 1;; ++look) try {
      const io::RunDirectory run = find_run(options.run);
      io::Manifest manifest = io::read_manifest(run);
      run.require_whole(run.scene());
      return {run, std::move(manifest),
              scene::read(run.scene().string(), options.set, scene::Meshes::leave).scene};
    } catch (const FileError&) {
      if (look == looks || !io::RunClaim::holder(options.run)) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
}

// `duet render --missing`.
Outcome render_missing(const RenderOptions& options, Report& report) {
  const auto [run, manifest, scene] = open_coming_run(options);
  const io::RunDirectory to = folder_of_pictures(options, run);
  Drawing drawing(run, to, manifest, scene, report);
  ComingFrames coming(options, run, manifest.frames);
  int skipped = 0;
  bool has_begun = false;
  for (std::vector<int> frames = coming.next(); !frames.empty() && !interrupted(); frames = coming.next()) {
    skipped += drop_drawn(to, scene.render, frames);
    if (!frames.empty() && !std::exchange(has_begun, true)) drawing.begin(frames);
    for (const int frame : frames)
      if (!interrupted()) drawing.draw(frame);
  }
  drawing.end();
  const std::string done = fmt::format("{} in {}{}", counted(as_index(drawing.drawn()), "picture"),
                                       to.image(0).parent_path().string(),
                                       skipped > 0 ? fmt::format(" ({} were there)", skipped) : "");
  if (interrupted()) return {ExitStatus::interrupted, done + "; the same command draws the others"};
  if (coming.is_any_left())
    return {options.wait > 0 ? ExitStatus::unfinished : ExitStatus::done,
            done + "; other frames are not simulated yet"};
  return {ExitStatus::done, done};
}

}  // namespace

Outcome render(const RenderOptions& options, Report& report) {
  const OrderlyStop orderly;
  for (const std::string& text : options.set) require_picture_key(text);
  if (options.missing) return render_missing(options, report);
  const io::RunDirectory run = find_run(options.run);
  const io::Manifest manifest = io::read_manifest(run);
  run.require_whole(run.scene());
  const scene::Scene scene = scene::read(run.scene().string(), options.set, scene::Meshes::leave).scene;
  const io::RunDirectory to = folder_of_pictures(options, run);
  auto [frames, missing] = frames_to_draw(options, run, manifest.frames);
  const int skipped = options.skip_existing ? drop_drawn(to, scene.render, frames) : 0;
  const auto begin = std::chrono::steady_clock::now();
  Drawing drawing(run, to, manifest, scene, report);
  if (!frames.empty()) drawing.begin(frames);
  for (const int frame : frames) {
    if (interrupted()) {
      drawing.end();
      return {ExitStatus::interrupted, fmt::format("before frame {} was drawn; continue with --frames {}:{}",
                                                   frame, frame, frames.back())};
    }
    drawing.draw(frame);
  }
  std::string video;
  if (!options.frames) {
    if (frames.empty() && to.journal) to.journal->begin_part();
    video = "; " + render::encode_video(to, io::video_path(run, manifest).stem().string(), manifest.fps,
                                        "ffmpeg", &stop_flag());
  }
  drawing.end();
  if (interrupted() && !options.frames)
    return {ExitStatus::interrupted,
            "after all pictures were drawn, before their video was encoded; the same "
            "command draws them again and encodes it"};
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return {ExitStatus::done, fmt::format("{} in {}{}, {:.1f} s{}{}", counted(frames.size(), "picture"),
                                        to.image(0).parent_path().string(),
                                        skipped > 0 ? fmt::format(" ({} were there)", skipped) : "", seconds,
                                        video, io::missing_text(missing))};
}

Outcome encode(const EncodeOptions& options) {
  const OrderlyStop orderly;
  const io::RunDirectory run = find_run(options.run);
  const io::Manifest manifest = io::read_manifest(run);
  const fs::path video = io::video_path(run, manifest);
  if (render::is_encoded(run, video.stem().string()))
    return {ExitStatus::done, fmt::format("{} is there, of the present pictures", video.string())};
  if (run.journal) run.journal->begin_part();
  const std::string note =
      render::encode_video(run, video.stem().string(), manifest.fps, "ffmpeg", &stop_flag());
  if (run.journal) run.journal->end_part();
  if (interrupted()) return {ExitStatus::interrupted, note};
  return {note == video.string() ? ExitStatus::done : ExitStatus::files, note};
}

}  // namespace duet::tools
