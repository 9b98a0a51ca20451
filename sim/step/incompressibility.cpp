// Steps I.2 and V.1: incompressible bodies (paper sections 3 and 7), and both once more after the contacts of
// III and V.4, which the paper does not have. A one-ring is the nodal volume of a particle: a quarter of each
// tetrahedron around it.
#include <algorithm>
#include <cmath>

#include "sim/base/elementary.h"
#include "sim/base/parallel.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Largest correction of a one-ring's volume in a step, as a fraction of its rest volume. A volume that an
// impact or a bad start has compressed is restored over several steps, each of which is short enough for its
// linearization.
constexpr double max_correction = 0.1;

// Largest displacement of a particle by pressures in a step, as a fraction of the size of its one-ring. In
// tangled elements small motions hardly change the volumes, and large ones change them unpredictably.
constexpr double max_travel = 0.25;

// Fraction of the divergence without pressures that the velocities of a step may keep. It is relative, and
// small, because even a small divergence, such as that of a slow rotation, would add up over the steps.
constexpr double velocity_reduction = 1e-2;

// Fraction of its cone that a contact may use and still count as sticking, with normals that have turned
// since its impulse was found. A box that slid over mesh edges seemed to stick at them, and was braked.
constexpr double turned_cone_share = 0.9;

// What contacts and joints will do besides holding: known from earlier solves, and the same again at rest.
// Implicit steps, whose solves have contact inside, and the order of constraints before the solve expect
// nothing.
struct Expected {
  double friction = 0;                 // share of the friction impulses of context.solve.projection
  const RigidForces* drive = nullptr;  // forces of control, friction and limits of joints; null: none
  double seconds = 0;                  // time for which these act
  bool pressures = false;              // whether the pressures of the last step act for that time, too
};

