// The life of a run directory: taken over by one simulation at a time, cleared for a fresh run, kept for a
// resumed one.
#pragma once

#include <set>
#include <string>

#include "sim/io/run_directory.h"

namespace duet::io {

// Holds a run directory for one simulation. The system releases it when the program ends, however it ends.
class RunLock {
 public:
  // Creates the folder if need be. Throws FileError if another simulation writes there, or if the folder
  // holds something that is not a run directory.
  explicit RunLock(const RunDirectory& run);
  ~RunLock();  // a folder that is still empty goes away again
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  fs::path root_;
  int folder_ = -1;
};

/// What an earlier simulation left in a run directory.
struct HeldRun {
  /// Of which there is a mesh, level set, picture, checkpoint or line of statistics.
  std::set<int> frames;
  bool has_video = false;
  bool is_empty() const { return frames.empty() && !has_video; }
};

/// Looks through the folder; one that is not there holds nothing. Throws FileError where it cannot be read.
HeldRun held_run(const RunDirectory& run);

/// Removes the frames, statistics, checkpoints, video and journal of an earlier run there. Files that no run
/// writes stay. Throws FileError.
void clear_run(const RunDirectory& run);

/// Writes the manifest and the scene, creates the folders of the frames, and clears away what a killed run
/// left half written. Throws FileError.
void continue_run(const RunDirectory& run, const Manifest& manifest, const std::string& scene_source);

// Where the video of a run of this scene is written: stack.mp4 for scenes/stack.toml.
fs::path video_path(const RunDirectory& run, const Manifest& manifest);

}  // namespace duet::io
