// Block-Jacobi preconditioner of the velocity solves that contact takes part in.
#pragma once

#include <vector>

#include "sim/solve/contact_forces.h"
#include "sim/solve/joint_forces.h"
#include "sim/solve/velocity_system.h"

namespace duet {

/// The diagonal blocks B of the system M A, in momenta (kg): three rows for each particle, with its damping,
/// elasticity and contact, and six rows for each rigid body. Use: find(), build the contacts with own(),
/// add(), then apply().
class VelocityBlocks {
 public:
  /// Assembles the blocks of the particles without contact: m + dt C with the own damping C of a particle,
  /// for the deformation of the last elastic evaluation. Elasticity is part of C if the caller has set it as
  /// damping, see InternalForces::set_added_damping().
  void find(Bodies& bodies, double dt);
  /// Returns the inverses of the blocks of find(), 1/kg; zero for held particles.
  const std::vector<SymmetricBlock>& own() const { return own_; }
  /// Adds `contacts` and `joints` (or null) to the blocks, assembles those of the rigid bodies with their
  /// `inertia` (kg m^2, world axes), and inverts all of them. The blocks of find() stay as they are.
  void add(const Bodies& bodies, const std::vector<Mat3>& inertia, const ContactForces* contacts,
           const JointForces* joints);
  /// Applies the preconditioner: out = B^-1 M residual, m/s and rad/s. Resizes `out`.
  void apply(const Bodies& bodies, const std::vector<Mat3>& inertia, const GeneralizedVelocity& residual,
             GeneralizedVelocity& out) const;

 private:
  std::vector<SymmetricBlock> block_,  // kg, for each particle: its block without contact
      own_,                            // 1/kg, inverses of block_
      inverse_;                        // 1/kg, inverses of the blocks with contact
  std::vector<Mat6> rigid_,            // kg, kg m, kg m^2, for each rigid body
      rigid_inverse_;                  // inverses of rigid_; zero for static and kinematic bodies
};

}  // namespace duet
