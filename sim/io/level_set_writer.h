// The level-set sequence: one OpenVDB grid a body that has a level set. A rigid body's level set is sampled
// once, in body space; a frame's file holds the same voxels with the frame's pose in the grid's transform, so
// that nothing is resampled. Bodies of one shape share their voxels, in memory and in the files.
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

  // Writes levelset/NNNN.vdb atomically: grids of class level set named by the bodies, with metadata `frame`,
  // `time` (s) and `units`. `bodies` are those of the constructor, in the same order; only their poses are
  // read. Throws FileError.
  void write(const RunDirectory& run, int frame, double time, const std::vector<BodyLevelSet>& bodies) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace duet::io
