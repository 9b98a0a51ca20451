// Steps that gain energy, and are taken again in shorter ones.
//
// Implicit steps are stable whatever their length as long as they are balanced, but not at their beginning:
// the middle of a step finds the shape in which elastic forces and inertia balance, and the end lies as far
// beyond it again. What begins to turn by an angle a within a step, as it is thrown or lands on an edge, is
// stretched by a^2/8 there, and where a blow folds elements they are turned inside out. In stiff bodies that
// is many times the energy of the motion. It falls with the fourth power of the step, so that a few shorter
// ones carry the body through.
//
// Rigid bodies in contact gain as they turn: the contact forces of a step act at the places and along the
// normals of its beginning, from which both turn away within it, by a quarter of a radian at most. That falls
// with the second power of the step. Semi-implicit steps of elastic bodies are not asked, as their energy
// goes up and down by itself.
#include <algorithm>

#include "sim/step/step.h"

namespace duet {
namespace {

// What a step may gain, of the energy that moves and deforms bodies. Implicit ones: of fifty in a row a
// thousandth. Of rigid bodies those that gain are few.
constexpr double implicit_share = 2e-5, rigid_share = 1e-3;
// And of the energy that gravity gives in a step: contact lifts what rests by its tolerances.
constexpr double rest_share = 0.02;

// Of what the refused step before has gained: a shorter one that gains more is no remedy, unless it is much,
// more than this share of what moves and deforms.
constexpr double least_help = 0.5, much = 2e-4;

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
  return world.has_internal_forces() ? world.settings.implicit_elasticity : world.touches();
}

StoredEnergy energy_now(const World& world) {
  const Bodies& bodies = world.bodies;
  const double moving = kinetic_energy(bodies) + bodies.forces.energy(bodies.particles.x);
  return {.moving = moving, .all = moving + gravitational_energy(bodies, world.gravity)};
}

bool gains_energy(const World& world, const StoredEnergy& before, Refusal& refusal) {
  if (is_driven(world)) return false;
  const bool is_implicit = world.has_internal_forces();
  const StoredEnergy now = energy_now(world);
  const double gain = now.all - before.all, mass = mass_of(world.bodies);  // J, kg
  const double tolerance = world.settings.cg_tolerance;                    // m/s
  double allowed = mass * tolerance * tolerance;
  if (is_implicit) {
    allowed += implicit_share * now.moving;
  } else {
    const double fall = world.gravity.norm() * world.context.dt;  // m/s
    allowed += rigid_share * now.moving + rest_share * 0.5 * mass * fall * fall;
  }
  if (!(gain > allowed)) return false;
  const bool helps = gain < least_help * refusal.gain || (is_implicit && gain > much * now.moving);
  refusal.gain = gain;
  return helps;
}

}  // namespace duet
