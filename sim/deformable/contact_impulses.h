// What contact gives to particles, in sums that output reads and that no step reads.
#pragma once

#include <vector>

#include "sim/base/types.h"

namespace duet {

/// Impulses of contact on particles, as structure of arrays with an entry for each particle.
struct ContactImpulses {
  std::vector<Vec3> total;     ///< N s, impulse with friction, world axes
  std::vector<double> normal;  ///< N s, sum of the parts along the normals of contacts, positive
  /// N s, the part of `total` that has no normals: impulses of self-collisions and of projections
  std::vector<Vec3> without_normal;

  /// Sets all impulses on `count` particles to zero.
  void reset(std::size_t count) {
    total.assign(count, Vec3::Zero());
    normal.assign(count, 0);
    without_normal.assign(count, Vec3::Zero());
  }
  /// Adds an impulse (N s) to particle `p`, with its part `along_normal` (N s) along the contact's normal.
  void add(std::size_t p, const Vec3& impulse, double along_normal) {
    total[p] += impulse;
    normal[p] += along_normal;
  }
  /// Adds an impulse (N s) whose normal is not known to particle `p`.
  void add(std::size_t p, const Vec3& impulse) {
    total[p] += impulse;
    without_normal[p] += impulse;
  }
  /// Adds all impulses of `other`, which has as many particles.
  void add(const ContactImpulses& other) {
    for (std::size_t p = 0; p < total.size(); ++p) {
      total[p] += other.total[p];
      normal[p] += other.normal[p];
      without_normal[p] += other.without_normal[p];
    }
  }
};

}  // namespace duet
