// Step I: v^n -> v~^{n+1/2} (paper section 3), and the solve that it shares with step V.
#include <algorithm>
#include <cmath>

#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {

namespace {

// The velocities v now, with what acts on rigid bodies: gravity over dt, and kinematic ones' motion.
// Gyroscopic motion needs no force, as angular momentum is what rigid bodies keep.
void begin_solve(World& world, StepContext& context, double dt) {
  Bodies& bodies = world.bodies;
  to_generalized(bodies, context.right_side);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) context.right_side.linear[i] += dt * world.gravity;
  for (const KinematicStep& step : context.kinematic) {
    const RigidState& start = bodies.rigid.state[step.body];
    context.right_side.linear[step.body] = 0.5 * (start.velocity + step.end.velocity);
    context.right_side.angular[step.body] = 0.5 * (start.angular_velocity + step.end.angular_velocity);
  }
  follow_twists(bodies.bound, context.right_side.linear, context.right_side.angular,
                context.right_side.particle);
}

// Of the right side, and of where the solve begins.
void satisfy_contacts(const Bodies& bodies, StepContext& context, ContactProjection* projection) {
  if (!projection) return;
  to_generalized(bodies, context.image);  // v_n, whose normal velocities the targets halve
  projection->choose(context.dt, context.image, context.solution);
  projection->add_friction(context.right_side);
  projection->add_friction(context.solution);
  projection->satisfy(context.solution);
  follow_twists(bodies.bound, context.right_side.linear, context.right_side.angular,
                context.right_side.particle);
  follow_twists(bodies.bound, context.solution.linear, context.solution.angular, context.solution.particle);
}

// Where conjugate gradients begin: bodies that took up the acceleration of the last solve once more. What is
// led, held or bound moves as it must, and contacts that the right side closes are kept.
void begin_at_last_acceleration(const Bodies& bodies, double dt, StepContext& context,
                                const ContactProjection* projection) {
  const GeneralizedVelocity& a = context.acceleration;
  to_generalized(bodies, context.solution);
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    context.solution.particle[p] = is_held(bodies.particles, p)
                                       ? context.right_side.particle[p]
                                       : Vec3(context.solution.particle[p] + dt * a.particle[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const bool moves = bodies.rigid.properties[i].is_dynamic();
    context.solution.linear[i] =
        moves ? Vec3(context.solution.linear[i] + dt * a.linear[i]) : context.right_side.linear[i];
    context.solution.angular[i] =
        moves ? Vec3(context.solution.angular[i] + dt * a.angular[i]) : context.right_side.angular[i];
  }
  follow_twists(bodies.bound, context.solution.linear, context.solution.angular, context.solution.particle);
  if (!projection) return;
  projection->satisfy(context.solution);
  follow_twists(bodies.bound, context.solution.linear, context.solution.angular, context.solution.particle);
}

// A solve that breaks down leaves none to go on with.
void keep_acceleration(const Bodies& bodies, double dt, StepContext& context) {
  GeneralizedVelocity& a = context.acceleration;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    a.particle[p] = (context.solution.particle[p] - bodies.particles.v[p]) / dt;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    a.linear[i] = (context.solution.linear[i] - bodies.rigid.state[i].velocity) / dt;
    a.angular[i] = (context.solution.angular[i] - bodies.rigid.state[i].angular_velocity) / dt;
  }
}

void solve_semi_implicitly(World& world, StepContext& context, double dt, ContactProjection* projection,
                           bool at_end) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const bool elastic = world.has_internal_forces();
  for (std::size_t p = 0; p < particles.size(); ++p)
    context.right_side.particle[p] += dt * particles.inverse_mass[p] * context.force[p];
  add_force_twists(bodies.rigid, bodies.bound, context.force, dt, context.right_side.linear,
                   context.right_side.angular);
  follow_twists(bodies.bound, context.right_side.linear, context.right_side.angular,
                context.right_side.particle);
  if (world.has(Effect::incompressibility))
    add_held_pressures(world, context, dt, context.right_side.particle);
  context.solution = context.right_side;
  satisfy_contacts(bodies, context, projection);
  if (!elastic) return;
  world.clock.time(Stage::damping_solve, [&] {
    begin_at_last_acceleration(bodies, dt, context, projection);
    // Half a step makes no difference to the damped masses.
    if (solve_with_damping(world, context, dt, projection, !at_end)) keep_acceleration(bodies, dt, context);
  });
}

