// Conjugate gradients of the velocity solves, island by island: all take their steps at the same time, each
// by its own lengths, and one that has converged is left out of everything from then on.
#pragma once

#include <vector>

#include "sim/solve/conjugate_gradient.h"
#include "sim/solve/velocity_system.h"

namespace duet {

// Reused from solve to solve.
struct IslandSearch {
  struct State {
    VelocitySystem::Measure sum;
    double left = 0;   // <r, r> of the residual r
    double norm = 0;   // m/s, of r
    double share = 0;  // of the next update
  };
  std::vector<State> state;                      // of every island
  std::vector<VelocitySystem::Measure> partial;  // of every range of particles
  GeneralizedVelocity residual, direction, image;
};

// As conjugate_gradient(), for a right side `b` that is not weighed. Islands whose start is good enough with
// their particles' own masses cost but that product; only the others have `masses` found, in which `system`
// and `projection` (or null) work until this returns.
CgResult solve_islands(VelocitySystem& system, ContactProjection* projection, DampedMasses& masses, bool anew,
                       Islands& islands, const GeneralizedVelocity& b, double tolerance, int max_iterations,
                       GeneralizedVelocity& x, IslandSearch& search);

}  // namespace duet
