// Costs and depths of a run, for its last line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sim/simulation/frame.h"

namespace duet::tools {

/// Sums up the cost of the frames that this process simulated, and the deepest penetrations of them and of
/// the frame before.
class RunTotals {
 public:
  /// Takes a frame into account that this process simulated.
  void add(const FrameStats& stats);
  /// Takes a frame into account that cost nothing here: frame 0, or the one after which a run continues.
  void start_with(const FrameStats& stats);
  /// Returns the part of the last line about them, which begins with "; ". Empty if no frame was simulated.
  ///
  /// The depth of drawn surfaces is there if a body is drawn by another surface than the one that touches.
  std::string text() const;

 private:
  int frames_ = 0;
  std::int64_t substeps_ = 0;
  double seconds_ = 0;                   // wall time
  double penetration_ = 0;               // m, largest at frame ends and at the start
  std::optional<DeepestOverlap> drawn_;  // deepest of the drawn surfaces that do not touch, if there are such
  int drawn_frame_ = 0;                  // of `drawn_`
};

}  // namespace duet::tools
