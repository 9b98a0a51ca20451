// Checkpoints: files that hold everything the next step reads. One is written after every frame, so that a
// run that was stopped at any moment continues bit-identically.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/numerics.h"
#include "sim/io/run_directory.h"
#include "sim/step/effects.h"

namespace duet::io {

/// State of a simulation at the end of a frame, as a checkpoint file holds it.
struct Checkpoint {
  int frame = 0;                              ///< frame whose end the state describes; 0: the initial state
  std::vector<unsigned char> state;           ///< bytes that Simulation::save_state returned
  std::uint32_t numerics = numerics_version;  ///< numerics version of the program that computed the state
};

/// Result of find_checkpoint().
struct CheckpointSearch {
  /// The newest checkpoint that is valid and belongs to the scene; none if there is no such checkpoint.
  std::optional<Checkpoint> found;
  /// True if an undamaged checkpoint of another scene, or of other effects, was passed over.
  bool foreign = false;
  /// True if a checkpoint in the format of another version of the program was passed over.
  bool other_format = false;
  /// One sentence for each checkpoint that was passed over: "run/checkpoint/0012.bin is damaged".
  std::vector<std::string> faults;
};

/// Returns the path of the checkpoint of a frame: "checkpoint/0012.bin" in the run's folder.
fs::path checkpoint_path(const RunDirectory& run, int frame);

/// Returns a hash that identifies what is simulated: the text of the scene with its overrides, and the
/// active effects. Mesh files that the scene names are not part of it: callers combine it with
/// scene::ReadResult::meshes.
std::uint64_t scene_identity(const std::string& source, const EffectSet& effects);

/// Returns the identity of the scene of the newest checkpoint, as its header has it, without a look at its
/// state. Returns none if the run has no checkpoint, or one that is no checkpoint of this format. Throws
/// FileError if the folder of the checkpoints cannot be read.
std::optional<std::uint64_t> newest_identity(const RunDirectory& run);

/// Writes checkpoint/NNNN.bin atomically and removes all checkpoints but those of the two highest frames.
/// `scene` is the identity that find_checkpoint() will ask for. Throws FileError.
void write_checkpoint(const RunDirectory& run, std::uint64_t scene, const Checkpoint& checkpoint);

/// Returns the newest checkpoint that is undamaged and has the identity `scene`, whatever numerics version
/// computed it. Newer checkpoints that fail are passed over and listed as faults. Throws nothing for a
/// damaged or missing checkpoint, and FileError if the folder of the checkpoints cannot be read.
CheckpointSearch find_checkpoint(const RunDirectory& run, std::uint64_t scene);

}  // namespace duet::io
