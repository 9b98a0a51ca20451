// Step I.1: v^n -> v_*^{n+1/2} (paper section 3), and the velocity solve that it shares with step V.2.
#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {

namespace {

// Adds the velocities that the applied forces make in `dt` (s) to v.
void add_applied(const World& world, double dt, GeneralizedVelocity& v) {
  const AppliedForces& applied = world.applied;
  if (!applied.any) return;
  const RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t p = 0; p < v.particle.size(); ++p)
    v.particle[p] += dt * world.bodies.particles.inverse_mass[p] * applied.particle[p];
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    v.linear[i] += dt * rigid.properties[i].inverse_mass * applied.linear[i];
    if (rigid.properties[i].is_dynamic())
      v.angular[i] += dt * (rigid.state[i].inverse_inertia * applied.angular[i]);
  }
  add_force_twists(rigid, world.bodies.bound, applied.particle, dt, v.linear, v.angular);
}

// Sets right_side to the velocities v now, with gravity over `dt` (s) on dynamic bodies, and with the
// velocities of kinematic bodies that are interpolated to the fraction dt/(t^{n+1} - t^n) of the step.
// Gyroscopic motion needs no force, because the solve leaves angular momentum as it is. `known` are the
// forces from outside the solve.
void begin_solve(World& world, StepContext& context, double dt, const KnownForces& known) {
  VelocitySolve& solve = context.solve;
  Bodies& bodies = world.bodies;
  const double at = dt / context.dt;
  to_generalized(bodies, solve.right_side);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) solve.right_side.linear[i] += dt * world.gravity;
  add_joint_drive(bodies, *known.drive, dt, solve.right_side);
  add_applied(world, known.applied_for, solve.right_side);
  for (const KinematicStep& step : context.kinematic) {
    const RigidState& start = bodies.rigid.state[step.body];
    const auto reached = [&](const Vec3& from, const Vec3& to) { return Vec3((1 - at) * from + at * to); };
    solve.right_side.linear[step.body] = reached(start.velocity, step.end.velocity);
    solve.right_side.angular[step.body] = reached(start.angular_velocity, step.end.angular_velocity);
  }
  follow_twists(bodies.bound, solve.right_side.linear, solve.right_side.angular, solve.right_side.particle);
}

// Sets the active set of a solve at the fraction `at` of the step: the constraints that
// context.solve.solution violates, and those that it violates once these are satisfied.
void activate_constraints(const Bodies& bodies, double at, StepContext& context,
                          ContactProjection& projection) {
  VelocitySolve& solve = context.solve;
  to_generalized(bodies, solve.image);  // v^n
  if (projection.choose(context.dt, at, solve.image, solve.solution)) return;
  GeneralizedVelocity& held = solve.correction;
  do {
    held = solve.solution;
    projection.satisfy(held);
    follow_twists(bodies.bound, held.linear, held.angular, held.particle);
  } while (projection.activate_violated(context.dt, at, solve.image, held));
}

// Applies friction forces between surfaces (N, none if empty) for `dt` (s) to the right side and to the start
// of the solve, but not to bodies with contact inside their solve. The projection leaves tangential motion
// free, see ContactProjection::add_friction().
void add_surface_friction(const Bodies& bodies, double dt, const std::vector<Vec3>& force,
                          StepContext& context) {
  if (force.empty()) return;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    if (!context.solved.bodies.empty() && context.solved.bodies[d]) continue;
    for_each_particle(bodies.deformable[d], [&](std::size_t p) {
      const Vec3 change = dt * bodies.particles.inverse_mass[p] * force[p];
      context.solve.right_side.particle[p] += change;
      context.solve.solution.particle[p] += change;
    });
  }
}

