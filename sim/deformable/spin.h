// How deformable bodies turn as wholes.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"

namespace duet {

// Of masses at points as they lie now.
struct MassMoments {
  double mass = 0;              // kg
  Vec3 centre = Vec3::Zero();   // m
  Mat3 inertia = Mat3::Zero();  // kg m^2, about the centre
};
// `for_each_mass(visit)` calls visit(mass, x) for all of them, in the same order each time.
template <class ForEachMass>
MassMoments moments_of_masses(ForEachMass&& for_each_mass) {
  MassMoments moments;
  for_each_mass([&](double mass, const Vec3& x) {
    moments.mass += mass;
    moments.centre += mass * x;
  });
  if (moments.mass == 0) return {};
  moments.centre /= moments.mass;
  double square = 0;
  Mat3 squares = Mat3::Zero();
  for_each_mass([&](double mass, const Vec3& x) {
    const Vec3 r = x - moments.centre;
    square += mass * r.squaredNorm();
    squares += mass * r * r.transpose();
  });
  moments.inertia = square * Mat3::Identity() - squares;
  return moments;
}

// What turns with angular momentum L (N m s) about its centre, rad/s: nothing where it cannot, as a body on a
// line about that line.
Vec3 rate_of_turn(const MassMoments& moments, const Vec3& L);

// Takes the moment of `force` (N) on the particles of a body away, by forces that add up to nothing and are
// in proportion to mass and distance.
void remove_moment(const DeformableBody& body, const Particles& particles, std::vector<Vec3>& force);

}  // namespace duet
