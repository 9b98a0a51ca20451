// The life of a run directory: one simulation at a time takes it over, clears it for a fresh run, or keeps
// it for a resumed one.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "sim/io/run_claim.h"
#include "sim/io/run_directory.h"

namespace duet::io {

/// Holds a run directory for one simulation by its claim, which others tell from that of a program that has
/// ended.
class RunLock {
 public:
  /// Creates the folder if it is missing, and takes its claim for some `work`, such as "duet sim"; waits up
  /// to `wait` (s) for it. Throws FileError if another program holds it, if the folder has files but no
  /// readable manifest.json, or if it cannot be written.
  explicit RunLock(const RunDirectory& run, const std::string& work = "duet sim", double wait = 0);
  /// Releases the claim, and removes the folder if it is empty.
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

  /// Throws FileError if another program has taken the claim over. To be called before every group of writes.
  void require_held() const { claim_->require_held(); }

 private:
  fs::path root_;
  std::unique_ptr<RunClaim> claim_;
};

/// Content of a run directory that an earlier simulation left.
struct HeldRun {
  /// Frames of which there is a mesh, a level set, values, a picture, a checkpoint or a line of statistics.
  std::set<int> frames;
  bool has_video = false;  ///< true if the video of the manifest's scene is there
  /// Returns true if there is neither a frame nor a video.
  bool is_empty() const { return frames.empty() && !has_video; }
};

/// Lists what an earlier simulation left in the folder; a missing folder holds nothing. Throws FileError if
/// the folder, its statistics or its manifest cannot be read.
HeldRun held_run(const RunDirectory& run);

/// Removes the frames, level sets, values, pictures, statistics, checkpoints, video and journal of an
/// earlier run. Files that no run writes stay. Throws FileError.
void clear_run(const RunDirectory& run);

/// Prepares the folder for the frames to come: removes temporary files that a killed program left, but not
/// those of programs that draw pictures at the same time, writes the manifest and `scene_source` as
/// scene.toml, and creates the folders of the frames. Throws FileError.
void continue_run(const RunDirectory& run, const Manifest& manifest, const std::string& scene_source);

/// Returns the path of the run's video, which has the name of the scene file: stack.mp4 for
/// scenes/stack.toml.
fs::path video_path(const RunDirectory& run, const Manifest& manifest);

}  // namespace duet::io
