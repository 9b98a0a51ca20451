#include "sim/deformable/spin.h"

#include "sim/base/dense_solvers.h"

namespace duet {

MassMoments mass_moments(const DeformableBody& body, const Particles& particles) {
  MassMoments moments;
  for_each_particle(body, [&](std::size_t p) {
    moments.mass += particles.mass[p];
    moments.centre += particles.mass[p] * particles.x[p];
  });
  if (moments.mass == 0) return {};
  moments.centre /= moments.mass;
  double square = 0;
  Mat3 squares = Mat3::Zero();
  for_each_particle(body, [&](std::size_t p) {
    const Vec3 r = particles.x[p] - moments.centre;
    square += particles.mass[p] * r.squaredNorm();
    squares += particles.mass[p] * r * r.transpose();
  });
  moments.inertia = square * Mat3::Identity() - squares;
  return moments;
}

Vec3 rate_of_turn(const MassMoments& moments, const Vec3& L) {
  constexpr double least_share = 1e-9;  // of the largest moment of inertia
  const SymmetricEigen<3> axes = symmetric_eigen<3>(moments.inertia);
  Vec3 rate = Vec3::Zero();
  for (int i = 0; i < 3; ++i)
    if (axes.values[i] > least_share * axes.values[2])
      rate += axes.vectors.col(i) * (axes.vectors.col(i).dot(L) / axes.values[i]);
  return rate;
}

void remove_moment(const DeformableBody& body, const Particles& particles, std::vector<Vec3>& force) {
  const MassMoments moments = mass_moments(body, particles);
  Vec3 moment = Vec3::Zero();
  for_each_particle(body,
                    [&](std::size_t p) { moment += (particles.x[p] - moments.centre).cross(force[p]); });
  const Vec3 rate = rate_of_turn(moments, moment);
  for_each_particle(body, [&](std::size_t p) {
    force[p] -= particles.mass[p] * rate.cross(particles.x[p] - moments.centre);
  });
}

}  // namespace duet
