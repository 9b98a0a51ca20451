// All forces that deformable bodies exert on themselves, as the time step and its solves see them: one sum,
// whatever a body is made of.
#pragma once

#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/finite_elements.h"

namespace duet {

class InternalForces {
 public:
  FiniteElements elements;

  // To be called once after everything has been added. `mass` gives the particles' masses (kg).
  void finalize(const std::vector<double>& mass);
  bool empty() const { return elements.size() == 0; }

  // Adds the elastic forces at `x` to `force` (N) and keeps the state of deformation for the other two.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force);
  // Adds the viscous forces for the velocities `v` in the state of the last add_elastic_forces: linear in v,
  // symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // Added to the damping times of all that resists by its stiffness, s.
  void set_added_damping(double seconds) { elements.set_added_damping(seconds); }
  // Adds the change of the elastic forces for displacements `dx` (m) from the state of the last
  // add_elastic_forces that linearize() was called for: linear in dx, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  void linearize();
  double energy(const std::vector<Vec3>& x) const;  // J

  // Bounds of the square of the highest frequency, rad^2/s^2: in the state of the last add_elastic_forces (at
  // rest before the first), and at rest.
  double max_squared_frequency() const { return elements.max_squared_frequency(); }
  double rest_squared_frequency() const { return elements.rest_squared_frequency(); }
  // For a resumed run: the next step's size depends on it.
  void set_max_squared_frequency(double value) { elements.set_max_squared_frequency(value); }
};

}  // namespace duet
