// The energy of a scene over its frames.
#pragma once

#include <algorithm>

#include "tests/support/scenes.h"

namespace duet::test {

// The most that energy rises above that of any frame before, over the most that moves or is stored in a
// frame.
inline double gain_of(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, plan(scene));
  FrameStats stats = simulation.stats();
  double least = stats.kinetic + stats.potential + stats.elastic;
  double most = stats.kinetic + stats.elastic, gained = 0;
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
