// Implicit steps are stable whatever their length as long as they are balanced, but not at their beginning:
// the middle of a step finds the shape in which elastic forces and inertia balance, and the end lies as far
// beyond it again. What begins to turn by an angle a within a step, as it is thrown or lands on an edge, is
// stretched by a^2/8 there, and where a blow folds elements they are turned inside out. In stiff bodies that
// is many times the energy of the motion. It falls with the fourth power of the step, so that a few shorter
// ones carry the body through.
#include <algorithm>

#include "sim/step/step.h"

namespace duet {
namespace {

// What a step may gain, of the energy that moves and deforms bodies: of fifty in a row a thousandth.
constexpr double gain_share = 2e-5;

// Something whose work is not known: motors and what the scene leads about.
bool is_driven(const World& world) {
  const std::vector<Joint>& joints = world.bodies.articulation.joints;
  const std::vector<KinematicStep>& kinematic = world.context.kinematic;
  return !world.settings.push_out.overlapping.empty() ||
         std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.control.on; }) ||
         std::any_of(kinematic.begin(), kinematic.end(), [&](const KinematicStep& step) {
           const RigidState& before = world.context.rigid_n[step.body];
           return !(step.mean_velocity.isZero(0) && step.mean_angular_velocity.isZero(0) &&
                    step.end.velocity.isZero(0) && step.end.angular_velocity.isZero(0) &&
                    before.velocity.isZero(0) && before.angular_velocity.isZero(0));
         });
}

double mass_of(const Bodies& bodies) {
  double mass = 0;
  for (const DeformableBody& body : bodies.deformable) mass += body.mass;
  for (const RigidProperties& properties : bodies.rigid.properties)
    if (properties.is_dynamic()) mass += properties.mass;
  return mass;
}

}  // namespace

bool may_gain_energy(const World& world) {
  return world.settings.implicit_elasticity && world.has_internal_forces();
}

StoredEnergy energy_now(const World& world) {
  const Bodies& bodies = world.bodies;
  const double moving = kinetic_energy(bodies) + bodies.forces.energy(bodies.particles.x);
  return {.moving = moving, .all = moving + gravitational_energy(bodies, world.gravity)};
}

double gained_energy(const World& world, const StoredEnergy& before) {
  if (is_driven(world)) return 0;
  const StoredEnergy now = energy_now(world);
  const double gain = now.all - before.all, tolerance = world.settings.cg_tolerance;  // J, m/s
  const double allowed = gain_share * now.moving + mass_of(world.bodies) * tolerance * tolerance;
  return gain > allowed ? gain : 0;
}

}  // namespace duet
