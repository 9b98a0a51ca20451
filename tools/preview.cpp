// `duet preview`: draws one picture of a scene, or a sheet of frames, without a run directory.
#include <algorithm>
#include <chrono>
#include <filesystem>

#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/replaceable.h"
#include "tools/scene_files.h"
#include "tools/sheet.h"
#include <fmt/format.h>

#include "render/picture.h"
#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/stop.h"
#include "sim/io/values_file.h"
#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Maker that the pictures of this command name, by which an earlier preview is known.
constexpr const char* preview_maker = "duet preview";

constexpr int default_width = 320, default_height = 180;  // pixels

// Appends --width and --height, or their defaults, to the changes `set` of the scene. A size that the user
// gives by --set stays; one that only the source of a run gives does not. A missing length follows from the
// other one by 16:9.
void set_size(const PreviewOptions& options, const std::vector<std::string>& users_set,
              std::vector<std::string>& set) {
  const auto is_set = [&](const char* key) {
    return std::any_of(users_set.begin(), users_set.end(),
                       [&](const std::string& text) { return text.starts_with(key); });
  };
  const auto fitting = [](int length, int of, int to) {
    return std::clamp((length * to + of / 2) / of, 16, 16384);
  };
  const bool has_width = options.width || is_set("render.width="),
             has_height = options.height || is_set("render.height=");
  if (options.width || !has_width)
    set.push_back(fmt::format("render.width={}", options.width ? *options.width
                                                 : options.height
                                                     ? fitting(*options.height, default_height, default_width)
                                                     : default_width));
  if (options.height || !has_height)
    set.push_back(fmt::format("render.height={}", options.height ? *options.height
                                                  : options.width
                                                      ? fitting(*options.width, default_width, default_height)
                                                      : default_height));
}

// Returns the frames to draw in ascending order, equally spaced from 0. Throws Error (usage) if there are
// fewer frames than moments.
std::vector<int> frames_to_draw(const PreviewOptions& options, const scene::Scene& scene) {
  if (!options.moments) return {options.frame.value_or(0)};
  const int last = options.frame.value_or(scene.frames), count = *options.moments;
  if (last < count - 1)
    throw Error(
        ExitStatus::usage,
        fmt::format(
            "--moments {}: frames 0 to {} are not as many (give a smaller number, or a later --frame)", count,
            last));
  std::vector<int> frames;
  for (std::int64_t i = 0; i < count; ++i)
    frames.push_back(static_cast<int>((i * last + (count - 1) / 2) / (count - 1)));
  return frames;
}

// Returns the file for a preview without --out: the folder of the run with "-preview.png" at its end.
fs::path default_path(const SceneChoice& scene, const std::string& run) {
  fs::path folder = run_folder(scene, run).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "out/stack/" ends with a slash
  folder += "-preview.png";
  return folder;
}

// Throws if the file cannot be written there, before anything is simulated.
void require_png(const std::string& out) {
  std::error_code unknown;
  if (fs::path(out).extension() != ".png")
    throw Error(ExitStatus::usage,
                fmt::format("--out {}: a preview is a PNG file (use the ending .png)", out));
  if (fs::is_directory(out, unknown))
    throw Error(ExitStatus::usage, fmt::format("--out {}: is a folder (name a file in it)", out));
  const fs::path folder = fs::path(out).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, unknown))
    throw FileError(out, fmt::format("there is no folder {}", folder.string()),
                    fmt::format("`mkdir -p {}` makes it", shell_word(folder.string())));
  require_own_picture(out, preview_maker, "preview");
}

// A scene that is simulated in memory and drawn onto a sheet.
class Preview {
 public:
  Preview(const SceneChoice& choice, const PreviewOptions& options, Report& report)
      : report_(report),
        read_(read_scene(choice)),
        frames_(frames_to_draw(options, read_.scene)),
        sheet_(static_cast<int>(frames_.size()), read_.scene.render.width, read_.scene.render.height),
        simulation_(read_.scene, scene::plan_effects(read_.scene, choice.without).active()) {
    simulation_.stop_when(&stop_flag());
  }

  // Simulates and draws all frames. Throws Stopped if the program is interrupted, and the errors of
  // simulation and renderer.
  void work(const std::string& path) {
    simulation_.surfaces(surfaces_);
    io::Manifest manifest;
    manifest.bodies = io::manifest_bodies(read_.scene, surfaces_);
    render::SequenceRenderer renderer(read_.scene, manifest);
    if (frames_.back() > 0)
      report_.start(read_.scene.title.empty() ? read_.scene.path : read_.scene.title, path, 0, frames_.back(),
                    static_cast<int>(frames_.size()));
    for (const int frame : frames_) {
      while (simulation_.frame() < frame) {
        if (interrupted()) throw Stopped();
        simulation_.advance_frame();
        report_.simulated(simulation_.stats());
      }
      if (interrupted()) throw Stopped();
      simulation_.surfaces(surfaces_);
      if (read_.scene.render.color != scene::ColorBy::look) {
        io::measure_values(simulation_, surfaces_, values_);
        io::take_color(values_, manifest.bodies, read_.scene.render.color, surfaces_);
      }
      const auto begin = std::chrono::steady_clock::now();
      sheet_.add(renderer.draw(surfaces_, frame / read_.scene.fps));
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (frames_.size() > 1) report_.drawn(frame, seconds);
    }
    if (interrupted()) throw Stopped();
  }

  int frame() const { return simulation_.frame(); }
  const std::vector<int>& frames() const { return frames_; }
  const render::Picture& picture() const { return sheet_.picture(); }

 private:
  Report& report_;
  const scene::ReadResult read_;
  const std::vector<int> frames_;
  Sheet sheet_;
  Simulation simulation_;
  std::vector<BodySurface> surfaces_;
  io::FrameValues values_;  // of the colors
};

}  // namespace

Outcome preview(const PreviewOptions& options, Report& report) {
  const auto begin = std::chrono::steady_clock::now();
  if (!options.out.empty()) require_png(options.out);
  SceneChoice choice = options.scene;
  std::string run;
  resolve_run(choice, run);
  set_size(options, options.scene.set, choice.set);
  const fs::path path = options.out.empty() ? default_path(choice, run) : fs::path(options.out);

  const OrderlyStop orderly;
  Preview work(choice, options, report);
  try {
    work.work(path.string());
  } catch (const Stopped&) {
    return {ExitStatus::interrupted, fmt::format("after frame {}; no picture was written", work.frame())};
  } catch (const SimulationError&) {
    return {report.failure(std::current_exception()),
            fmt::format("after frame {}; no picture was written (`--frame {}` draws that frame)",
                        work.frame(), work.frame())};
  }
  if (options.out.empty()) io::create_folder(path.parent_path());
  const render::Picture& picture = work.picture();
  render::write_png(path.string(), picture.width, picture.height, picture.rgb, preview_maker);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::string what =
      options.moments ? fmt::format("{} frames from 0 to {}", work.frames().size(), work.frames().back())
                      : fmt::format("frame {}", work.frames().back());
  return {ExitStatus::done, fmt::format("{} in {}, {} x {} pixels, {:.1f} s", what, path.string(),
                                        picture.width, picture.height, seconds)};
}

}  // namespace duet::tools