// Returns the particle velocities (m/s) with the `expected` impulses, projected onto the contacts of
// context.solve.projection, as contact will leave them. Pressures that know nothing of friction and of what
// presses a body would carry too little, and the rest would come after the contacts, without friction.
const std::vector<Vec3>& velocities_in_contact(World& world, StepContext& context, const Expected& expected) {
  VelocitySolve& solve = context.solve;
  const Bodies& bodies = world.bodies;
  to_generalized(bodies, solve.solution);
  if (expected.pressures) add_held_pressures(world, context, expected.seconds, solve.solution);
  if (expected.friction > 0) solve.projection.add_friction(expected.friction, solve.solution);
  if (expected.drive) add_joint_drive(bodies, *expected.drive, expected.seconds, solve.solution);
  solve.projection.project(solve.solution);
  follow_twists(bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
  return solve.solution.particle;
}

// Returns the fraction (0 to 1) of the velocities `change` that moves no particle farther than `max_travel`
// in `dt` (s); it is 1 in all but extreme states.
double bounded_share(const NodalVolumes& rings, const std::vector<Vec3>& change, double dt) {
  return parallel_reduce(
      rings.size(), 1024, 1.0,
      [&](std::size_t begin, std::size_t end) {
        double share = 1;
        for (std::size_t i = begin; i < end; ++i) {
          const double way = dt * change[static_cast<std::size_t>(rings.particle(i))].norm();
          const double most = max_travel * math::cbrt(rings.rest_volume(i));
          if (way > most) share = std::min(share, most / way);
        }
        return share;
      },
      [](double a, double b) { return std::min(a, b); });
}

// Multiplies the pressures and their changes of velocities by `share`.
void scale(double share, PressureScratch& scratch) {
  for (double& q : scratch.pressure) q *= share;
  for (std::vector<Vec3>* values :
       {&scratch.change.particle, &scratch.change.linear, &scratch.change.angular})
    for (Vec3& value : *values) value *= share;
}

// Finds the pressures that change the rates of the one-rings by context.pressures.scratch.rate, and the
// changes of velocities that they make. Sets context.pressures.scratch.
void find_change(World& world, StepContext& context, const PressureSettings& settings) {
  const ContactProjection& projection = context.solve.projection;
  PressureScratch& scratch = context.pressures.scratch;
  const CgResult result =
      find_pressures(world.bodies, projection.empty() ? nullptr : &projection, context.dt, settings, scratch);
  world.counters.pressure_iterations += result.iterations;
  const double share = bounded_share(world.bodies.nodal_volumes, scratch.change.particle, context.dt);
  if (share < 1) scale(share, scratch);
}

// Returns whether pressures count on the impulses of Expected.
bool expects_impulses(const World& world) {
  return keeps_volume_in_contact(world) && !world.settings.constraints_before_solve;
}

// Returns the speed (m/s) below which a body counts as resting, that of a fall of three steps.
double slow_speed(const World& world, const StepContext& context) {
  return 3 * context.dt * world.gravity.norm();
}

// Sets `islands` to those of the contacts and joints of context.solve.projection.
void find_islands(const World& world, const StepContext& context, Islands& islands) {
  islands.begin(world.bodies);
  context.solve.projection.join(islands);
  islands.finish();
}

// Marks in context.pressures.rests the deformable bodies that begin the step at rest: no particle of theirs,
// and no rigid body of their island, is faster than slow_speed(). Returns whether there are any.
// find_resting() asks for the rates of volumes instead, which are known in III and V.4 only.
bool find_slow(const World& world, StepContext& context) {
  PressureStage& pressures = context.pressures;
  const Bodies& bodies = world.bodies;
  const double slow = slow_speed(world, context);
  Islands& islands = pressures.calm;
  find_islands(world, context, islands);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidState& state = bodies.rigid.state[i];
    const double size = bodies.rigid.properties[i].shape.min_size();
    if (islands.is_searched_rigid(i) &&
        !(state.velocity.norm() + size * state.angular_velocity.norm() <= slow))
      islands.leave(as_index(islands.of_rigid(i)));
  }
  bool any = false;
  pressures.rests.resize(bodies.deformable.size());
  for (std::size_t d = 0; d < pressures.rests.size(); ++d) {
    const DeformableBody& body = bodies.deformable[d];
    bool rests =
        expects_impulses(world) && islands.is_searched(as_index(islands.of_particle(body.first_particle)));
    if (rests)
      for_each_particle(body, [&](std::size_t p) { rests &= context.states.v_n.particle[p].norm() <= slow; });
    pressures.rests[d] = rests;
    any |= rests;
  }
  return any;
}

// Marks in context.pressures.calm the islands of context.solve.projection in which incompressible bodies
// rest, slide, or are pressed, and do not land. In these, no one-ring has to change faster than a speed times
// its surface with all that is expected, pressures included: context.pressures.scratch.left. The speed is
// slow_speed(), or 1e-4 of its size per step, or a fifth of that without the pressures, which are
// context.pressures.scratch.rate. If nothing is expected, the rate must be below a fall of 200 steps, or a
// hundredth of the size. In the order of constraints before the solve no island is calm.
void find_calm_islands(const World& world, StepContext& context) {
  constexpr double max_of_load = 0.2;
  const bool knows = expects_impulses(world);
  const NodalVolumes& rings = world.bodies.nodal_volumes;
  const std::vector<double>&all = context.pressures.scratch.rate,
        &left = knows ? context.pressures.scratch.left : all;
  const double slow = knows ? slow_speed(world, context) : 200 * context.dt * world.gravity.norm();
  const double max_share = knows ? 1e-4 : 0.01;
  Islands& calm = context.pressures.calm;
  find_islands(world, context, calm);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const double size = math::cbrt(rings.rest_volume(i));
    const double bound = std::max(slow, max_share * size / context.dt) * size * size,
                 of_load = knows ? max_of_load * std::abs(all[i]) : 0;
    if (!world.settings.constraints_before_solve && std::abs(left[i]) <= std::max(bound, of_load)) continue;
    const std::size_t island = as_index(calm.of_particle(rings.particle(i)));
    if (calm.is_searched(island)) calm.leave(island);
  }
}

