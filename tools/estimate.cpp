#include "tools/estimate.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include "tools/wording.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/base/stop.h"
#include "sim/io/level_set_writer.h"
#include "sim/io/run_directory.h"
#include "sim/io/values_file.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Bytes of a line of stats.jsonl, as most scenes have it.
constexpr double stats_bytes = 2500;
// Bytes of a pixel in a PNG file: between 0.3 (plain background) and 0.9 (checkered floors) in the shipped
// scenes.
constexpr double bytes_of_pixel = 0.6;
// Memory of drawing, bytes, as measured with `duet preview stack` by OSMesa from 320 x 180 to 2560 x 1440
// pixels, with 1 to 16 samples a pixel, to 2 %: the library and its compiler, each pixel and each sample.
constexpr double drawing_library = 235e6, memory_of_pixel = 43, memory_of_sample = 12;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double file_bytes(const fs::path& path) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(path, missing);
  return missing ? 0 : static_cast<double>(size);
}

// Adds the level sets of frame 0 to the estimate.
void add_level_sets(const Simulation& simulation, RunEstimate& estimate) {
  const std::vector<BodyLevelSet> bodies = simulation.level_sets();
  if (bodies.empty()) return;
  const ScratchFolder scratch;
  const io::RunDirectory run{scratch.path()};
  io::create_folder(run.level_set(0).parent_path());
  io::LevelSetWriter(bodies).write(run, 0, 0, bodies);
  estimate.frame_bytes += file_bytes(run.level_set(0));
  estimate.other_bytes += file_bytes(run.static_level_sets());
}

// Returns the largest memory that this program has had so far, bytes.
double peak_memory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

// Returns the memory that this program has now, bytes; 0: unknown.
double present_memory() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

// Returns the number in a file of one number; empty if there is none ("max", no file).
std::optional<double> number_in(const char* path) {
  std::ifstream file(path);
  double number = 0;
  return file >> number ? std::optional(number) : std::nullopt;
}

// Returns the memory that programs can still have, bytes; 0: unknown. A control group may allow less than the
// machine has.
double available_memory() {
  double available = 0;
  std::ifstream file("/proc/meminfo");
  for (std::string word; file >> word;)
    if (word == "MemAvailable:") {
      file >> available;
      available *= 1024;
      break;
    }
  const auto limit = number_in("/sys/fs/cgroup/memory.max"),
             used = number_in("/sys/fs/cgroup/memory.current");
  if (limit && used) available = std::min(available, std::max(*limit - *used, 0.0));
  return available;
}