// Activates the constraints of a solve for `dt` (s), applies the friction of their contacts and that between
// surfaces (N, none if empty) to the right side and to the start of the solve, and makes the start satisfy
// the constraints.
void satisfy_contacts(const Bodies& bodies, double dt, const std::vector<Vec3>& surface_friction,
                      StepContext& context, ContactProjection* projection) {
  VelocitySolve& solve = context.solve;
  if (!projection) return;
  const double at = dt / context.dt;
  activate_constraints(bodies, at, context, *projection);
  const double share = 2 * at;  // the impulses are those of half a step
  projection->add_friction(share, solve.right_side);
  projection->add_friction(share, solve.solution);
  add_surface_friction(bodies, dt, surface_friction, context);
  projection->satisfy(solve.solution);
  follow_twists(bodies.bound, solve.right_side.linear, solve.right_side.angular, solve.right_side.particle);
  follow_twists(bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
}

// Sets the solution to v + dt a, where a is the acceleration of the last solve (LastStep::acceleration):
// conjugate gradients start there. Held particles and bodies that are not dynamic take the velocities of the
// right side, bound particles those of their bodies, and the constraints of `projection` hold.
void begin_at_last_acceleration(const Bodies& bodies, const GeneralizedVelocity& a, double dt,
                                StepContext& context, const ContactProjection* projection) {
  VelocitySolve& solve = context.solve;
  to_generalized(bodies, solve.solution);
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    solve.solution.particle[p] = is_held(bodies.particles, p)
                                     ? solve.right_side.particle[p]
                                     : Vec3(solve.solution.particle[p] + dt * a.particle[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const bool moves = bodies.rigid.properties[i].is_dynamic();
    solve.solution.linear[i] =
        moves ? Vec3(solve.solution.linear[i] + dt * a.linear[i]) : solve.right_side.linear[i];
    solve.solution.angular[i] =
        moves ? Vec3(solve.solution.angular[i] + dt * a.angular[i]) : solve.right_side.angular[i];
  }
  follow_twists(bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
  if (!projection) return;
  projection->satisfy(solve.solution);
  follow_twists(bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
}

// Sets a = (V - v) / dt, at which the next solve starts. It is not called for a solve that broke down.
void keep_acceleration(const Bodies& bodies, double dt, const GeneralizedVelocity& V,
                       GeneralizedVelocity& a) {
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    a.particle[p] = (V.particle[p] - bodies.particles.v[p]) / dt;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    a.linear[i] = (V.linear[i] - bodies.rigid.state[i].velocity) / dt;
    a.angular[i] = (V.angular[i] - bodies.rigid.state[i].angular_velocity) / dt;
  }
}

// Solves for V with the explicit forces in context.solve.force, and adds the damping forces to these. Without
// internal forces nothing is solved for.
void solve_semi_implicitly(World& world, StepContext& context, double dt, ContactProjection* projection,
                           SolveOf stage) {
  VelocitySolve& solve = context.solve;
  const bool is_first = stage == SolveOf::advance_velocity;
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const bool elastic = world.has_internal_forces();
  for (std::size_t p = 0; p < particles.size(); ++p)
    solve.right_side.particle[p] += dt * particles.inverse_mass[p] * solve.force[p];
  add_force_twists(bodies.rigid, bodies.bound, solve.force, dt, solve.right_side.linear,
                   solve.right_side.angular);
  follow_twists(bodies.bound, solve.right_side.linear, solve.right_side.angular, solve.right_side.particle);
  if (world.has(Effect::incompressibility)) add_held_pressures(world, context, dt, solve.right_side);
  solve.solution = solve.right_side;
  satisfy_contacts(bodies, dt, is_first ? world.last_step.surface_friction : context.surfaces.friction,
                   context, projection);
  if (!elastic) return;
  world.clock.time(Stage::damping_solve, [&] {
    begin_at_last_acceleration(bodies, world.last_step.acceleration, dt, context, projection);
    // The preconditioner of I.1 serves V.2 as well: half a step hardly changes it.
    const AssembleBlocks blocks = is_first ? AssembleBlocks::all : AssembleBlocks::missing;
    if (solve_with_damping(world, context, dt, projection, blocks))
      keep_acceleration(bodies, dt, solve.solution, world.last_step.acceleration);
  });
}

// Sets `velocity` (m/s) to that of each deformable body as a whole: the mass-weighted mean of the velocities
// `mean_of`, plus `change`. Held particles keep their own velocities.
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

// Leaves out the islands of bodies with contact inside their velocity solve: solve_contact_at_end() solves
// for them.
void leave_solved(const World& world, StepContext& context) {
  VelocitySolve& solve = context.solve;
  if (!solves_contact(world)) return;
  const Bodies& bodies = world.bodies;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    const int island = solve.islands.of_particle(bodies.deformable[d].first_particle);
    if (context.solved.bodies[d] && solve.islands.is_searched(as_index(island)))
      solve.islands.leave(as_index(island));
  }
  solve.islands.update();
}

}  // namespace

bool solve_with_damping(World& world, StepContext& context, double dt, ContactProjection* projection,
                        AssembleBlocks blocks) {
  VelocitySolve& solve = context.solve;
  solve.islands.begin(world.bodies);
  if (projection) projection->join(solve.islands);
  solve.islands.finish();
  if (blocks == AssembleBlocks::missing) leave_solved(world, context);
  VelocitySystem system(world.bodies, dt, ImplicitForces::damping, projection, solve.damping_force,
                        solve.inertia);
  system.collect_forces(solve.force, solve.force_in_single);
  const CgResult result = solve_islands(system, projection, solve.block_jacobi, blocks, solve.islands,
                                        solve.right_side, world.settings.cg_tolerance,
                                        world.settings.cg_iterations, solve.solution, solve.island_search);
  system.finish();
  world.counters.cg_iterations += result.iterations;
  return std::isfinite(result.residual);
}

void solve_velocity(World& world, StepContext& context, double dt, const KnownForces& known,
                    ContactProjection* projection, SolveOf stage) {
  VelocitySolve& solve = context.solve;
  Particles& particles = world.bodies.particles;
  begin_solve(world, context, dt, known);
  if (!world.settings.implicit_elasticity || !world.has_internal_forces()) {
    solve_semi_implicitly(world, context, dt, projection, stage);
    return;
  }
  // The search begins at free flight of every particle, or at rest within each moving body if the incremental
  // potential is lower there, because free flight may compress elements.
  solve.solution = solve.right_side;
  move_as_wholes(world.bodies, particles.v, dt * world.gravity, solve.solution.particle);
  const double still = incremental_potential(world, context, dt);
  solve.correction.particle = solve.solution.particle;
  for (std::size_t p = 0; p < particles.size(); ++p)
    solve.solution.particle[p] =
        is_held(particles, p) ? particles.v[p] : Vec3(particles.v[p] + dt * world.gravity);
  if (incremental_potential(world, context, dt) > still) solve.solution.particle = solve.correction.particle;
  follow_twists(world.bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
  satisfy_contacts(world.bodies, dt, {}, context, projection);
  solve.converged = find_velocity(world, context, {.dt = dt, .is_elastic = true, .projection = projection});
}

void add_joint_drive(const Bodies& bodies, const RigidForces& drive, double dt, GeneralizedVelocity& v) {
  if (drive.linear.empty()) return;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!bodies.rigid.properties[i].is_dynamic()) continue;
    v.linear[i] += dt * bodies.rigid.properties[i].inverse_mass * drive.linear[i];
    v.angular[i] += dt * (bodies.rigid.state[i].inverse_inertia * drive.angular[i]);
  }
}

