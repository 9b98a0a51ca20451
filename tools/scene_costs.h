// Measured costs of the scenes that ship, and a measure of how fast this machine is.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace duet::tools {

// What a scene took when tools/scene-costs measured it.
struct SceneCost {
  int measured_frames = 0;    // frames 1 to this one were simulated
  double substeps = 0;        // mean number of steps of a frame
  double seconds = 0;         // mean processor time of simulating a frame on one thread, s
  double bytes = 0;           // mean size of a frame's mesh, values, level sets and statistics
  double picture_bytes = 0;   // size of the picture
  double other_bytes = 0;     // size of everything that is written once: checkpoints, static bodies, source
  double memory = 0;          // largest memory of `duet sim`, bytes
  double drawing_memory = 0;  // largest memory of `duet render`, bytes
};

// The table scenes/costs.json.
struct CostTable {
  std::string machine;             // processor and number of hardware threads
  std::string program;             // what `duet --version` printed
  std::string date;                // "2026-11-28"
  double calibration_seconds = 0;  // what calibrate() returned there
  std::map<std::string, SceneCost> scenes;
};

// Reads the table beside the shipped scenes. Empty if there is none. Throws FileError if it is damaged.
std::optional<CostTable> read_costs();

// Returns the processor time (s) of a short simulation on one thread, the least of three. The ratio of two
// machines' times scales the seconds of the table. Throws Error if its scene does not ship.
double calibrate();

}  // namespace duet::tools
