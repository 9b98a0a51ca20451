// A column that its own weight and a load shorten, in theory.
#pragma once

#include <cmath>

namespace duet::test {

/// By how much a column with the weight `weight` (Pa, over its foot) under a load of `load` times that is
/// shorter than unloaded, over its height: a neo-Hookean material of `youngs_modulus` (Pa) with a Poisson
/// ratio of 0 is shortened by the pressure p to the stretch s with p = E/2 (1/s - s).
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
