// `duet view`: a run as one page that plays it in a browser.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "tools/commands.h"
#include "tools/exported_looks.h"
#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include "tools/view/page.h"
#include "tools/view/page_data.h"
#include "tools/wording.h"
#include <fmt/format.h>

#include "render/default_view.h"
#include "render/looks.h"
#include "sim/base/files.h"
#include "sim/base/wording.h"
#include "sim/io/export/exporters.h"
#include "sim/io/run_check.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The columns of stats.jsonl that the page draws.
constexpr const char* columns[] = {"time",    "substeps",  "seconds", "contacts",         "max_penetration",
                                   "kinetic", "potential", "elastic", "drawn_penetration"};

// The statistics by column; null where the run has none. A last line that is being written is left out.
Json read_columns(const io::RunDirectory& run, io::ExportNotes& notes) {
  if (!fs::exists(run.stats())) {
    notes.emplace_back("the run has no statistics (stats.jsonl), so there are no charts of energy and work");
    return nullptr;
  }
  const std::string text = run.read(run.stats());
  Json table = {{"frame", Json::array()}};
  for (const char* column : columns) table[column] = Json::array();
  int passed_over = 0;
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const Json line = Json::parse(text.substr(begin, end - begin), nullptr, false);
    if (!line.is_object() || !line.contains("frame") || !line["frame"].is_number_integer()) {
      ++passed_over;
      continue;
    }
    table["frame"].push_back(line["frame"]);
    for (const char* column : columns) {
      const bool is_there = line.contains(column) && line[column].is_number();
      table[column].push_back(is_there ? line[column] : Json());
    }
  }
  if (passed_over > 0)
    notes.push_back(
        fmt::format("{} of stats.jsonl could not be read", counted(as_index(passed_over), "line")));
  return table;
}

// Ground, sky and exposure, as pictures have them.
Json surroundings(const scene::Scene& described, const io::Manifest& manifest, const Vec3& origin) {
  const auto json_of = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  const scene::Scene scene = render::with_default_view(described, manifest);
  // The end of a color scale, if the pictures of the run have these colors.
  const auto range_of = [&](scene::ColorBy color) {
    return scene.render.color == color ? Json(scene.render.range_of_color()) : Json();
  };
  Json object = {{"sky",
                  {{"zenith", json_of(scene.sky.zenith)},
                   {"horizon", json_of(scene.sky.horizon)},
                   {"intensity", scene.sky.intensity}}},
                 {"exposure", scene.render.exposure},
                 {"strain_range", scene.render.strain_range},
                 {"stress_range", range_of(scene::ColorBy::stress)},
                 {"pressure_range", range_of(scene::ColorBy::contact)},
                 {"ground", nullptr}};
  if (!scene.ground) return object;
  const scene::Look look =
      render::assign_looks(scene, manifest).looks.at(static_cast<std::size_t>(render::LookTable::ground));
  object["ground"] = {{"height", scene.ground->height - origin.y()},
                      {"color", json_of(look.color)},
                      {"color2", json_of(look.color2)},
                      {"roughness", look.roughness},
                      {"pattern", look.pattern},
                      {"pattern_size", look.pattern_size}};
  return object;
}

void require_replaceable(const fs::path& target) {
  std::error_code none;
  if (!fs::exists(target, none)) return;
  if (fs::is_regular_file(target, none) && (fs::file_size(target, none) == 0 || view::is_page(target)))
    return;
  throw Error(ExitStatus::usage,
              fmt::format("{}: is no page of `duet view`, and stays untouched (give another path with --out)",
                          target.string()));
}

// The pieces of the page.
struct Contents {
  Json run = Json::object();
  std::string meshes;  // a block
  view::PackedFrames frames;
  std::size_t frame_count = 0, body_count = 0;
  io::ExportNotes notes;
};

Json summary(const io::Manifest& manifest) {
  return {{"title", manifest.title},
          {"program", io::program_text(manifest.origin)},
          {"fps", manifest.fps},
          {"last_frame", manifest.frames}};
}

// Frames of the run so that they and the `fixed` bytes of all else fit into `most` bytes: all, or every
// second, third ... one.
std::vector<int> pack_thinned(const io::ExportedRun& run, const view::Measures& measures,
                              std::optional<double> ground, double fixed, double most, Contents& contents) {
  const double room = most - fixed;
  for (std::size_t step = 1;;) {
    const std::vector<int> frames = view::thinned(run.frames(), step);
    contents.frames =
        view::pack(run, measures, frames, ground, static_cast<std::size_t>(std::max(room, 0.0)));
    const auto bytes = static_cast<double>(contents.frames.bytes);
    if (bytes <= room) {
      contents.run["every"] = step;
      return frames;
    }
    if (frames.size() <= 2)
      throw Error(
          ExitStatus::usage,
          fmt::format("--max-size: two frames of these bodies take more (give at least {:.1f}, or fewer "
                      "bodies with --bodies)",
                      std::ceil(10 * (fixed + bytes) / 1e6) / 10));
    // As many frames fewer as the bytes so far tell, if all take the same; one in ten is taken for granted.
    const double excess = bytes / std::max(room, 1.0) * static_cast<double>(frames.size()) /
                          static_cast<double>(contents.frames.frames);
    step = std::max(step + 1, static_cast<std::size_t>(std::ceil(0.9 * excess * static_cast<double>(step))));
    step = std::min(step, run.frames().size() - 1);
  }
}

