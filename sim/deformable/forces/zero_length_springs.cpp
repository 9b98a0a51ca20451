#include "sim/deformable/forces/zero_length_springs.h"

#include <algorithm>

#include "sim/base/parallel.h"

namespace duet {
namespace {

// Number of tethers in a chunk of a parallel loop.
constexpr std::size_t grain = 256;

// Returns the value at a minus the value at b.
Vec3 difference(const ZeroLengthSpring& tether, const std::vector<Vec3>& values) {
  return values[as_index(tether.a)] - values[as_index(tether.b)];
}

}  // namespace

template <class Factor>
void ZeroLengthSprings::add(const std::vector<Vec3>& values, std::vector<Vec3>& force,
                            Factor&& factor_of) const {
  parallel_for(tethers_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ZeroLengthSpring& tether = tethers_[i];
      const Vec3 pull = factor_of(tether) * difference(tether, values);
      force[as_index(tether.a)] -= pull;
      force[as_index(tether.b)] += pull;
    }
  });
}

void ZeroLengthSprings::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) const {
  add(x, force, [](const ZeroLengthSpring& tether) { return tether.stiffness; });
}

void ZeroLengthSprings::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) const {
  add(v, force, [](const ZeroLengthSpring& tether) { return tether.viscosity; });
}

void ZeroLengthSprings::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) const {
  add_elastic_forces(dx, force);
}

double ZeroLengthSprings::energy(const std::vector<Vec3>& x) const {
  double sum = 0;
  for (const ZeroLengthSpring& tether : tethers_)
    sum += 0.5 * tether.stiffness * difference(tether, x).squaredNorm();
  return sum;
}

void ZeroLengthSprings::add_stiffness(std::vector<double>& stiffness) const {
  for (const ZeroLengthSpring& tether : tethers_)
    for (const int p : {tether.a, tether.b}) stiffness[as_index(p)] += tether.stiffness;
}

double ZeroLengthSprings::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (const ZeroLengthSpring& tether : tethers_)
    highest = std::max(highest, squared_rate[as_index(tether.a)] + squared_rate[as_index(tether.b)]);
  return highest;
}

}  // namespace duet
