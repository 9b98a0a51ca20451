#include "sim/deformable/forces/zero_length_springs.h"

#include <algorithm>

#include "sim/base/parallel.h"

namespace duet {
namespace {

// Number of zero-length springs in a chunk of a parallel loop.
constexpr std::size_t grain = 256;

// Returns the value at a minus the value at b.
Vec3 difference(const ZeroLengthSpring& spring, const std::vector<Vec3>& values) {
  return values[as_index(spring.a)] - values[as_index(spring.b)];
}

}  // namespace

template <class Factor>
void ZeroLengthSprings::add(const std::vector<Vec3>& values, std::vector<Vec3>& force,
                            Factor&& factor_of) const {
  parallel_for(springs_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ZeroLengthSpring& spring = springs_[i];
      const Vec3 pull = factor_of(spring) * difference(spring, values);
      force[as_index(spring.a)] -= pull;
      force[as_index(spring.b)] += pull;
    }
  });
}

void ZeroLengthSprings::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) const {
  add(x, force, [](const ZeroLengthSpring& spring) { return spring.stiffness; });
}

void ZeroLengthSprings::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) const {
  add(v, force, [](const ZeroLengthSpring& spring) { return spring.viscosity; });
}

void ZeroLengthSprings::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) const {
  add_elastic_forces(dx, force);
}

void ZeroLengthSprings::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  for (const ZeroLengthSpring& spring : springs_) {
    const Mat3 along =
        (factors.damping * spring.viscosity + factors.elasticity * spring.stiffness) * Mat3::Identity();
    append_block(spring.a, spring.a, along, blocks);
    append_block(spring.b, spring.b, along, blocks);
    append_block(spring.a, spring.b, -along, blocks);
  }
}

double ZeroLengthSprings::energy(const std::vector<Vec3>& x) const {
  double sum = 0;
  for (const ZeroLengthSpring& spring : springs_)
    sum += 0.5 * spring.stiffness * difference(spring, x).squaredNorm();
  return sum;
}

void ZeroLengthSprings::add_stiffness(std::vector<double>& stiffness) const {
  for (const ZeroLengthSpring& spring : springs_)
    for (const int p : {spring.a, spring.b}) stiffness[as_index(p)] += spring.stiffness;
}

double ZeroLengthSprings::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (const ZeroLengthSpring& spring : springs_)
    highest = std::max(highest, squared_rate[as_index(spring.a)] + squared_rate[as_index(spring.b)]);
  return highest;
}

std::vector<double> ZeroLengthSprings::omega_squared_by_particle(
    const std::vector<double>& inverse_mass) const {
  std::vector<double> bound;
  if (!springs_.empty()) bound.assign(inverse_mass.size(), 0);
  for (const ZeroLengthSpring& spring : springs_) {
    const std::size_t a = as_index(spring.a), b = as_index(spring.b);
    bound[a] = bound[b] = spring.stiffness * (inverse_mass[a] + inverse_mass[b]);
  }
  return bound;
}

}  // namespace duet
