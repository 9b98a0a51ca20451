// The result of a run, read from its folder: statistics, and the state at the end.
#pragma once

#include <memory>
#include <vector>

#include "tools/study/runs.h"
#include <nlohmann/json.hpp>

#include "sim/scene/scene.h"
#include "sim/simulation/simulation.h"

namespace duet::study {

// Reads stats.jsonl: one object for each frame, from frame 0. Throws FileError if a frame is missing or a
// line is damaged.
std::vector<nlohmann::json> read_stats(const fs::path& folder);

// The result of a run.
struct RunResult {
  scene::Scene scene;                  // with the changes of the run
  std::vector<nlohmann::json> frames;  // statistics of all frames from frame 0
  std::vector<Vec3> start;             // m, centers of mass at frame 0: rigid bodies, then deformable ones
  std::unique_ptr<Simulation> simulation;  // in the state of the last frame
  fs::path picture;                        // of the last frame; empty: not drawn
  double seconds() const { return static_cast<double>(frames.size() - 1) / scene.fps; }  // simulated time
};

// Builds the scene of a run again and loads its last state. Throws FileError if files of the run are missing.
RunResult load_result(const Run& run);

// Returns the centers of mass (m): rigid bodies, then deformable ones.
std::vector<Vec3> centers_of_mass(const World& world);

// Returns the index of a body among the rigid ones; -1: there is none of this name.
int rigid_index(const World& world, const std::string& name);
// Returns the index of a body among the deformable ones; -1: there is none of this name.
int deformable_index(const World& world, const std::string& name);

// Returns the mass of dynamic rigid bodies and all particles (kg).
double dynamic_mass(const World& world);

// Returns the number of unknown velocities: three for each free particle, six for each dynamic rigid body.
std::int64_t unknowns(const World& world);

}  // namespace duet::study
