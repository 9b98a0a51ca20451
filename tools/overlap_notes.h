// Overlaps that arise during a run, in words.
#pragma once

#include <optional>
#include <string>

#include "sim/simulation/simulation.h"

namespace duet::tools {

/// Watches a run for bodies that lie deep in each other, because others leave them no room or because a load
/// is too heavy for a solver. Thin bodies are left out: FrameStats::pinched names them.
class OverlapNotes {
 public:
  /// Measures the bodies as they are at the start.
  explicit OverlapNotes(const Simulation& simulation);

  /// Returns a sentence if a body lies deeper in another one than it did in earlier frames by half, and
  /// deeper than a fiftieth of its smallest extent. Searches the surfaces only if the statistics of the
  /// frame allow that.
  std::optional<std::string> look(const Simulation& simulation, const FrameStats& stats);

  /// Returns words for the last line of the run, such as "; `block` up to 0.37 m deep in `upper` (frame 11)";
  /// an empty text if there was no such overlap.
  std::string outcome() const;

 private:
  double least_;       // m, depth that is looked at: a fiftieth of the smallest extent of all bodies
  double depth_ = 0;   // m, of the deepest overlap so far
  std::string guest_;  // body that lies in `host_`
  std::string host_;
  int frame_ = 0;  // in which it was the deepest
};

}  // namespace duet::tools