// Gives all particles of a body that are not held the mean of the velocities `mean_of`, and the change.
void move_as_wholes(const Bodies& bodies, const std::vector<Vec3>& mean_of, const Vec3& change,
                    std::vector<Vec3>& velocity) {
  for (const DeformableBody& body : bodies.deformable) {
    const auto first = static_cast<std::size_t>(body.first_particle);
    const auto end = first + static_cast<std::size_t>(body.particle_count);
    Vec3 momentum = Vec3::Zero();
    double mass = 0;
    for (std::size_t p = first; p < end; ++p) {
      momentum += bodies.particles.mass[p] * mean_of[p];
      mass += bodies.particles.mass[p];
    }
    for (std::size_t p = first; p < end; ++p)
      velocity[p] = is_held(bodies.particles, p) ? bodies.particles.v[p] : Vec3(momentum / mass + change);
  }
}

// Islands that solve_contact_at_end() solves for need nothing here.
void leave_solved(const World& world, StepContext& context) {
  if (!solves_contact(world)) return;
  const Bodies& bodies = world.bodies;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    const int island = context.islands.of_particle(bodies.deformable[d].first_particle);
    if (context.solved_bodies[d] && context.islands.is_searched(as_index(island)))
      context.islands.leave(as_index(island));
  }
  context.islands.update();
}

}  // namespace

bool solve_with_damping(World& world, StepContext& context, double dt, ContactProjection* projection,
                        bool anew) {
  context.islands.begin(world.bodies);
  if (projection) projection->join(context.islands);
  context.islands.finish();
  if (!anew) leave_solved(world, context);
  VelocitySystem system(world.bodies, dt, false, projection, context.damping_force, context.inertia);
  system.collect_forces(context.force, context.force_in_single);
  const CgResult result = solve_islands(
      system, projection, context.damped_masses, anew, context.islands, context.right_side,
      world.settings.cg_tolerance, world.settings.cg_iterations, context.solution, context.island_search);
  system.finish();
  world.counters.cg_iterations += result.iterations;
  return std::isfinite(result.residual);
}

void solve_velocity(World& world, StepContext& context, double dt, ContactProjection* projection,
                    bool at_end) {
  Particles& particles = world.bodies.particles;
  begin_solve(world, context, dt);
  if (!world.settings.implicit_elasticity || !world.has_internal_forces()) {
    solve_semi_implicitly(world, context, dt, projection, at_end);
    return;
  }
  // The search begins at free flight, unless that crushes elements and standing still in the body is better.
  context.solution = context.right_side;
  move_as_wholes(world.bodies, particles.v, dt * world.gravity, context.solution.particle);
  const double still = incremental_potential(world, context, dt);
  context.correction.particle = context.solution.particle;
  for (std::size_t p = 0; p < particles.size(); ++p)
    context.solution.particle[p] =
        is_held(particles, p) ? particles.v[p] : Vec3(particles.v[p] + dt * world.gravity);
  if (incremental_potential(world, context, dt) > still)
    context.solution.particle = context.correction.particle;
  follow_twists(world.bodies.bound, context.solution.linear, context.solution.angular,
                context.solution.particle);
  satisfy_contacts(world.bodies, context, projection);
  context.balanced = find_velocity(world, context, {.dt = dt, .is_elastic = true, .projection = projection});
}

void settle(const World& world, StepContext& context, bool after_contact) {
  const Particles& particles = world.bodies.particles;
  std::vector<Vec3>& whole = context.correction.particle;
  whole.resize(particles.size());
  const Vec3 fall = 0.5 * context.dt * world.gravity;
  if (after_contact)
    move_as_wholes(world.bodies, context.solution.particle, Vec3::Zero(), whole);
  else
    move_as_wholes(world.bodies, particles.v, fall, whole);
  double taken = 0, left = 0;  // m^2/s^2 kg
  for (std::size_t p = 0; p < particles.size(); ++p) {
    whole[p] = 0.5 * (context.solution.particle[p] + whole[p]);
    taken += particles.mass[p] * (context.solution.particle[p] - whole[p]).squaredNorm();
    left += particles.mass[p] * context.imbalance.particle[p].squaredNorm();
  }
  if (after_contact && left < taken) return;
  context.solution.particle = whole;
}

