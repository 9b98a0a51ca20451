// Conjugate gradients of the velocity solves, island by island. All islands take their steps at the same
// time, each with its own step lengths, and an island that has converged takes part in nothing any more.
#pragma once

#include <limits>
#include <vector>

#include "sim/solve/conjugate_gradient.h"
#include "sim/solve/velocity_system.h"

namespace duet {

/// Scratch of solve_islands(), kept from solve to solve so that nothing is allocated.
struct IslandSearch {
  /// State of the search on one island.
  struct State {
    VelocitySystem::Measure sum;                             ///< Sum over the island that was computed last.
    double left = 0;                                         ///< <r, r> of the residual r.
    double norm = 0;                                         ///< Norm of the residual, m/s.
    double least = std::numeric_limits<double>::infinity();  ///< Least norm of this search, m/s.
    double share = 0;  ///< Factor of the next update: step length, or weight of the last direction, 1.
  };
  std::vector<State> state;                      ///< For each island.
  std::vector<VelocitySystem::Measure> partial;  ///< For each range of particles: its part of a sum.
  GeneralizedVelocity residual,                  ///< The residual r.
      direction,                                 ///< The search direction s.
      image;                                     ///< The product q = A s.
};

/// Solves P A P x = P b as conjugate_gradient(), island by island, starting from `x`. `b` is in the mass
/// inner product of the particles' own masses. Islands whose start is good enough in that inner product cost
/// one product only. For the others the block-Jacobi preconditioner `masses` is assembled, with
/// those of its `blocks`. `system` and `projection` (or null)
/// work with it until the function returns. On return `islands` has no searched island that has converged.
/// The result holds the largest norm (m/s) of all islands.
CgResult solve_islands(VelocitySystem& system, ContactProjection* projection, BlockJacobi& masses,
                       AssembleBlocks blocks, Islands& islands, const GeneralizedVelocity& b,
                       double tolerance, int max_iterations, GeneralizedVelocity& x, IslandSearch& search);

}  // namespace duet
