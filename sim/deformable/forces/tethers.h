// Springs without length between pairs of particles, the same in all directions: soft bindings (Sifakis,
// Shinar, Irving, Fedkiw 2007) of flesh to points that a bone carries. With d = x_a - x_b a tether of
// stiffness k and viscosity c stores psi = k/2 d^2 and pulls a with -k d - c d'.
//
// Forces keep angular momentum exactly where b's share of them acts at x_a, as BoundParticle::at says, and
// the velocity of b is that of its body there.
#pragma once

#include <vector>

#include "sim/base/types.h"

namespace duet {

struct Tether {
  int a = 0, b = 0;      // particles; no particle is in two tethers
  double stiffness = 0;  // N/m
  double viscosity = 0;  // N s/m
};

class Tethers {
 public:
  void add(const Tether& tether) { tethers_.push_back(tether); }
  void finalize(std::size_t) {}
  std::size_t size() const { return tethers_.size(); }
  const std::vector<Tether>& all() const { return tethers_; }

  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) const;
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) const;
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) const;
  double energy(const std::vector<Vec3>& x) const;  // J

  // See InternalForces::finalize.
  void add_stiffness(std::vector<double>& stiffness) const;
  double max_squared_frequency(const std::vector<double>& squared_rate) const;

 private:
  template <class Factor>
  void add(const std::vector<Vec3>& values, std::vector<Vec3>& force, Factor&& factor_of) const;

  std::vector<Tether> tethers_;
};

}  // namespace duet
