// The check for steps that gain energy, which are repeated as shorter steps.
//
// Implicit steps are stable at any length as long as elastic forces and inertia balance, but not when a
// motion begins. The middle of a step finds the shape in which elastic forces and inertia balance, and the
// end lies as far beyond it again. A body that begins to turn by an angle a within a step, because it is
// thrown or lands on an edge, is stretched by a^2/8 at the end; elements that an impact folds are inverted.
// In stiff bodies that is many times the energy of the motion. The gain falls with the fourth power of the
// step, so that a few shorter steps carry the body through.
//
// Rigid bodies in contact gain energy as they turn. The contact forces of a step act at the points and along
// the normals of its beginning, and both turn away within the step, by a quarter of a radian at most. The
// gain falls with the second power of the step.
//
// Semi-implicit steps of elastic bodies are not checked, because their energy oscillates by itself.
#include <algorithm>
#include <cmath>

#include "sim/step/step.h"

namespace duet {
namespace {

// Largest gain of an implicit step, as a fraction of kinetic and elastic energy: fifty such steps gain a
// thousandth. `rigid_share` is the same fraction for steps of rigid bodies; it is larger because few of their
// steps gain anything.
constexpr double implicit_share = 2e-5, rigid_share = 1e-3;
// What steps of rigid bodies may gain besides, as a fraction of the kinetic energy of a fall from rest over
// the step: contact lifts resting bodies by its tolerances. A larger value would let heaps creep upward.
constexpr double rest_share = 0.02;

// A shorter step is a remedy if it gains less than `min_help` of what the refused step gained. An implicit
// step is refused in any case if it gains more than `much` of kinetic and elastic energy.
constexpr double min_help = 0.5, much = 2e-4;

// Fraction of the work of kinematic bodies by which its estimate may be wrong.
constexpr double work_share = 0.05;

// Returns whether a kinematic body moves in this step.
bool moves_in(const World& world, const KinematicStep& step) {
  const RigidState& before = world.context.states.rigid_n[step.body];
  return !(step.mean_velocity.isZero(0) && step.mean_angular_velocity.isZero(0) &&
           step.end.velocity.isZero(0) && step.end.angular_velocity.isZero(0) && before.velocity.isZero(0) &&
           before.angular_velocity.isZero(0));
}

// Returns whether a kinematic body has joints, carries particles, or may hold some by springs.
bool leads_others(const Bodies& bodies, std::size_t body) {
  const std::vector<Joint>& joints = bodies.articulation.joints;
  return bodies.forces.zero_length_springs.size() > 0 ||
         std::any_of(joints.begin(), joints.end(),
                     [&](const Joint& joint) {
                       return as_index(joint.parent) == body || as_index(joint.child) == body;
                     }) ||
         std::any_of(bodies.carried.begin(), bodies.carried.end(),
                     [&](const PrescribedParticle& particle) {
                       return bodies.rigid.kinematic[particle.kinematic].body == body;
                     }) ||
         std::any_of(bodies.bound.begin(), bodies.bound.end(),
                     [&](const EmbeddedParticle& particle) { return particle.body == body; });
}

// Returns whether something does work that is not measured: applied forces, motors, and kinematic bodies that
// move others by joints or pins.
bool is_driven(const World& world) {
  const std::vector<Joint>& joints = world.bodies.articulation.joints;
  const std::vector<KinematicStep>& kinematic = world.context.kinematic;
  return world.applied.any ||
         std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.control.on; }) ||
         std::any_of(kinematic.begin(), kinematic.end(), [&](const KinematicStep& step) {
           return moves_in(world, step) && leads_others(world.bodies, step.body);
         });
}

// Calls visit(work) for each kinematic body with its work on what it touches in the step, J: that of its
// impulses at its mean velocities.
template <class Visit>
void visit_work(const World& world, Visit&& visit) {
  const ContactSums& impulses = world.contact_tally.of_step();
  for (const KinematicStep& step : world.context.kinematic)
    visit(-impulses.linear[step.body].dot(step.mean_velocity) -
          impulses.angular[step.body].dot(step.mean_angular_velocity));
}

// Returns the mass of all dynamic and deformable bodies, kg.
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

double potential_energy(const World& world) {
  const Bodies& bodies = world.bodies;
  return bodies.forces.energy(bodies.particles.x) + gravitational_energy(bodies, world.gravity);
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
  const double mass = mass_of(world.bodies);                        // kg
  double work = world.context.contact.parting_work, uncertain = 0;  // J
  visit_work(world, [&](double of_body) {
    work += of_body;
    uncertain += work_share * std::abs(of_body);
  });
  const double gain = now.all - before.all - work - uncertain;  // J
  const double tolerance = world.settings.cg_tolerance;         // m/s
  double allowed = mass * tolerance * tolerance;
  if (is_implicit) {
    allowed += implicit_share * now.moving;
  } else {
    const double fall = world.gravity.norm() * world.context.dt;  // m/s
    allowed += rigid_share * now.moving + rest_share * 0.5 * mass * fall * fall;
  }
  if (!(gain > allowed)) return false;
  const bool helps = gain < min_help * refusal.gain || (is_implicit && gain > much * now.moving);
  refusal.gain = gain;
  return helps;
}

}  // namespace duet
