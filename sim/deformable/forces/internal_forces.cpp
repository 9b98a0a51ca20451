#include "sim/deformable/forces/internal_forces.h"

#include <algorithm>

#include "sim/base/parallel.h"

namespace duet {
namespace {

// Calls visit(force) for all forces but the finite elements.
template <class Forces, class Visit>
void for_each_other(Forces& forces, Visit&& visit) {
  visit(forces.membranes);
  visit(forces.edge_springs);
  visit(forces.altitude_springs);
  visit(forces.bending_springs);
  visit(forces.rod_bending);
  visit(forces.shell_bending);
  visit(forces.zero_length_springs);
}

}  // namespace

//     omega^2 <= max over the elements of sum w_i C_i / m_i,   C_i = sum of k w_i around particle i
// Irons' theorem bounds the frequencies of an assembly by those of its elements, each with parts of the
// particles' masses that may be chosen at will. An element that stores no more than k/2 (sum w_i |u_i|)^2
// takes a fraction of the mass of particle i in proportion to k w_i, and so has a omega^2 of at
// most sum w_i C_i / m_i. Only k w_i^2 is given. The w_i of all elements are scaled to a sum of 2, that of a
// spring between two particles. Otherwise bending elements would claim too large or too small a part of the
// masses that they share.
void InternalForces::finalize(const std::vector<double>& mass, const std::vector<double>& inverse_mass,
                              const std::vector<double>& own_mass) {
  if (elements.size() > 0)
    elements.finalize(mass, own_mass, zero_length_springs.omega_squared_by_particle(inverse_mass));
  membranes.finalize(mass.size());
  edge_springs.finalize(mass.size());
  altitude_springs.finalize(inverse_mass);
  bending_springs.finalize(mass.size());
  rod_bending.finalize(mass.size());
  shell_bending.finalize(mass.size());
  zero_length_springs.finalize(mass.size());

  inverse_mass_ = inverse_mass;
  squared_rate_.assign(mass.size(), 0);
  for_each_other(*this, [&](const auto& force) { force.add_stiffness(squared_rate_); });
  lattice_omega_squared_ = lattice_bound(squared_rate_);
  bound_at_rest();
}

double InternalForces::lattice_bound(std::vector<double>& rate) const {
  for (std::size_t p = 0; p < rate.size(); ++p) rate[p] *= inverse_mass_[p];
  double highest = 0;
  for_each_other(*this,
                 [&](const auto& force) { highest = std::max(highest, force.max_omega_squared(rate)); });
  return highest;
}

// The bound sum w_i C_i / m_i of finalize() has weights that add up to 2, so it is at most the largest 2 C_i
// / m_i. Here C_i counts only the stiffness that damping does not hold.
double InternalForces::relaxed_bound() const {
  if (undamped_stiffness_.empty()) return lattice_omega_squared_;
  const double unheld = parallel_reduce(
      undamped_stiffness_.size(), 4096, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double highest = 0;
        for (std::size_t p = begin; p < end; ++p)
          highest =
              std::max(highest, 2 * inverse_mass_[p] * (undamped_stiffness_[p] + geometric_stiffness_[p]));
        return highest;
      },
      [](double a, double b) { return std::max(a, b); });
  return std::min(lattice_omega_squared_, std::max(relaxed_omega_squared_, unheld));
}

void InternalForces::bound_at_rest() {
  rest_omega_squared_ = std::max(elements.rest_omega_squared(), relaxed_bound());
  max_omega_squared_ = rest_omega_squared_;
}

void InternalForces::limit_to(const ParticleMask* mask) {
  elements.limit_to(mask);
  membranes.limit_to(mask);
  edge_springs.limit_to(mask);
  altitude_springs.limit_to(mask);
  bending_springs.limit_to(mask);
  rod_bending.limit_to(mask);
  shell_bending.limit_to(mask);
}

