// The level-set sequence: one OpenVDB grid a body that has a level set. A rigid body's level set is sampled
// once, in body space; a frame's file holds the same voxels with the frame's pose in the grid's transform, so
// that nothing is resampled. Bodies of one shape share their voxels, in memory and in a file. Bodies that
// never move have a file of their own, which is the same for all frames.
#pragma once

#include <memory>
#include <vector>

#include "sim/io/run_directory.h"

namespace duet::io {

class LevelSetWriter {
 public:
  // Samples a narrow band of three voxels on either side of every surface. `bodies` need a distance function
  // that grows no faster than the distance itself (Lipschitz constant 1).
  explicit LevelSetWriter(const std::vector<BodyLevelSet>& bodies);
  ~LevelSetWriter();

  // Writes levelset/NNNN.vdb, the bodies that move: grids of class level set named by the bodies, with
  // metadata `frame`, `time` (s) and `units`; no file where nothing moves. The first call writes
  // levelset/static.vdb before, the bodies that do not: the same without `frame` and `time`. It replaces the
  // file that an earlier run left, and removes it where there is no such body. Both files are written
  // atomically. `bodies` are those of the constructor, in the same order; only their poses are read. Throws
  // FileError.
  void write(const RunDirectory& run, int frame, double time, const std::vector<BodyLevelSet>& bodies);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace duet::io
