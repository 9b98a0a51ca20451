// The pressures that keep the volumes of one-rings: D P M^-1 D^T q = rate (Irving, Schroeder, Fedkiw
// 2007), where P projects the contact constraints out of the gradient field.
#pragma once

#include "sim/contact/response/contact_projection.h"
#include "sim/solve/conjugate_gradient.h"

namespace duet {

struct PressureSettings {
  double tolerance = 1e-4;  // largest error of a one-ring's volume in a step, over its volume at rest
  int iterations = 100;
  double reduction = 0;  // of the largest error, at which a solve may also end
};

// Keeps its storage from solve to solve.
struct PressureScratch {
  std::vector<double> rate;       // m^3/s, by which the rates of the one-rings are to change
  std::vector<double> pressure;   // Pa s, that were found
  std::vector<double> scale;      // 1 / sqrt(diagonal), (kg/m^4)^1/2; 0 for one-rings that nothing can change
  std::vector<double> tolerance;  // m^3/s over scale
  std::vector<double> right_side, residual, direction, image, direction_image, scaled;
  GeneralizedVelocity change;  // of the velocities, by the pressures
};

// Finds the pressures that change the rates D v of the one-rings of `bodies`, as they were linearized last,
// by `scratch.rate`, to within the tolerance for a step of `dt` (s), and sets `scratch.change` to P M^-1 D^T
// q. Without a `projection` bodies are not in contact: P = 1. The impulses are internal, or of contacts and
// equal and opposite: momentum is kept however far the iteration has come.
CgResult find_pressures(const Bodies& bodies, const ContactProjection* projection, double dt,
                        const PressureSettings& settings, PressureScratch& scratch);

}  // namespace duet