// Takes the answer of contacts and joints out of the change of velocities by pressures in calm islands: the
// next stages give it, as they do for other forces. Contact that is hidden in a projection has no friction,
// and a box slid with two thirds of it. As bodies land, contact would give back more than it took, so that
// the answer stays.
void leave_answer_to_contact(const World& world, StepContext& context) {
  PressureStage& pressures = context.pressures;
  if (pressures.calm.searched() == 0) return;
  PressureScratch& scratch = pressures.scratch;
  GeneralizedVelocity &change = scratch.change, &alone = scratch.alone;
  alone.particle.assign(change.particle.size(), Vec3::Zero());
  alone.linear.assign(change.linear.size(), Vec3::Zero());
  alone.angular.assign(change.angular.size(), Vec3::Zero());
  pressure_change(world.bodies, scratch.pressure, scratch.held_impulse, alone);
  for (std::size_t p = 0; p < change.particle.size(); ++p)
    if (pressures.calm.is_searched(as_index(pressures.calm.of_particle(static_cast<int>(p)))))
      change.particle[p] = alone.particle[p];
  for (std::size_t i = 0; i < change.linear.size(); ++i) {
    if (!pressures.calm.is_searched_rigid(i)) continue;
    change.linear[i] = alone.linear[i];
    change.angular[i] = alone.angular[i];
  }
}

// Adds the changes of context.pressures.scratch to the velocities of all bodies.
void change_velocities(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  const PressureScratch& scratch = context.pressures.scratch;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    bodies.particles.v[p] += scratch.change.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if ((context.solve.projection.empty() && bodies.bound.empty()) || !properties.is_dynamic()) continue;
    RigidState& state = bodies.rigid.state[i];
    state.velocity += scratch.change.linear[i];
    const Mat3 rotation = state.pose.orientation.toRotationMatrix();
    const Vec3 body_rate = rotation.transpose() * scratch.change.angular[i];
    apply_angular_impulse(state, properties, rotation * properties.inertia.cwiseProduct(body_rate));
  }
}

// Sets context.pressures.scratch.rate (m^3/s) to the changes of rates that bring one-rings to their rest
// volumes in a step, at most by `max_correction` of these. Linearizes the one-rings at the positions now; the
// velocities are those under context.solve.projection, with the `expected` impulses.
void find_rates_to_rest_volumes(World& world, StepContext& context, const Expected& expected = {}) {
  Bodies& bodies = world.bodies;
  NodalVolumes& rings = bodies.nodal_volumes;
  rings.linearize(bodies.particles.x);
  std::vector<double>& rate = context.pressures.scratch.rate;
  rings.divergence(velocities_in_contact(world, context, expected), rate);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    // Flattened one-rings have less surface to push on: they are corrected by less, so that the displacements
    // of their particles stay bounded.
    const double surface = std::min(1.0, std::sqrt(rings.diagonal(i) / rings.rest_diagonal(i)));
    const double most = surface * max_correction * rings.rest_volume(i);
    rate[i] = std::clamp(rings.rest_volume(i) - rings.volume(i), -most, most) / context.dt - rate[i];
  }
}

// Marks in context.pressures.rests the incompressible bodies whose one-rings are asked to change no faster
// than at rest, and returns whether all are. The bound for a one-ring of size l is 5 dt g l^2, in m^3/s: five
// times the rate of its volume if one side of it falls freely for a step.
bool find_resting(const World& world, StepContext& context) {
  PressureStage& pressures = context.pressures;
  constexpr double max_falls = 5;  // speed of the bound over that of a free fall in a step
  const NodalVolumes& rings = world.bodies.nodal_volumes;
  const std::vector<DeformableBody>& bodies = world.bodies.deformable;
  const double fall = max_falls * context.dt * world.gravity.norm();  // m/s
  pressures.rests.assign(bodies.size(), false);
  bool all = true;
  std::size_t d = 0, last = bodies.size();  // one-rings follow their bodies
  for (std::size_t i = 0; i < rings.size(); ++i) {
    while (rings.particle(i) >= bodies[d].first_particle + bodies[d].particle_count) ++d;
    if (d != last) pressures.rests[d] = true;
    last = d;
    const double size = math::cbrt(rings.rest_volume(i));
    if (std::abs(pressures.scratch.rate[i]) <= fall * size * size) continue;
    pressures.rests[d] = all = false;
  }
  return all;
}

