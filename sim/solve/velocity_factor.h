// Factorized matrix of a velocity solve, as the preconditioner of its conjugate gradients. With it they
// converge in a few iterations, where stiff systems need hundreds with the diagonal blocks alone
// (VelocityBlocks).
#pragma once

#include <vector>

#include "sim/base/sparse_cholesky.h"
#include "sim/solve/contact_forces.h"
#include "sim/solve/joint_forces.h"
#include "sim/solve/velocity_system.h"

namespace duet {

/// The matrix M A of a velocity solve over free particles and dynamic rigid bodies of searched islands, with
/// damping, elasticity, contact and drives of joints:
///
///     S = M + dt D + dt^2 K + sum A^T G A
///
/// Embedded particles move with their bodies. Only the constraints of a projection are missing.
class VelocityFactor {
 public:
  /// Assembles the matrix for a solve of `dt` (s) in the state of the last elastic evaluation, and factorizes
  /// it. Elasticity is that of the last linearization. `inertia` (kg m^2) is that of each rigid body in world
  /// axes; null `islands` are all bodies, null `contacts` or `joints` none.
  ///
  /// Returns false if the factorization would take longer than some hundred iterations of conjugate
  /// gradients, or if the matrix is not positive definite to rounding. apply() must not be called then.
  bool factorize(const Bodies& bodies, double dt, ImplicitForces forces, const std::vector<Mat3>& inertia,
                 const Islands* islands, const ContactForces* contacts, const JointForces* joints);
  /// Forgets earlier matrices, so that the next factorization does not depend on them.
  void forget() { factor_.forget(); }
  /// Applies the preconditioner: out = S^-1 M residual, m/s and rad/s. Resizes `out`. The velocities of
  /// particles and bodies that are not in the matrix become 0.
  void apply(const Bodies& bodies, const std::vector<Mat3>& inertia, const GeneralizedVelocity& residual,
             GeneralizedVelocity& out);

 private:
  // A block row that moves a particle, and how: its velocity is `map` times that of the row.
  struct Handle {
    int row = -1;
    Mat3 map = Mat3::Identity();
  };
  // Numbers the rows.
  void number(const Bodies& bodies, const Islands* islands);
  void add_masses(const Bodies& bodies, const std::vector<Mat3>& inertia);
  void add_forces(const Bodies& bodies, const BlockFactors& factors);
  void add_rows();
  // Adds a block between two handles, and its transposed one unless both are the same.
  void add(const Handle& a, const Handle& b, const Mat3& block);

  std::vector<int> particle_row_,  // for each particle: its row; -1: none
      rigid_row_,                  // for each rigid body: the row of its linear velocity, before that of its
                                   // angular velocity; -1: none
      bound_;                      // for each particle: its index in Bodies::bound; -1: it is not embedded
  std::size_t rows_ = 0;
  std::vector<ParticleBlock> forces_;   // scratch
  std::vector<ResponseRow> responses_;  // scratch
  std::vector<SparseBlock> blocks_;     // kg
  std::vector<Vec3> values_;            // scratch of apply()
  SparseCholesky factor_;
};

}  // namespace duet
