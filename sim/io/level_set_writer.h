// The level-set sequence of a run: one OpenVDB grid for each body that has a level set.
#pragma once

#include <memory>
#include <vector>

#include "sim/io/run_directory.h"

namespace duet::io {

/// Writes the level sets of rigid bodies, a file a frame. A level set is sampled once, in shape space. Each
/// frame's file holds the same voxels, with the frame's pose as the transform of the grid, so that nothing
/// is resampled. Bodies of one shape share their voxels, in memory and in a file. Bodies that never move
/// are in a file of their own, which serves all frames.
class LevelSetWriter {
 public:
  /// Samples the level sets of `bodies` in a narrow band of three voxels on either side of every surface.
  /// Each distance function must not grow faster than the distance itself (Lipschitz constant 1): blocks of
  /// voxels are skipped by the distance at their center.
  explicit LevelSetWriter(const std::vector<BodyLevelSet>& bodies);
  ~LevelSetWriter();

  /// Writes levelset/NNNN.vdb: a grid of class level set for each body that can move. Grids are named by
  /// their bodies and have the metadata `frame`, `time` (s) and `units`. If no body can move, there is no
  /// such file. The first call also writes levelset/static.vdb with the bodies that never move, without
  /// `frame` and `time`; if there are none, it removes the file that an earlier run left. `bodies` are
  /// those of the constructor in the same order; only their poses are read. Files are written atomically.
  /// Throws FileError.
  void write(const RunDirectory& run, int frame, double time, const std::vector<BodyLevelSet>& bodies);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace duet::io
