// The shortening of a column under its own weight and a load, in closed form but for a sum over its height.
#pragma once

#include <cmath>

namespace duet::test {

// Returns how much shorter a column is under its own weight and a load, over its unloaded height. `weight` is
// its weight over its foot (Pa), and the load is `load` times that. A neo-Hookean material with Young's
// modulus `youngs_modulus` (Pa) and a Poisson ratio of 0 is compressed by the pressure p to the stretch s
// with p = E/2 (1/s - s), so that s = sqrt(1 + (p/E)^2) - p/E.
inline double shortening(double youngs_modulus, double weight, double load) {
  constexpr int slices = 1000;
  double sum = 0;
  for (int i = 0; i < slices; ++i) {
    const double p = weight * (load + (i + 0.5) / slices) / youngs_modulus;
    sum += 1 + p - std::sqrt(1 + p * p);
  }
  return sum / slices;
}

}  // namespace duet::test
