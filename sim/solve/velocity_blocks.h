// What preconditions the velocity solves that contact takes part in.
#pragma once

#include <vector>

#include "sim/solve/contact_forces.h"
#include "sim/solve/velocity_system.h"

namespace duet {

// The blocks on the diagonal of the system (in momenta, kg), as far as particles and rigid bodies are by
// themselves: three rows of a particle, with what damps it, holds it elastically and what it touches; six of
// a rigid body.
class VelocityBlocks {
 public:
  // Of the particles alone, without contact, for a solve of `dt` (s) with the damping of the last elastic
  // evaluation's deformation.
  void find(Bodies& bodies, double dt);
  // Their inverses, 1/kg; zero for particles that are held.
  const std::vector<SymmetricBlock>& own() const { return own_; }
  // Of everything. `inertia` of the rigid bodies is in world axes.
  void add(const Bodies& bodies, const std::vector<Mat3>& inertia, const ContactForces* contacts);
  // out = B^-1 M residual.
  void apply(const Bodies& bodies, const std::vector<Mat3>& inertia, const GeneralizedVelocity& residual,
             GeneralizedVelocity& out) const;

 private:
  std::vector<SymmetricBlock> block_, own_, inverse_;
  std::vector<Mat6> rigid_, rigid_inverse_;
};

}  // namespace duet
