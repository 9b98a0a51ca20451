#include "sim/deformable/spin.h"

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"

namespace duet {

Vec3 angular_velocity_of(const MassMoments& moments, const Vec3& L) {
  // Smallest moment of inertia about an axis, relative to the largest one, for the axis to carry rotation.
  constexpr double min_share = 1e-9;
  const SymmetricEigen<3> axes = symmetric_eigen<3>(moments.inertia);
  Vec3 rate = Vec3::Zero();
  for (int i = 0; i < 3; ++i)
    if (axes.values[i] > min_share * axes.values[2])
      rate += axes.vectors.col(i) * (axes.vectors.col(i).dot(L) / axes.values[i]);
  return rate;
}

void remove_moment(const DeformableBody& body, const Particles& particles, std::vector<Vec3>& force) {
  DUET_ASSERT(force.size() == particles.size());
  const MassMoments moments = moments_of_masses([&](auto&& visit) {
    for_each_particle(body, [&](std::size_t p) { visit(particles.mass[p], particles.x[p]); });
  });
  Vec3 moment = Vec3::Zero();
  for_each_particle(body,
                    [&](std::size_t p) { moment += (particles.x[p] - moments.center).cross(force[p]); });
  const Vec3 rate = angular_velocity_of(moments, moment);
  for_each_particle(body, [&](std::size_t p) {
    force[p] -= particles.mass[p] * rate.cross(particles.x[p] - moments.center);
  });
}

}  // namespace duet
