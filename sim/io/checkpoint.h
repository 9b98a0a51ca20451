// Checkpoints: everything the next step reads, written after every frame, so that a run that was stopped at
// any moment continues bit-identically.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/numerics.h"
#include "sim/io/run_directory.h"
#include "sim/step/effects.h"

namespace duet::io {

struct Checkpoint {
  int frame = 0;
  std::vector<unsigned char> state;           // of Simulation::save_state
  std::uint32_t numerics = numerics_version;  // of the program that computed the state
};

struct CheckpointSearch {
  std::optional<Checkpoint> found;  // the newest valid one of this scene
  bool foreign = false;             // a whole checkpoint of another scene or other effects is there
  bool other_format = false;        // a checkpoint is there that another version of the program wrote
  std::vector<std::string>
      faults;  // of each checkpoint that was passed over: "run/checkpoint/0012.bin is damaged"
};

fs::path checkpoint_path(const RunDirectory& run, int frame);  // checkpoint/0012.bin

// Identifies what was simulated: the scene's source with its overrides, and the effects simulated.
std::uint64_t scene_identity(const std::string& source, const EffectSet& effects);

// Writes checkpoint/NNNN.bin atomically and keeps the newest two. Throws FileError.
void write_checkpoint(const RunDirectory& run, std::uint64_t scene, const Checkpoint& checkpoint);

// The newest checkpoint that is whole and of this scene, whatever numerics computed it; older ones are tried
// when it is not. Throws nothing for a damaged or missing checkpoint, FileError where the folder of the
// checkpoints cannot be read.
CheckpointSearch find_checkpoint(const RunDirectory& run, std::uint64_t scene);

}  // namespace duet::io