// Makes context.solve.projection that of the contacts of this step, and calls `find_rates` to set the rates
// that pressures are to change. Returns whether there is any contact.
//
// For bodies at rest the projection also holds the tangents of sticking contacts, by their friction:
// pressures that let them slide made a box creep down a slope by 1.5 mm/s. For a body that lands or is
// compressed it does not, because contact that can neither slide nor part in a solve would switch on and off
// from step to step, and feed energy in.
template <class FindRates>
bool project_contacts(World& world, StepContext& context, FindRates&& find_rates) {
  context.pressures.scratch.rate.assign(world.bodies.nodal_volumes.size(), 0.0);
  find_resting(world, context);
  project_active_contacts(world, context, {&context.pressures.rests});
  if (context.solve.projection.empty()) return false;
  find_rates();
  if (find_resting(world, context)) return true;
  project_active_contacts(world, context, {&context.pressures.rests});
  find_rates();
  return true;
}

// Makes context.solve.projection that of the contacts of the last step, with the tangents of sticking ones
// for bodies that begin the step at rest.
void project_last_contacts(World& world, StepContext& context) {
  JointStage& joints = context.joints;
  const ArticulatedResponse* linked =
      joints.response.prepare(world.bodies, joints.solver, world.last_step.contact_cache);
  const auto project = [&](const StickingBodies& sticking) {
    context.solve.projection.build(world.bodies, world.last_step.contact_cache, context.dt,
                                   world.settings.projection_sweeps, linked, {}, sticking);
  };
  project({});
  if (!context.solve.projection.empty() && find_slow(world, context))
    project({&context.pressures.rests, turned_cone_share});
  if (!world.has(Effect::articulation)) return;
  joints.solver.prepare_projection(world.bodies.rigid);
  context.solve.projection.add_joints(joints.solver);
}

// Finds the calm islands, and the rates that pressures are to change with what is `expected` in them.
template <class FindRates>
void find_expected_rates(World& world, StepContext& context, Expected expected, FindRates&& find_rates) {
  PressureScratch& scratch = context.pressures.scratch;
  if (!expects_impulses(world)) {
    find_rates({});
    return find_calm_islands(world, context);
  }
  find_rates(expected);
  scratch.left = scratch.rate;
  expected.pressures = false;
  find_rates(expected);
  find_calm_islands(world, context);
  if (context.pressures.calm.searched() == 0) find_rates({});
}

// Returns the settings for pressures that act on v^{n+1}: tighter than those of the volume correction, whose
// velocities are dropped after the positions have moved.
PressureSettings velocity_settings(const World& world) {
  PressureSettings settings = world.settings.pressure;
  settings.tolerance *= velocity_reduction;
  settings.reduction = velocity_reduction;
  return settings;
}

}  // namespace

// I.2. The contacts of this step are not known yet, so that the pressures take account of those of the last
// step.
void correct_volume(World& world, StepContext& context) {
  project_last_contacts(world, context);
  // The impulses of context.solve.projection are those of a whole step, the velocities those of half a step.
  find_expected_rates(
      world, context, {0.5, &world.last_step.joint_drive, context.dt / 2, true},
      [&](const Expected& expected) { find_rates_to_rest_volumes(world, context, expected); });
  find_change(world, context, world.settings.pressure);
  leave_answer_to_contact(world, context);
  change_velocities(world, context);
  check_finite(world, Stage::volume_correction);
}

bool keeps_volume_in_contact(const World& world) { return !world.settings.implicit_elasticity; }

// The contact impulses of III replace those of the last step and add friction, so that they change the
// volumes once more. The next step would restore the volumes against the pressure, p dV, although nothing
// took that energy from the body as it was compressed: a box that landed on rough ground gained three times
// its energy.
void correct_volume_in_contact(World& world, StepContext& context) {
  if (!project_contacts(world, context, [&] { find_rates_to_rest_volumes(world, context); })) return;
  find_change(world, context, world.settings.pressure);
  change_velocities(world, context);
  check_finite(world, Stage::volume_in_contact);
}