void InternalForces::rely_on_damping(double cfl, double relaxation) {
  elements.rely_on_damping(cfl, relaxation);
  relaxed_omega_squared_ = 0;
  undamped_stiffness_.clear();
  if (relaxation > 0) {
    undamped_stiffness_.assign(squared_rate_.size(), 0);
    membranes.add_stiffness(undamped_stiffness_);
    bending_springs.add_stiffness(undamped_stiffness_);
    rod_bending.add_stiffness(undamped_stiffness_);
    shell_bending.add_stiffness(undamped_stiffness_);
    zero_length_springs.add_stiffness(undamped_stiffness_);
    relaxed_omega_squared_ =
        std::max(edge_springs.rely_on_damping(relaxation, squared_rate_, undamped_stiffness_),
                 altitude_springs.rely_on_damping(relaxation, squared_rate_, undamped_stiffness_));
  }
  if (relaxed_omega_squared_ == 0) undamped_stiffness_.clear();
  geometric_stiffness_.assign(undamped_stiffness_.size(), 0);
  bound_at_rest();
}

double InternalForces::elastic_omega_squared() const {
  return std::max(elements.elastic_omega_squared(), lattice_omega_squared_);
}

bool InternalForces::empty() const {
  std::size_t count = elements.size();
  for_each_other(*this, [&](const auto& force) { count += force.size(); });
  return count == 0;
}

void InternalForces::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                                        const Turn* turn) {
  if (turn && turn->seconds == 0) turn = nullptr;
  elements.add_elastic_forces(x, force, turn);
  std::fill(geometric_stiffness_.begin(), geometric_stiffness_.end(), 0);
  membranes.add_elastic_forces(x, force);
  edge_springs.add_elastic_forces(x, force, geometric_stiffness_, turn);
  altitude_springs.add_elastic_forces(x, force, geometric_stiffness_, turn);
  bending_springs.add_elastic_forces(x, force, turn);
  rod_bending.add_elastic_forces(x, force);
  shell_bending.add_elastic_forces(x, force);
  zero_length_springs.add_elastic_forces(x, force);
  // Stretched membranes scale the bound of bending, too: with K at rest + (stiffening - 1) K of membranes
  // alone, the cloth of hard/cloth with large triangles was thrown apart.
  max_omega_squared_ = std::max(elements.max_omega_squared(), membranes.stiffening() * relaxed_bound());
}

void InternalForces::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  elements.add_damping_forces(v, force);
  for_each_other(*this, [&](auto& other) { other.add_damping_forces(v, force); });
}

void InternalForces::add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force) {
  if (seconds == 0) return;
  elements.add_turn_forces(v, seconds, force);
  membranes.add_turn_forces(v, seconds, force);
  edge_springs.add_turn_forces(v, seconds, force);
  altitude_springs.add_turn_forces(v, seconds, force);
  bending_springs.add_turn_forces(v, seconds, force);
}

void InternalForces::add_kept_turn_forces(const Turn& turn, std::vector<Vec3>& force) {
  if (turn.seconds == 0) return;
  elements.add_kept_turn_forces(force);
  membranes.add_turn_forces(turn.v, turn.seconds, force);
  edge_springs.add_kept_turn_forces(force);
  altitude_springs.add_kept_turn_forces(force);
  bending_springs.add_kept_turn_forces(force);
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
  rod_bending.add_damping_blocks(blocks);
  shell_bending.add_damping_blocks(blocks);
}

void InternalForces::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  elements.add_force_differentials(dx, force);
  for_each_other(*this, [&](auto& other) { other.add_force_differentials(dx, force); });
}

void InternalForces::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  elements.append_blocks(factors, blocks);
  for_each_other(*this, [&](const auto& other) { other.append_blocks(factors, blocks); });
}

void InternalForces::linearize() { elements.linearize(); }

double InternalForces::energy(const std::vector<Vec3>& x) const {
  double sum = elements.energy(x);
  for_each_other(*this, [&](const auto& force) { sum += force.energy(x); });
  return sum;
}

}  // namespace duet
