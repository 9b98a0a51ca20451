// Deformable bodies that lose their volume or turn inside out during a run, in words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/simulation/simulation.h"

namespace duet::tools {

/// Watches a run for deformable bodies whose state is no longer that of their material: incompressible ones
/// that change their volume, ones that are squeezed to a fraction of it, and inverted elements.
class VolumeNotes {
 public:
  /// Returns a sentence for each such state that a body is in first. Looks at the elements only if the
  /// statistics of the frame say that there is something to see.
  std::vector<std::string> look(const Simulation& simulation, const scene::Scene& scene,
                                const FrameStats& stats);

  /// Returns words for the last line of the run, such as "; volume of `block` up to 8.1 % off (frame 11)"; an
  /// empty text if there is nothing to tell.
  std::string outcome() const;

 private:
  /// One of the three states, over the run.
  struct State {
    std::vector<bool> reached;  // by each deformable body
    double worst = 0;  // the larger, the worse: |V/V_0 - 1|, 1 - V/V_0, or the number of inverted elements
    std::string body;  // that is worst
    int frame = 0;     // in which it is

    /// Takes the value of a body in a frame, and returns whether it is the first body to reach the state.
    bool take(double value, std::size_t index, const DeformableBody& deformable, int at_frame);
    /// Returns the name of the worst body, and how many others there are.
    std::string bodies() const;
  };
  State error_, squeezed_, inverted_;
};

}  // namespace duet::tools