void add_bodies(const ViewOptions& options, const io::RunDirectory& run, Contents& contents, Report& report,
                const fs::path& target) {
  io::ExportChoice choice;
  choice.bodies = options.bodies;
  if (options.frames) {
    choice.first = options.frames->first.value_or(options.frames->last);
    choice.last = options.frames->last;
  }
  io::ExportedRun exported(run, choice);
  run.require_whole(run.scene());
  const scene::Scene scene = scene::read(run.scene().string(), {}, scene::Meshes::leave).scene;
  exported.set_looks(looks_of(scene, exported.manifest()));
  const int count = static_cast<int>(exported.frames().size());
  report.start(exported.manifest().title, target.string(), exported.frames().front(),
               exported.frames().back(), 0);
  exported.set_watch([](int) {
    if (interrupted()) throw Interrupted();
  });
  const view::Measures measures = view::measure(exported);
  int newest = -1, done = 0;
  exported.set_watch([&](int frame) {
    if (interrupted()) throw Interrupted();
    if (frame <= newest) return;  // thinned: the frames are read again
    newest = frame;
    report.exported(frame, ++done, count);
  });
  contents.meshes = view::mesh_block(exported);
  contents.run.update(view::describe(exported, measures, exported.frames()));
  contents.run.update(surroundings(scene, exported.manifest(), measures.origin));
  contents.run["frames"] = exported.frames();
  constexpr std::size_t for_notes = 2000;  // bytes, also for the marks around blocks
  const std::size_t fixed = view::page_head(exported.manifest().title, contents.run).size() +
                            contents.meshes.size() + view::page_end().size() + for_notes;
  const std::optional<double> ground = scene.ground ? std::optional(scene.ground->height) : std::nullopt;
  const std::vector<int> frames = pack_thinned(exported, measures, ground, static_cast<double>(fixed),
                                               options.max_megabytes * 1e6, contents);
  contents.run.update(view::describe(exported, measures, frames));
  contents.run["frames"] = frames;
  contents.frame_count = frames.size();
  contents.body_count = exported.bodies().size();

  if (const std::size_t step = contents.run.at("every"); step > 1)
    contents.notes.push_back(
        fmt::format("the page would take more than {:g} MB with all {} frames (--max-size): it has every "
                    "{}{} one, and the "
                    "last one",
                    options.max_megabytes, count, step,
                    step == 2   ? "nd"
                    : step == 3 ? "rd"
                                : "th"));
  if (!exported.missing().empty())
    contents.notes.push_back(fmt::format("{} {} not in the run", io::frames_text(exported.missing()),
                                         exported.missing().size() == 1 ? "is" : "are"));
  if (!options.frames && exported.frames().back() < exported.manifest().frames)
    contents.notes.push_back(fmt::format("the run has come to frame {} of {}", exported.frames().back(),
                                         exported.manifest().frames));
}

// A run without values/ has statistics alone.
void add_no_bodies(const io::RunDirectory& run, Contents& contents) {
  contents.run["bodies"] = Json::array();
  contents.run["frames"] = contents.run["stats"]["frame"];
  contents.frame_count = contents.run["frames"].size();
  if (contents.frame_count == 0)
    throw FileError(run.root.string(), "has no frame yet", "continue it with `duet sim SCENE --resume`");
  contents.notes.emplace_back(
      "the run has no motion of its bodies (values/; --stats-only, or an older program): the page shows its "
      "statistics alone");
}

void write(const Contents& contents, const std::string& title, const fs::path& path) {
  io::OutputFile file(path);
  file.write(view::page_head(title, contents.run));
  if (!contents.meshes.empty()) file.write(view::page_block(contents.meshes));
  for (const std::string& block : contents.frames.blocks) file.write(view::page_block(block));
  file.write(view::page_end());
  file.close();
}

}  // namespace

Outcome view(const ViewOptions& options, Report& report) {
  const OrderlyStop orderly;
  const auto begin = std::chrono::steady_clock::now();
  const io::RunDirectory run = find_run(options.run);
  const io::Manifest manifest = io::read_manifest(run);
  const fs::path target = options.out.empty() ? run.root / "view.html" : fs::path(options.out);
  require_replaceable(target);
  io::Staging staging(
      target, io::Staging::Kind::file,
      options.overwrite ? io::Staging::OldTarget::is_replaced : io::Staging::OldTarget::is_kept);
  Contents contents;
  contents.run = summary(manifest);
  contents.run["stats"] = read_columns(run, contents.notes);
  try {
    if (fs::exists(run.body_values()) || contents.run["stats"].is_null())
      add_bodies(options, run, contents, report, target);
    else
      add_no_bodies(run, contents);
    contents.run["notes"] = contents.notes;
    write(contents, manifest.title, staging.path());
    if (interrupted()) throw Interrupted();
  } catch (const Interrupted&) {
    return {ExitStatus::interrupted,
            fmt::format("nothing was written to {}; the same command writes the page", target.string())};
  }
  const std::uintmax_t bytes = fs::file_size(staging.path());
  staging.finish();
  for (const std::string& note : contents.notes) report.note(note);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return {ExitStatus::done,
          fmt::format("{} of {}, {}, in {}, {:.1f} s; open it in a browser",
                      counted(contents.frame_count, "frame"), counted(contents.body_count, "body", "bodies"),
                      size_text(bytes), target.string(), seconds)};
}

}  // namespace duet::tools
