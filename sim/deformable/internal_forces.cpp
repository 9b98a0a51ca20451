#include "sim/deformable/internal_forces.h"

namespace duet {

void InternalForces::finalize(const std::vector<double>& mass) {
  if (elements.size() > 0) elements.finalize(mass);
}

void InternalForces::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
  elements.add_elastic_forces(x, force);
}

void InternalForces::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  elements.add_damping_forces(v, force);
}

void InternalForces::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  elements.add_force_differentials(dx, force);
}

void InternalForces::linearize() { elements.linearize(); }

double InternalForces::energy(const std::vector<Vec3>& x) const { return elements.energy(x); }

}  // namespace duet