void apply_rigid_fallback(const World& world, StepContext& context, FallbackFrom from) {
  VelocitySolve& solve = context.solve;
  const Particles& particles = world.bodies.particles;
  std::vector<Vec3>& whole = solve.correction.particle;
  whole.resize(particles.size());
  const Vec3 fall = 0.5 * context.dt * world.gravity;
  if (from == FallbackFrom::solution)
    move_as_wholes(world.bodies, solve.solution.particle, Vec3::Zero(), whole);
  else
    move_as_wholes(world.bodies, particles.v, fall, whole);
  double taken = 0,
         left = 0;  // kg m^2/s^2: squares of the change that the fallback makes, and of the residual
  for (std::size_t p = 0; p < particles.size(); ++p) {
    whole[p] = 0.5 * (solve.solution.particle[p] + whole[p]);
    taken += particles.mass[p] * (solve.solution.particle[p] - whole[p]).squaredNorm();
    left += particles.mass[p] * solve.newton_residual.particle[p].squaredNorm();
  }
  if (from == FallbackFrom::solution && left < taken) return;
  solve.solution.particle = whole;
}

namespace {

// Stores in context.solve.solved_change what damping has changed, for contact inside the solves. Strongly
// damped bodies take V itself if the solve has not converged: the residual of an unconverged solve is not a
// force, and their damping would turn it into a large one.
void keep_damping(World& world, StepContext& context, double dt) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    if (!world.strongly_damped[d]) continue;
    double off = 0;
    for_each_particle(bodies.deformable[d], [&](std::size_t p) {
      off = std::max(off, (particles.v[p] - context.solve.solution.particle[p]).norm());
    });
    if (off <= world.settings.cg_tolerance) continue;
    for_each_particle(bodies.deformable[d],
                      [&](std::size_t p) { particles.v[p] = context.solve.solution.particle[p]; });
  }
  GeneralizedVelocity& change = context.solve.solved_change;
  to_generalized(bodies, change);
  for (std::size_t p = 0; p < particles.size(); ++p)
    change.particle[p] -=
        context.states.v_n.particle[p] + dt * particles.inverse_mass[p] * context.solve.explicit_force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!bodies.rigid.properties[i].is_dynamic()) continue;
    change.linear[i] -= context.states.v_n.rigid[i] + dt * world.gravity;
    change.angular[i] -= bodies.rigid.state[i].inverse_inertia * context.states.v_n.rotation[i];
  }
  add_force_twists(bodies.rigid, bodies.bound, context.solve.explicit_force, -dt, change.linear,
                   change.angular);
}

