// All forces that deformable bodies exert on themselves, as the time step and its solves see them: one sum,
// whatever a body is made of.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/forces/altitude_springs.h"
#include "sim/deformable/forces/finite_elements.h"
#include "sim/deformable/forces/membranes.h"
#include "sim/deformable/forces/springs.h"
#include "sim/deformable/forces/tethers.h"

namespace duet {

// A particle of finite elements belongs to no other force; springs, membranes and bending may share
// particles.
class InternalForces {
 public:
  FiniteElements elements;           // of volumes
  Membranes membranes;               // of shells
  Springs<2> edge_springs;           // of volumes, shells and rods
  AltitudeSprings altitude_springs;  // of volumes
  Springs<2> bending_springs;        // of shells and rods
  Springs<4> bending_elements;       // of shells and rods
  Tethers tethers;                   // of flesh to bones

  // To be called once after everything has been added, with the particles' masses (kg) and their inverses,
  // which are 0 for those that never move.
  void finalize(const std::vector<double>& mass, const std::vector<double>& inverse_mass);
  bool empty() const;
  // Damping forces and blocks are needed of the particles of `mask` only, until the next call; null for all.
  void limit_to(const ParticleMask* mask);

  // To be called once a step at x^n: what is chosen anew in position updates only.
  void begin_step(const std::vector<Vec3>& x) { altitude_springs.choose(x); }
  // Adds the elastic forces at `x` to `force` (N) and keeps the state of deformation for the other two.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force);
  // Adds the viscous forces for the velocities `v` in the state of the last add_elastic_forces: linear in v,
  // symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // The same in single precision, but for membranes and tethers.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // Whether they may have a moment on a body, from bones or from a medium; else they have neither moment nor
  // sum.
  bool turn_bodies() const { return tethers.size() > 0 || elements.brakes(); }
  // Adds every particle's own block of minus that operator, kg/s, of all but membranes and tethers.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  // See FiniteElements. Springs on edges and altitudes are lifted as elements are: of those whose viscosity
  // is tau times their stiffness, limits of `relaxation` tau do.
  void rely_on_damping(double cfl, double relaxation);
  void set_time_step(double dt) { elements.set_time_step(dt); }
  // Added to the damping times of the finite elements, s.
  void set_added_damping(double seconds) { elements.set_added_damping(seconds); }
  // Adds the change of the elastic forces for displacements `dx` (m) from the state of the last
  // add_elastic_forces, for which linearize() was called, without what would destabilize an implicit solve:
  // linear in dx, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  void linearize();
  double energy(const std::vector<Vec3>& x) const;  // J

  // Bounds of the square of the highest frequency, rad^2/s^2: in the state of the last add_elastic_forces (at
  // rest before the first), and at rest.
  double max_squared_frequency() const { return max_squared_frequency_; }
  double rest_squared_frequency() const { return rest_squared_frequency_; }
  // The latter if damping held nothing.
  double elastic_squared_frequency() const;
  // For a resumed run: the next step's size depends on it.
  void set_max_squared_frequency(double value) { max_squared_frequency_ = value; }

 private:
  double lattice_bound(std::vector<double>& rate) const;
  double lifted_bound() const;
  void bound_at_rest();

  double lattice_squared_frequency_ = 0;  // of all but the finite elements, at rest
  double relaxed_squared_frequency_ = 0;  // of what it holds
  std::vector<double> inverse_mass_;      // 1/kg
  std::vector<double> kept_;  // N/m, sums around the particles of the stiffness that it does not; empty: all
  std::vector<double> sideways_;      // N/m, the same of what it holds, in other directions
  std::vector<double> squared_rate_;  // rad^2/s^2, see finalize()
  double max_squared_frequency_ = 0, rest_squared_frequency_ = 0;
};

}  // namespace duet