// V.1. The paper removes the divergence at x^{n+1/2} from v^n, before the forces of the step. The response of
// the pressures to these forces is then missing in v^{n+1}, and a turning body loses the fraction (w dt)^2/4
// of its angular momentum in every step, because v^n is no rotation of x^{n+1/2}. Here the pressures act at
// x^{n+1/2} as the other forces do, but after them, and they make v^{n+1} free of divergence at x^{n+1}. The
// loss is then of the next order.
void make_incompressible(World& world, StepContext& context) {
  PressureStage& pressures = context.pressures;
  const bool after_contact = world.settings.constraints_before_solve && keeps_spin(world);
  if (after_contact) count_middle_forces(world, context, -1);
  Bodies& bodies = world.bodies;
  NodalVolumes& rings = bodies.nodal_volumes;
  std::vector<double>& rate = pressures.scratch.rate;
  follow_bodies(bodies.rigid, bodies.bound, bodies.particles);
  if (!context.solve.projection.empty() && find_slow(world, context))
    project_active_contacts(world, context, {&pressures.rests, turned_cone_share});
  // The impulses of context.solve.projection are those of half a step.
  find_expected_rates(
      world, context, {2, &context.joints.drive, context.dt, true}, [&](const Expected& expected) {
        rings.divergence_at(bodies.particles.x, velocities_in_contact(world, context, expected), rate);
        for (double& r : rate) r = -r;
      });
  rings.linearize(context.states.x_half);
  {
    const AtMiddle at_middle(world);
    bring_bound_to_middle(bodies, context.states.rigid_n);
  }
  find_change(world, context, velocity_settings(world));
  leave_answer_to_contact(world, context);
  change_velocities(world, context);
  for (std::size_t i = 0; i < world.last_step.pressure.size(); ++i)
    pressures.next[i] = pressures.scratch.pressure[i] / context.dt;
  if (after_contact) count_middle_forces(world, context, 1);
  check_finite(world, Stage::make_incompressible);
}

// The contact impulses of V.4 bring divergence back into the velocities; the projection of V.1 is repeated
// under these contacts.
void keep_volume(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  NodalVolumes& rings = bodies.nodal_volumes;
  follow_bodies(bodies.rigid, bodies.bound, bodies.particles);
  rings.linearize(bodies.particles.x);
  const auto find_rates = [&] {
    std::vector<double>& rate = context.pressures.scratch.rate;
    rings.divergence(velocities_in_contact(world, context, {}), rate);
    for (double& r : rate) r = -r;
  };
  if (!project_contacts(world, context, find_rates)) return;
  find_change(world, context, velocity_settings(world));
  change_velocities(world, context);
  for (std::size_t i = 0; i < world.last_step.pressure.size(); ++i)
    context.pressures.next[i] += context.pressures.scratch.pressure[i] / context.dt;
  check_finite(world, Stage::volume_at_end);
}

// Damping has to act on the velocities that pressures leave. Without the pressures the solve would see
// particles of a compressed body driven apart by the elastic forces, and the damping of that motion would do
// work on particles that in truth stay together.
void add_held_pressures(World& world, StepContext& context, double dt, GeneralizedVelocity& velocity) {
  NodalVolumes& rings = world.bodies.nodal_volumes;
  PressureScratch& scratch = context.pressures.scratch;
  scratch.scaled.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) scratch.scaled[i] = dt * world.last_step.pressure[i];
  scratch.change.particle.assign(world.bodies.particles.size(), Vec3::Zero());
  scratch.change.linear.assign(world.bodies.rigid.size(), Vec3::Zero());
  scratch.change.angular.assign(world.bodies.rigid.size(), Vec3::Zero());
  rings.linearize(world.bodies.particles.x);
  pressure_change(world.bodies, scratch.scaled, scratch.held_impulse, scratch.change);
  VelocitySystem::axpy(1, scratch.change, velocity);
}

}  // namespace duet
