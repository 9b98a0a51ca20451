// How deformable bodies turn as wholes.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"

namespace duet {

// Of the particles of a body as they lie now.
struct MassMoments {
  double mass = 0;              // kg
  Vec3 centre = Vec3::Zero();   // m
  Mat3 inertia = Mat3::Zero();  // kg m^2, about the centre
};
MassMoments mass_moments(const DeformableBody& body, const Particles& particles);

// What turns with angular momentum L (N m s) about its centre, rad/s: nothing where it cannot, as a body on a
// line about that line.
Vec3 rate_of_turn(const MassMoments& moments, const Vec3& L);

// Takes the moment of `force` (N) on the particles of a body away, by forces that add up to nothing and are
// in proportion to mass and distance.
void remove_moment(const DeformableBody& body, const Particles& particles, std::vector<Vec3>& force);

}  // namespace duet
