// The pressure solve of incompressible bodies: D P M^-1 D^T q = rate, where the projection P satisfies the
// contact constraints (Irving, Schroeder, Fedkiw 2007).
#pragma once

#include "sim/contact/response/contact_projection.h"
#include "sim/solve/conjugate_gradient.h"

namespace duet {

/// Settings of find_pressures().
struct PressureSettings {
  double tolerance = 1e-4;  ///< Largest error of a nodal volume in a step, over its volume at rest, 1.
  int iterations = 100;     ///< Iterations at most.
  double reduction = 0;     ///< Reduction of the largest error at which a solve may end as well, 1.
};

/// Input, result and scratch of find_pressures(), kept from solve to solve so that nothing is allocated.
/// One-rings are the nodal volumes.
struct PressureScratch {
  std::vector<double> rate;  ///< Input, for each one-ring: wanted change of the rate of its volume, m^3/s.
  std::vector<double> pressure;  ///< Result, for each one-ring: pressure times time, Pa s.
  std::vector<double> left;      ///< Scratch of callers: rate that other pressures would leave, m^3/s.
  /// For each one-ring: 1 / sqrt(diagonal), (kg/m^4)^1/2; 0: nothing can change it.
  std::vector<double> scale;
  /// For each one-ring: factor that makes a scaled residual 1 at the tolerance.
  std::vector<double> tolerance;
  std::vector<double> right_side,  ///< Scaled right side.
      residual,                    ///< Scaled residual.
      direction,                   ///< Search direction.
      image,                       ///< Product with the residual.
      direction_image,             ///< Product with the search direction.
      scaled;                      ///< Pressures of the last product, Pa s.
  std::vector<Vec3> held_impulse;  ///< Impulses of the last product on held particles, N s; else zero.
  GeneralizedVelocity alone;       ///< Scratch: the change without contacts and joints.
  GeneralizedVelocity change;      ///< Result: change of the velocities by the pressures, m/s and rad/s.
};

/// Sets `change` to M^-1 D^T q, the change of the velocities by pressures times time `q` (Pa s): of
/// particles, and of the bodies that carry particles of incompressible bodies, with these particles.
///
/// Entries of particles without a one-ring stay; `change` must have its size. `held_impulse` is scratch.
void pressure_change(const Bodies& bodies, const std::vector<double>& q, std::vector<Vec3>& held_impulse,
                     GeneralizedVelocity& change);

/// Finds the pressures q that change the rates D v of the one-rings of `bodies` by `scratch.rate`:
///   D P M^-1 D^T q = rate,
/// to within the tolerance for a step of `dt` (s), and sets `scratch.change` to P M^-1 D^T q. D is the
/// divergence at the last linearization of `bodies.nodal_volumes`. A null `projection` means no contact: P
/// = 1. If the iterations do not suffice, the result is the best so far. Momentum is kept in any case,
/// because the impulses are internal, or those of contacts, which are equal and opposite.
CgResult find_pressures(const Bodies& bodies, const ContactProjection* projection, double dt,
                        const PressureSettings& settings, PressureScratch& scratch);

}  // namespace duet
