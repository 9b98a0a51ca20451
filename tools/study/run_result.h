// What a run left in its folder: its statistics, and the state at its end.
#pragma once

#include <memory>
#include <vector>

#include "tools/study/runs.h"
#include <nlohmann/json.hpp>

#include "sim/scene/scene.h"
#include "sim/simulation/simulation.h"

namespace duet::study {

// The lines of a run's stats.jsonl, frame 0 first. Throws FileError.
std::vector<nlohmann::json> read_stats(const fs::path& folder);

struct RunResult {
  scene::Scene scene;
  std::vector<nlohmann::json> frames;      // of stats.jsonl
  std::vector<Vec3> start;                 // m, centres of mass: rigid bodies, then deformable ones
  std::unique_ptr<Simulation> simulation;  // holds the last frame
  fs::path picture;                        // of the last frame, if it has been drawn
  double seconds() const { return static_cast<double>(frames.size() - 1) / scene.fps; }  // simulated
};

// Builds the scene of the run again and loads its last state. Throws FileError when files of the run are
// missing.
RunResult load_result(const Run& run);

// Centres of mass, rigid bodies first, m.
std::vector<Vec3> centres_of_mass(const World& world);

// The index of a body among the rigid or the deformable ones; -1.
int rigid_index(const World& world, const std::string& name);
int deformable_index(const World& world, const std::string& name);

// kg, of all that impulses move.
double dynamic_mass(const World& world);

// Velocities that are solved for: three a free particle, six a dynamic rigid body.
std::int64_t unknowns(const World& world);

}  // namespace duet::study
