#include "sim/deformable/internal_forces.h"

#include <algorithm>

namespace duet {
namespace {

// Calls visit(force) for all forces but the finite elements.
template <class Forces, class Visit>
void for_each_other(Forces& forces, Visit&& visit) {
  visit(forces.membranes);
  visit(forces.edge_springs);
  visit(forces.altitude_springs);
  visit(forces.bending_springs);
  visit(forces.bending_elements);
  visit(forces.tethers);
}

}  // namespace

// Irons' theorem bounds the frequencies of an assembly by those of its elements, each with its shares of the
// particles' masses, which may be divided at will. An element that stores no more than k/2 (sum w_i |u_i|)^2
// takes a share of particle i in proportion to k w_i, and comes out with a squared frequency of at most
// sum w_i C_i / m_i, where C_i is the sum of k w_i over all elements around the particle. Only k w_i^2 is
// given: all elements have their w_i scaled to a sum of 2, that of a spring between two particles, as
// otherwise what resists bending would claim too much or too little of the masses that it shares.
void InternalForces::finalize(const std::vector<double>& mass, const std::vector<double>& inverse_mass) {
  if (elements.size() > 0) elements.finalize(mass);
  membranes.finalize(mass.size());
  edge_springs.finalize(mass.size());
  altitude_springs.finalize(inverse_mass);
  bending_springs.finalize(mass.size());
  bending_elements.finalize(mass.size());
  tethers.finalize(mass.size());

  std::vector<double> squared_rate(mass.size(), 0);  // C_i / m_i
  for_each_other(*this, [&](const auto& force) { force.add_stiffness(squared_rate); });
  for (std::size_t p = 0; p < mass.size(); ++p) squared_rate[p] *= inverse_mass[p];
  for_each_other(*this, [&](const auto& force) {
    lattice_squared_frequency_ =
        std::max(lattice_squared_frequency_, force.max_squared_frequency(squared_rate));
  });
  bound_at_rest();
}

void InternalForces::bound_at_rest() {
  rest_squared_frequency_ = std::max(elements.rest_squared_frequency(), lattice_squared_frequency_);
  max_squared_frequency_ = rest_squared_frequency_;
}

void InternalForces::limit_to(const ParticleMask* mask) {
  elements.limit_to(mask);
  membranes.limit_to(mask);
  edge_springs.limit_to(mask);
  altitude_springs.limit_to(mask);
  bending_springs.limit_to(mask);
  bending_elements.limit_to(mask);
}

void InternalForces::rely_on_damping(double cfl, double relaxation) {
  elements.rely_on_damping(cfl, relaxation);
  bound_at_rest();
}

double InternalForces::elastic_squared_frequency() const {
  return std::max(elements.elastic_squared_frequency(), lattice_squared_frequency_);
}

bool InternalForces::empty() const {
  std::size_t count = elements.size();
  for_each_other(*this, [&](const auto& force) { count += force.size(); });
  return count == 0;
}

void InternalForces::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
  elements.add_elastic_forces(x, force);
  for_each_other(*this, [&](auto& other) { other.add_elastic_forces(x, force); });
  max_squared_frequency_ =
      std::max(elements.max_squared_frequency(), membranes.stiffening() * lattice_squared_frequency_);
}

void InternalForces::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  elements.add_damping_forces(v, force);
  for_each_other(*this, [&](auto& other) { other.add_damping_forces(v, force); });
}

void InternalForces::add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  elements.add_damping_forces_single(v, force);
  for_each_other(*this, [&](auto& other) {
    if constexpr (requires { other.add_damping_forces_single(v, force); })
      other.add_damping_forces_single(v, force);
    else
      other.add_damping_forces(v, force);
  });
}

void InternalForces::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  elements.add_damping_blocks(blocks);
  edge_springs.add_damping_blocks(blocks);
  altitude_springs.add_damping_blocks(blocks);
  bending_springs.add_damping_blocks(blocks);
  bending_elements.add_damping_blocks(blocks);
}

void InternalForces::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  elements.add_force_differentials(dx, force);
  for_each_other(*this, [&](auto& other) { other.add_force_differentials(dx, force); });
}

void InternalForces::linearize() { elements.linearize(); }

double InternalForces::energy(const std::vector<Vec3>& x) const {
  double sum = elements.energy(x);
  for_each_other(*this, [&](const auto& force) { sum += force.energy(x); });
  return sum;
}

}  // namespace duet
