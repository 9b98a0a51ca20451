// Rotation of deformable bodies as a whole: their moments of inertia, and the removal of moments from forces.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"

namespace duet {

/// Mass, center of mass and inertia of a set of point masses in the world.
struct MassMoments {
  double mass = 0;              ///< kg, total mass
  Vec3 center = Vec3::Zero();   ///< m, center of mass
  Mat3 inertia = Mat3::Zero();  ///< kg m^2, about the center of mass
};
/// Returns the moments of all point masses; all zero if their total mass is 0.
///
/// `for_each_mass(visit)` must call visit(mass in kg, position in m) for all masses, in the same order each
/// time: it is called twice.
template <class ForEachMass>
MassMoments moments_of_masses(ForEachMass&& for_each_mass) {
  MassMoments moments;
  for_each_mass([&](double mass, const Vec3& x) {
    moments.mass += mass;
    moments.center += mass * x;
  });
  if (moments.mass == 0) return {};
  moments.center /= moments.mass;
  double square = 0;
  Mat3 squares = Mat3::Zero();
  for_each_mass([&](double mass, const Vec3& x) {
    const Vec3 r = x - moments.center;
    square += mass * r.squaredNorm();
    squares += mass * r * r.transpose();
  });
  moments.inertia = square * Mat3::Identity() - squares;
  return moments;
}

/// Returns the angular velocity (rad/s) that masses with angular momentum `L` (N m s) about their center have
/// as a rigid body.
///
/// The component about an axis with no moment of inertia is 0, for example about the line on which all masses
/// lie.
Vec3 angular_velocity_of(const MassMoments& moments, const Vec3& L);

/// Removes the moment of `force` (N, one entry for each particle) on a body about its center of mass.
///
/// It subtracts m r x (x - c), where r turns the moment into an angular rate by the inverse inertia. These
/// forces add up to zero, so the resultant stays.
void remove_moment(const DeformableBody& body, const Particles& particles, std::vector<Vec3>& force);

}  // namespace duet
