// What a run will take: time, disk space and memory, estimated before it begins.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/commands.h"
#include "tools/scene_costs.h"
#include <nlohmann/json_fwd.hpp>

#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {

// Mean costs of a frame of the run. The first frames were simulated; the others are taken to cost as much as
// the later half of these.
struct Sample {
  int frames = 0;                // frames 1 to this one were simulated
  bool touches = true;           // bodies are in contact at the last of these frames
  double substeps = 0;           // steps
  double wall_seconds = 0;       // wall time, s
  double processor_seconds = 0;  // processor time, s
  std::optional<double>
      drawing_seconds;  // wall time of drawing the last frame, s; empty: nothing can be drawn here
  std::string failure;  // error that ended the simulation; empty: none
};

// What a run takes.
struct RunEstimate {
  int frames = 0;              // frames of the scene, without frame 0
  double frame_bytes = 0;      // mesh, values, level sets and statistics of a frame
  double picture_bytes = 0;    // a picture
  double other_bytes = 0;      // everything that is written once
  bool has_level_sets = true;  // false: frame_bytes lacks the level sets
  double memory = 0;           // simulation alone, bytes
  double drawing_memory = 0;   // what drawing adds, bytes
  std::optional<Sample> sample;
  std::optional<SceneCost> measured;  // of the shipped scene, if it is not changed
  double speed = 1;                   // seconds here for a second on the machine of the table
  std::string folder;                 // existing folder whose file system takes the run
  double free_bytes = 0;              // free on it
  double free_memory = 0;             // available to this program, with what it has; 0: unknown

  // Returns the bytes of a run of `duet sim`, with frame 0.
  double bytes_without_pictures() const { return (frames + 1.0) * frame_bytes + other_bytes; }
  // Returns the bytes of a run of `duet run`, with frame 0.
  double bytes_with_pictures() const { return (frames + 1.0) * (frame_bytes + picture_bytes) + other_bytes; }
  // Returns the wall time (s) of simulating all frames; empty: unknown.
  std::optional<double> simulation_seconds() const;
  // Returns the wall time (s) of drawing all frames; empty: unknown.
  std::optional<double> drawing_seconds() const;
};

// Whether level sets are written, to a scratch folder, to learn how large they are.
enum class LevelSets { are_measured, are_left_out };

// Estimates disk space and memory of a run of `simulation`, which is at frame 0, without a step. `out` is the
// folder of the run.
RunEstimate estimate_sizes(const scene::ReadResult& read, const Simulation& simulation,
                           const std::string& out, LevelSets level_sets);

// Simulates for `seconds` of processor time, and a frame at least, draws the last frame, and fills in the
// estimate. Throws Stopped if a signal comes.
void sample_frames(const scene::ReadResult& read, Simulation& simulation, double seconds,
                   RunEstimate& estimate);

// Takes over what the table says about an unchanged shipped scene; `choice` tells whether it is one.
void use_table(const SceneChoice& choice, const std::optional<CostTable>& table, RunEstimate& estimate);

// Returns a warning if the disk is too small, and one if the memory is.
std::vector<std::string> resource_warnings(const RunEstimate& estimate);

// Returns the estimate as lines of `duet explain`.
std::string text_of(const RunEstimate& estimate, const std::optional<CostTable>& table);

// Returns the estimate as JSON: lengths of time in s, sizes in bytes.
nlohmann::json json_of(const RunEstimate& estimate);

}  // namespace duet::tools
