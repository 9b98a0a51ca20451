// The gain of energy of a scene over its frames.
#pragma once

#include <algorithm>

#include "tests/support/scenes.h"

namespace duet::test {

// Simulates `frames` frames and returns the largest rise of the total energy above that of any earlier frame,
// over the largest kinetic plus elastic energy of a frame.
inline double gain_of(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, plan(scene));
  FrameStats stats = simulation.stats();
  double least = stats.kinetic + stats.potential + stats.elastic;  // J, least total energy so far
  double most = stats.kinetic + stats.elastic, gained = 0;         // J
  for (int frame = 1; frame <= frames; ++frame) {
    simulation.advance_frame();
    stats = simulation.stats();
    const double energy = stats.kinetic + stats.potential + stats.elastic;
    gained = std::max(gained, energy - least);
    least = std::min(least, energy);
    most = std::max(most, stats.kinetic + stats.elastic);
  }
  return gained / most;
}

}  // namespace duet::test