namespace {

// For contact inside the solves: what damping alone has changed. Strongly damped bodies go on with V itself
// where a solve has not converged, as what it leaves of such forces is far more than a velocity.
void keep_damping(World& world, StepContext& context, double dt) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    if (!world.strongly_damped[d]) continue;
    double off = 0;
    for_each_particle(bodies.deformable[d], [&](std::size_t p) {
      off = std::max(off, (particles.v[p] - context.solution.particle[p]).norm());
    });
    if (off <= world.settings.cg_tolerance) continue;
    for_each_particle(bodies.deformable[d],
                      [&](std::size_t p) { particles.v[p] = context.solution.particle[p]; });
  }
  GeneralizedVelocity& change = context.solved_change;
  to_generalized(bodies, change);
  for (std::size_t p = 0; p < particles.size(); ++p)
    change.particle[p] -=
        context.v_n.particle[p] + dt * particles.inverse_mass[p] * context.explicit_force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!bodies.rigid.properties[i].is_dynamic()) continue;
    change.linear[i] -= context.v_n.rigid[i] + dt * world.gravity;
    change.angular[i] -= bodies.rigid.state[i].inverse_inertia * context.v_n.rotation[i];
  }
  add_force_twists(bodies.rigid, bodies.bound, context.explicit_force, -dt, change.linear, change.angular);
}

// v~^{n+1/2} = v^n + dt/2 M^-1 (F + F_damping(V)). As in V.2-3, the contacts of the last step only serve to
// find the velocity V at which damping is evaluated. Without them the particles that rest on something would
// fall freely in V and drag the others down: a damped body at rest would be compressed to several times its
// weight. V itself keeps to them and would stick; v~ does not.
void advance_semi_implicitly(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const double dt = context.dt / 2;
  ContactProjection* projection = nullptr;
  if (world.has_internal_forces() && (!bodies.bound.empty() || !context.memory.empty())) {
    context.projection.build(bodies, context.memory, dt, world.settings.projection_sweeps,
                             context.linked.prepare(bodies, context.joints, context.memory),
                             context.solved_bodies);
    projection = &context.projection;
    if (world.has(Effect::articulation)) {  // what is bound to bodies or touches them learns of their joints
      context.joints.prepare_projection(bodies.rigid);
      context.projection.add_joints(context.joints);
    }
  }
  find_explicit_forces(world, context);
  solve_velocity(world, context, dt, projection, false);
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += dt * particles.inverse_mass[p] * context.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += dt * world.gravity;
  apply_bound_forces(bodies, context.force, dt);
  if (solves_contact(world)) keep_damping(world, context, dt);
}

void advance_implicitly(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  ContactProjection* joints = nullptr;
  if (world.has(Effect::articulation) && !bodies.bound.empty()) {
    joints = &context.projection;
    joints->build(bodies);
    context.joints.prepare_projection(bodies.rigid);
    joints->add_joints(context.joints);
  }
  solve_velocity(world, context, context.dt / 2, joints, false);
  bodies.particles.x = context.x_n;
  if (!context.balanced) settle(world, context, false);
  VelocitySystem::subtract(context.solution, context.right_side, context.solved_change);
  bodies.particles.v = context.solution.particle;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    bodies.rigid.state[i].velocity = context.solution.linear[i];
  if (!bodies.bound.empty())
    for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
      if (bodies.rigid.properties[i].is_dynamic())
        set_angular_velocity(bodies.rigid.state[i], bodies.rigid.properties[i], context.solution.angular[i]);
}

}  // namespace

// I.1
void advance_velocity(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  if (world.has(Effect::springs)) bodies.forces.begin_step(bodies.particles.x);
  bodies.forces.set_time_step(context.dt);
  carry(context.kinematic, context.x_n, context.dt, bodies);
  if (world.settings.implicit_elasticity && world.has_internal_forces())
    advance_implicitly(world, context);
  else
    advance_semi_implicitly(world, context);
  for (const KinematicStep& step : context.kinematic) {
    bodies.rigid.state[step.body].velocity = step.mean_velocity;
    bodies.rigid.state[step.body].angular_velocity = step.mean_angular_velocity;
  }
  check_finite(world, Stage::advance_velocity);
}

}  // namespace duet