// Returns the nearest folder above the path, or the path, that exists.
fs::path existing_folder(const fs::path& path) {
  std::error_code unknown;
  fs::path folder = fs::absolute(path, unknown).lexically_normal();
  while (!fs::is_directory(folder, unknown) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

// Draws the present frame, and fills in how long that took and how large the picture is.
void draw(const scene::ReadResult& read, const Simulation& simulation, RunEstimate& estimate) {
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  io::Manifest manifest;
  manifest.fps = read.scene.fps;
  manifest.bodies = io::manifest_bodies(read.scene, surfaces);
  if (read.scene.render.color != scene::ColorBy::look) {
    io::FrameValues values;
    io::measure_values(simulation, surfaces, values);
    io::take_color(values, manifest.bodies, read.scene.render.color, surfaces);
  }
  render::SequenceRenderer renderer(read.scene, manifest);
  const auto begin = Clock::now();
  const std::vector<unsigned char> rgb = renderer.draw(surfaces, simulation.stats().time);
  const std::string png = render::png_bytes("the picture of the estimate", read.scene.render.width,
                                            read.scene.render.height, rgb);
  estimate.sample->drawing_seconds = seconds_since(begin);
  estimate.picture_bytes = static_cast<double>(png.size());
}

std::uintmax_t whole(double bytes) { return static_cast<std::uintmax_t>(std::max(bytes, 0.0)); }

}  // namespace

std::optional<double> RunEstimate::simulation_seconds() const {
  if (measured && sample &&
      sample->processor_seconds > 0)  // the table's processor time, on as many threads as here
    return frames * measured->seconds * speed *
           std::min(1.0, sample->wall_seconds / sample->processor_seconds);
  if (sample) return frames * sample->wall_seconds;
  if (measured) return frames * measured->seconds * speed;
  return {};
}

std::optional<double> RunEstimate::drawing_seconds() const {
  if (sample && sample->drawing_seconds) return (frames + 1) * *sample->drawing_seconds;
  return {};
}

RunEstimate estimate_sizes(const scene::ReadResult& read, const Simulation& simulation,
                           const std::string& out, LevelSets level_sets) {
  RunEstimate estimate;
  estimate.frames = read.scene.frames;
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  io::FrameValues values;
  io::measure_values(simulation, surfaces, values);
  estimate.frame_bytes =
      static_cast<double>(io::obj_text(surfaces).size() + io::npy_text(values).size()) + stats_bytes;
  simulation.rest_surfaces(surfaces);
  // A run keeps two checkpoints, and its source has the meshes that the scene reads.
  estimate.other_bytes =
      static_cast<double>(io::npy_text(surfaces).size() + 2 * simulation.save_state().size() +
                          read.written.size() + read.source.size());
  for (const auto& [name, path] : read.files) estimate.other_bytes += file_bytes(path);
  estimate.has_level_sets = level_sets == LevelSets::are_measured;
  if (estimate.has_level_sets) add_level_sets(simulation, estimate);
  const scene::Render& picture = read.scene.render;
  const double pixels = double{1} * picture.width * picture.height;
  estimate.picture_bytes = bytes_of_pixel * pixels;
  estimate.memory = peak_memory();
  estimate.drawing_memory =
      drawing_library +
      pixels * (memory_of_pixel + memory_of_sample * picture.supersampling * picture.supersampling);
  const fs::path folder = existing_folder(out);
  std::error_code unknown;
  const fs::space_info space = fs::space(folder, unknown);
  estimate.folder = folder.string();
  estimate.free_bytes = unknown ? 0 : static_cast<double>(space.available);
  if (const double available = available_memory(); available > 0)
    estimate.free_memory = available + present_memory();
  return estimate;
}

void sample_frames(const scene::ReadResult& read, Simulation& simulation, double seconds,
                   RunEstimate& estimate) {
  const OrderlyStop orderly;
  simulation.stop_when(&stop_flag());
  std::vector<FrameStats> frames;
  Sample& sample = estimate.sample.emplace();
  try {
    double spent = 0;  // processor time, which does not depend on what else the machine does
    while (simulation.frame() < read.scene.frames && (frames.empty() || spent < seconds)) {
      simulation.advance_frame();
      frames.push_back(simulation.stats());
      spent += frames.back().processor_seconds;
    }
  } catch (const Stopped&) {
    throw;
  } catch (const SimulationError& error) {
    if (frames.empty()) throw;
    sample.failure = error.what();
  }
  sample.frames = simulation.frame();
  sample.touches = frames.empty() || frames.back().contacts > 0;
  // Bodies that fall first and touch later cost more in later frames, so that the frames that are left are
  // taken to cost as much as the later half of these.
  const std::size_t first = frames.size() / 2;
  const double all = std::max(1, read.scene.frames), left = read.scene.frames - sample.frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double share = (1 + (i >= first ? left / static_cast<double>(frames.size() - first) : 0)) / all;
    sample.substeps += share * static_cast<double>(frames[i].substeps);
    sample.wall_seconds += share * frames[i].seconds;
    sample.processor_seconds += share * frames[i].processor_seconds;
  }
  estimate.memory = std::max(estimate.memory, peak_memory());
  try {
    draw(read, simulation, estimate);
  } catch (const FileError&) {
    // Without a library for drawing, `duet sim` still works: the text says that drawing is unknown.
  }
  if (interrupted()) throw Stopped();
}

void use_table(const SceneChoice& choice, const std::optional<CostTable>& table, RunEstimate& estimate) {
  if (!table || !choice.set.empty() || !choice.accuracy.empty() || !choice.without.empty() ||
      !choice.files.empty())
    return;
  for (const ShippedScene& scene : shipped_scenes()) {
    std::error_code missing;
    const auto cost = table->scenes.find(scene.name);
    if (cost == table->scenes.end() || !fs::equivalent(scene.path, find_scene(choice.name), missing))
      continue;
    estimate.measured = cost->second;
    if (!estimate.sample) {
      estimate.memory = std::max(estimate.memory, cost->second.memory);
      estimate.picture_bytes = cost->second.picture_bytes;
    }
  }
}

std::vector<std::string> resource_warnings(const RunEstimate& estimate) {
  std::vector<std::string> warnings;
  const double needed = estimate.bytes_with_pictures();
  if (estimate.free_bytes > 0 && needed > estimate.free_bytes)
    warnings.push_back(fmt::format(
        "a run of {} frames takes about {}, and {} has {} free: give --out on another file system, fewer "
        "--frames, or "
        "`duet sim --stats-only`",
        estimate.frames, size_text(whole(needed)), estimate.folder, size_text(whole(estimate.free_bytes))));
  const double memory = estimate.memory + estimate.drawing_memory;
  if (estimate.free_memory > 0 && memory > estimate.free_memory)
    warnings.push_back(
        fmt::format("simulating takes about {} of memory and drawing {}, and {} are available: coarser "
                    "bodies, smaller pictures or "
                    "a lower render.supersampling need less, and `duet sim` before `duet render` only one of "
                    "them at a time",
                    size_text(whole(estimate.memory)), size_text(whole(estimate.drawing_memory)),
                    size_text(whole(estimate.free_memory))));
  return warnings;
}