// Returns the fraction of a semi-implicit step at which damping is evaluated. If constraints come before the
// solve, backward Euler damps at the end of the step, and I.1 evaluates damping at the middle.
double damping_at(const World& world) {
  return world.settings.constraints_before_solve ? 0.5 : world.settings.damping_at;
}

// v~^{n+1/2} = v^n + dt/2 M^-1 (F + F_damping(V)), with V at the time at which V.2 and V.3 evaluate damping:
// at rest both solves then have the same V, however near the projection comes to the constraints, and contact
// has the same forces in III and V.4. The contacts of the last step and the repulsion pairs of x^n serve only
// to find V. Without them the particles that rest on something would fall freely in V and drag the others
// down: a damped body at rest would be compressed by several times its weight. V obeys the contacts and would
// stick; v~ does not.
void advance_semi_implicitly(World& world, StepContext& context) {
  VelocitySolve& solve = context.solve;
  JointStage& joints = context.joints;
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const double dt = context.dt / 2;
  ContactProjection* projection = nullptr;
  const bool is_constrained = !bodies.bound.empty() || !world.last_step.contact_cache.empty() ||
                              !context.surfaces.repulsion.pairs().empty();
  if (world.has_internal_forces() && is_constrained) {
    solve.projection.build(bodies, world.last_step.contact_cache, dt, world.settings.projection_sweeps,
                           joints.response.prepare(bodies, joints.solver, world.last_step.contact_cache),
                           context.solved.bodies);
    if (world.has(Effect::self_repulsion))
      solve.projection.add_repulsions(context.surfaces.repulsion, context.solved.bodies);
    projection = &solve.projection;
    if (world.has(Effect::articulation)) {  // V of bound and touching particles depends on joints
      joints.solver.prepare_projection(bodies.rigid);
      solve.projection.add_joints(joints.solver);
    }
  }
  const double seconds = damping_at(world) * context.dt;
  const Turn turn{particles.v, seconds};
  find_explicit_forces(world, context, &turn);
  if (world.has_internal_forces()) bodies.forces.add_kept_turn_forces(turn, solve.force);
  solve_velocity(world, context, seconds, {&world.last_step.joint_drive, seconds}, projection,
                 SolveOf::advance_velocity);
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += dt * particles.inverse_mass[p] * solve.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += dt * world.gravity;
  apply_bound_forces(bodies, solve.force, dt);
  if (solves_contact(world)) keep_damping(world, context, dt);
}

// v~^{n+1/2} = V for the V of the fully implicit solve. Only joints constrain it, if bodies carry particles.
void advance_implicitly(World& world, StepContext& context) {
  VelocitySolve& solve = context.solve;
  Bodies& bodies = world.bodies;
  ContactProjection* joints = nullptr;
  if (world.has(Effect::articulation) && !bodies.bound.empty()) {
    joints = &solve.projection;
    joints->build(bodies);
    context.joints.solver.prepare_projection(bodies.rigid);
    joints->add_joints(context.joints.solver);
  }
  const double dt = context.dt / 2;
  solve_velocity(world, context, dt, {&world.last_step.joint_drive, dt}, joints, SolveOf::advance_velocity);
  bodies.particles.x = context.states.x_n;
  if (!solve.converged) apply_rigid_fallback(world, context, FallbackFrom::start);
  VelocitySystem::subtract(solve.solution, solve.right_side, solve.solved_change);
  // Later stages give what the solve knows: applied forces, control, friction and limits of joints.
  add_applied(world, -dt, solve.solution);
  add_joint_drive(bodies, world.last_step.joint_drive, -dt, solve.solution);
  bodies.particles.v = solve.solution.particle;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    bodies.rigid.state[i].velocity = solve.solution.linear[i];
  if (!bodies.bound.empty())
    for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
      if (bodies.rigid.properties[i].is_dynamic())
        set_angular_velocity(bodies.rigid.state[i], bodies.rigid.properties[i], solve.solution.angular[i]);
}

}  // namespace

void advance_velocity(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  if (world.has(Effect::springs)) bodies.forces.choose_altitudes(bodies.particles.x);
  const bool is_implicit = world.settings.implicit_elasticity && world.has_internal_forces();
  const bool damps_at_end = is_implicit || world.settings.constraints_before_solve;
  bodies.forces.set_time_step(context.dt, damps_at_end ? std::nullopt : std::optional(damping_at(world)));
  carry(context.kinematic, context.states.x_n, context.dt, bodies);
  if (is_implicit)
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