std::string text_of(const RunEstimate& estimate, const std::optional<CostTable>& table) {
  const auto all = [&](std::optional<double> seconds) {
    return seconds ? duration_text(*seconds) : "unknown";
  };
  std::string text = "cost of the run\n";
  if (estimate.sample) {
    const Sample& sample = *estimate.sample;
    text += fmt::format(
        "  frames 1 to {} were simulated for this: {:.3g} s, {:.3g} s of processor time and {:.3g} substeps "
        "a frame, if "
        "all others take as much as the later half of these\n",
        sample.frames, sample.wall_seconds, sample.processor_seconds, sample.substeps);
    if (!sample.touches)
      text +=
          "  nothing touches yet in these frames: later ones cost more, and a larger --samples may see "
          "them\n";
    if (!sample.failure.empty())
      text += fmt::format("  the simulation fails after frame {}: {}\n", sample.frames, sample.failure);
    if (sample.drawing_seconds)
      text += fmt::format("  a picture was drawn in {:.2g} s\n", *sample.drawing_seconds);
    else
      text += "  nothing can be drawn here\n";
  }
  if (estimate.measured)
    text += fmt::format(
        "  frames 1 to {} took {:.3g} s of processor time each on {} ({}, {}){}\n",
        estimate.measured->measured_frames, estimate.measured->seconds, table->machine, table->program,
        table->date,
        estimate.sample ? fmt::format(", which is {:.2g} s here", estimate.measured->seconds * estimate.speed)
                        : "");
  if (!estimate.sample && !estimate.measured)
    text +=
        "  nothing was simulated: --estimate simulates the first frames, and tells how long the run takes\n";
  text += fmt::format("  simulating {} frames: {}; drawing them: {}{}\n", estimate.frames,
                      all(estimate.simulation_seconds()), all(estimate.drawing_seconds()),
                      estimate.sample ? "" : " (not measured here)");
  text += fmt::format("  disk: {} a frame and {} a picture, {} in all, with pictures {}; {} free in {}\n",
                      size_text(whole(estimate.frame_bytes)), size_text(whole(estimate.picture_bytes)),
                      size_text(whole(estimate.bytes_without_pictures())),
                      size_text(whole(estimate.bytes_with_pictures())), size_text(whole(estimate.free_bytes)),
                      estimate.folder);
  text +=
      fmt::format("  memory: {} and for drawing {}; {} available\n", size_text(whole(estimate.memory)),
                  size_text(whole(estimate.drawing_memory)),
                  estimate.free_memory > 0 ? size_text(whole(estimate.free_memory)) : "an unknown amount");
  return text;
}

nlohmann::json json_of(const RunEstimate& estimate) {
  using nlohmann::json;
  const auto optional = [](std::optional<double> value) { return value ? json(*value) : json(nullptr); };
  json object = {{"frames", estimate.frames},
                 {"bytes_a_frame", estimate.frame_bytes},
                 {"picture_bytes", estimate.picture_bytes},
                 {"other_bytes", estimate.other_bytes},
                 {"bytes", estimate.bytes_with_pictures()},
                 {"free_bytes", estimate.free_bytes},
                 {"memory", estimate.memory},
                 {"drawing_memory", estimate.drawing_memory},
                 {"free_memory", estimate.free_memory},
                 {"simulation_seconds", optional(estimate.simulation_seconds())},
                 {"drawing_seconds", optional(estimate.drawing_seconds())},
                 {"sampled", nullptr},
                 {"measured", nullptr}};
  if (estimate.sample)
    object["sampled"] = {{"frames", estimate.sample->frames},
                         {"touches", estimate.sample->touches},
                         {"substeps", estimate.sample->substeps},
                         {"seconds", estimate.sample->wall_seconds},
                         {"processor_seconds", estimate.sample->processor_seconds},
                         {"drawing_seconds", optional(estimate.sample->drawing_seconds)}};
  if (estimate.measured)
    object["measured"] = {{"frames", estimate.measured->measured_frames},
                          {"processor_seconds", estimate.measured->seconds * estimate.speed}};
  return object;
}

}  // namespace duet::tools
