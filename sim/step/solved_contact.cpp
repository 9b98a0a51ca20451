// Contact inside the velocity solves. Sweeps over contacts move particles by their bare masses, without the
// damping and stiffness around them. Where these are most of what a particle feels within a step, a body
// that lands or rests would be crushed at its surface, between the obstacle and the rest of the body, which
// goes on, and the elastic forces would turn that into far more energy than there was. Here contacts are part
// of the system, so that the whole body takes up their impulses:
//
//   III  V = v^^n + dt/2 (g + M^-1 (F + F_damping(V) + J)), with F at x^n + dt/2 V where elasticity is
//        implicit, otherwise at x^n. No contact closes by more than its gap in the whole step.
//   V    v^{n+1} = v-^n + dt (g + M^-1 (F(x^{n+1/2}) + F_damping(v^{n+1}) + J)). The damping is that of
//        the end of the step: the trapezoidal rule would reverse strongly damped motion in each step, and
//        so throw up bodies that land.
//
// J are the impulses of contact, with Coulomb friction, over the time of the solve. Both solves minimize a
// convex potential, or the sum of one and the elastic energy, so that they take energy and give none. For V
// that holds by the midpoint rule, because a contact that pushes does not open in the step.
#include <algorithm>

#include "sim/contact/detection/impact_plane.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Returns the projection that keeps the joints of `islands` in a solve, or null if they have none.
ContactProjection* keep_joints(World& world, StepContext& context, const Islands& islands) {
  if (!islands.has_joints()) return nullptr;
  context.solve.projection.build(world.bodies);
  context.joints.solver.prepare_projection(world.bodies.rigid);
  context.solve.projection.add_joints(context.joints.solver);
  return &context.solve.projection;
}

// Number of solves by which implicit steps find the middle of the step for bodies whose strain relaxes
// slowly. The first middle is far off if contact stops a body that turned.
constexpr int middles = 2;

// Sets the velocities of bodies on the searched islands to `velocity`.
void take_velocities(const GeneralizedVelocity& velocity, const Islands& islands, Bodies& bodies) {
  for (const Islands::Range& range : islands.ranges())
    for (std::size_t p = range.begin; p < range.end; ++p)
      if (!is_held(bodies.particles, p)) bodies.particles.v[p] = velocity.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!islands.is_searched_rigid(i)) continue;
    bodies.rigid.state[i].velocity = velocity.linear[i];
    set_angular_velocity(bodies.rigid.state[i], bodies.rigid.properties[i], velocity.angular[i]);
  }
}

// v += dt M^-1 F for the forces F (N) on particles, including the bodies that carry particles.
void add_forces(const Bodies& bodies, const std::vector<Vec3>& force, double dt, GeneralizedVelocity& v) {
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    v.particle[p] += dt * bodies.particles.inverse_mass[p] * force[p];
  add_force_twists(bodies.rigid, bodies.bound, force, dt, v.linear, v.angular);
}

// Evaluates the elements at x^n + dt V, the middle of the step, for V in context.solve.solution, and leaves
// the elastic forces there in context.solve.damping_force. Damping acts at that deformation, where the
// displacement of a body that only turns has no strain. At the deformation of the beginning the body would
// grow with every step, and strong damping would not let it shrink again.
void deform_to_middle(World& world, StepContext& context, double dt) {
  Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.x[p] = context.states.x_n[p] + dt * context.solve.solution.particle[p];
  context.solve.damping_force.assign(particles.size(), Vec3::Zero());
  world.clock.time(Stage::elastic_forces,
                   [&] { world.bodies.forces.add_elastic_forces(particles.x, context.solve.damping_force); });
  particles.x = context.states.x_n;
}

// Sets right_side to context.solved.middle_velocity, the velocities before this solve, less the change that
// the solve of step I made: this solve replaces it.
void begin_right_side(const Bodies& bodies, StepContext& context) {
  VelocitySolve& solve = context.solve;
  solve.right_side = context.solved.middle_velocity;
  VelocitySystem::axpy(-1, solve.solved_change, solve.right_side);
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)  // held particles are led
    if (is_held(bodies.particles, p))
      solve.right_side.particle[p] = context.solved.middle_velocity.particle[p];
}

// right_side += dt M^-1 (F(x^n + dt V) + gravity), with the forces that deform_to_middle() has found. Forces
// of x^n would give a turning body a moment, because they act in the middle of the step; nothing in the solve
// resists the moment, and in stiff bodies each step would add more to it than the last.
void add_forces_of_middle(World& world, StepContext& context, double dt) {
  const Particles& particles = world.bodies.particles;
  std::vector<Vec3>& force = context.solve.explicit_force;
  force = context.solve.damping_force;
  for (std::size_t p = 0; p < particles.size(); ++p) force[p] += particles.mass[p] * world.gravity;
  add_forces(world.bodies, force, dt, context.solve.right_side);
}

// Fills context.solve.blocks and builds context.solved.forces for a solve over `dt` (s). The impulses that
// contacts hold, times `factor`, are the multipliers.
void build_forces(World& world, StepContext& context, const Islands& islands, double dt, double factor) {
  find_blocks(
      world, context, dt,
      world.settings.implicit_elasticity ? ImplicitForces::damping_and_elasticity : ImplicitForces::damping);
  context.solved.forces.build(world.bodies, context.contact.contacts, context.contact.graph, islands, factor,
                              context.solve.blocks.own());
}

// Builds context.joints.forces for a solve over `dt` (s), after build_forces(). The multipliers are `factor`
// times the impulses in context.joints.drive_impulse.
void build_joint_forces(World& world, StepContext& context, const Islands& islands, RateAt at, double dt,
                        double factor) {
  JointStage& joints = context.joints;
  joints.forces.clear();
  if (!islands.has_joints()) return;
  joints.solver.drive_rows(world.bodies.articulation, world.bodies.rigid, at, context.dt, dt,
                           joints.drive_rows);
  joints.forces.build(world.bodies.rigid, joints.drive_rows, islands, context.solved.forces.heaviest(),
                      joints.drive_impulse, factor);
}

// Starts the solve at v^^n instead of the velocity without contact, if its potential is lower, as for bodies
// at rest. Solves with constraints keep their start.
void begin_at_the_better(World& world, StepContext& context, const VelocityProblem& problem) {
  VelocitySolve& solve = context.solve;
  if (problem.projection) return;
  const double as_predicted = solve_potential(world, context, problem);
  GeneralizedVelocity& other = solve.preconditioned;
  other = solve.solution;
  for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
    if (!is_held(world.bodies.particles, p)) solve.solution.particle[p] = context.states.v_hat_n.particle[p];
  for (std::size_t i = 0; i < world.bodies.rigid.size(); ++i) {
    if (!world.bodies.rigid.properties[i].is_dynamic()) continue;
    solve.solution.linear[i] = context.states.v_hat_n.rigid[i];
    solve.solution.angular[i] =
        world.bodies.rigid.state[i].inverse_inertia * context.states.v_hat_n.rotation[i];
  }
  follow_twists(world.bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
  if (!(solve_potential(world, context, problem) < as_predicted)) solve.solution = other;
}

}  // namespace

void find_solved_islands(World& world, StepContext& context) {
  SolvedContact& solved = context.solved;
  const Bodies& bodies = world.bodies;
  Islands& islands = solved.islands;
  islands.begin(bodies);
  for (const int p : context.contact.graph.pairs) {
    const ContactPair& pair = context.contact.contacts.pairs[as_index(p)];
    if (pair.guest_rigid >= 0)
      islands.join_rigid(pair.host, pair.guest_rigid);
    else
      islands.join_particle(pair.host, bodies.deformable[as_index(pair.guest_deformable)].first_particle);
  }
  if (world.has(Effect::self_repulsion))
    for (const RepulsionPair& pair : context.surfaces.approaching.pairs())
      islands.join_particles(pair.particle.front(), pair.particle.back());
  islands.finish();
  add_solved_bodies(world, context);
  solved.is_searched.assign(islands.size(), false);
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d)
    if (solved.bodies[d])
      solved.is_searched[as_index(islands.of_particle(bodies.deformable[d].first_particle))] = true;
  for (std::size_t i = 0; i < islands.size(); ++i)
    if (!solved.is_searched[i]) islands.leave(i);
  islands.update();
  solved.forces.clear();
  context.joints.forces.clear();
}

bool is_solved(const StepContext& context, const Bodies& bodies, const ContactPair& pair) {
  const Islands& islands = context.solved.islands;
  if (islands.is_searched_rigid(as_index(pair.host))) return true;
  if (pair.guest_rigid >= 0) return islands.is_searched_rigid(as_index(pair.guest_rigid));
  const int particle = bodies.deformable[as_index(pair.guest_deformable)].first_particle;
  return islands.is_searched(as_index(islands.of_particle(particle)));
}

namespace {

// Solves step III on the searched islands of `islands`, with `forces` in the solve.
void solve_halfway(World& world, StepContext& context, const Islands& islands, ImplicitForces forces) {
  if (islands.searched() == 0) return;
  Bodies& bodies = world.bodies;
  const double dt = context.dt / 2;
  const bool is_elastic = forces == ImplicitForces::damping_and_elasticity;
  build_forces(world, context, islands, dt, 1);
  if (world.has(Effect::self_repulsion))
    context.solved.forces.add_pairs(bodies, context.surfaces.approaching.pairs(), islands, context.dt,
                                    parted_share, world.last_step.pair_forces, dt,
                                    context.solve.blocks.own());
  const bool is_implicit = world.settings.implicit_elasticity;
  if (context.solved.forces.empty() && is_implicit && !islands.has_joints()) return;
  context.solve.solution = context.solved.middle_velocity;
  build_joint_forces(world, context, islands, RateAt::whole_step, dt, 1);
  context.joints.forces.add_velocities(-1, context.solved.middle_velocity);  // unknown in this solve
  const Momentum known_drive = context.joints.forces.impulse_of_fixed();
  begin_right_side(bodies, context);
  follow_twists(bodies.bound, context.solve.solution.linear, context.solve.solution.angular,
                context.solve.solution.particle);
  if (!is_elastic) deform_to_middle(world, context, dt);
  if (!is_elastic && is_implicit) add_forces_of_middle(world, context, dt);
  const VelocityProblem problem{.dt = dt,
                                .is_elastic = is_elastic,
                                .projection = keep_joints(world, context, islands),
                                .contacts = &context.solved.forces,
                                .joints = &context.joints.forces,
                                .islands = &islands};
  begin_at_the_better(world, context, problem);
  bool converged = find_velocity(world, context, problem);
  for (int i = 1; i < middles && !is_elastic && is_implicit; ++i) {
    begin_right_side(bodies, context);
    deform_to_middle(world, context, dt);
    add_forces_of_middle(world, context, dt);
    converged = find_velocity(world, context, problem);
  }
  context.solved.forces.store_pairs(dt, context.solved.pair_forces);
  context.joints.forces.give_impulses(context.joints.drive_impulse, context.joints.swept_impulse);
  bodies.particles.x = context.states.x_n;
  context.solved.converged = context.solved.converged && converged;
  if (!converged && is_elastic) apply_rigid_fallback(world, context, FallbackFrom::solution);
  if (!world.settings.implicit_elasticity) {
    context.solved.from_outside = context.solved.forces.impulse_of_pins(bodies.particles);
    context.solved.from_outside += impulse_of_holders(world, islands, dt);
    context.solved.from_outside += context.joints.forces.impulse_of_fixed() - known_drive;
    return_momentum_to_islands(world, context, islands, dt);
  }
  take_velocities(context.solve.solution, islands, bodies);
  to_generalized(bodies, context.solved.middle_velocity);
  context.solved.forces.store(1, context.contact.contacts);
}

// Divides the searched islands of implicit steps into context.solved.elastic and context.solved.relaxing. On
// the latter, strain relaxes so slowly that elastic forces hardly change within the step, and their solve
// leaves elasticity out. With it, Newton's method would have to find the deformation at which strong damping
// acts together with the velocity, and it fails where contact turns bodies far within a step.
void find_relaxing_islands(World& world, StepContext& context) {
  SolvedContact& solved = context.solved;
  // Least number of steps in which strain relaxes. Explicit forces are stable from half a step on as long as
  // bodies are hardly deformed, but a body that is compressed to half of its size is several times as stiff.
  constexpr double least = 10;
  solved.elastic = solved.relaxing = solved.islands;
  for (std::size_t i = 0; i < solved.islands.size(); ++i) {
    if (!solved.islands.is_searched(i)) continue;
    bool relaxes_slowly = true;
    for (std::size_t d = 0; d < world.bodies.deformable.size(); ++d)
      if (as_index(solved.islands.of_particle(world.bodies.deformable[d].first_particle)) == i)
        relaxes_slowly = relaxes_slowly && world.damping_time[d] >= least * context.dt;
    (relaxes_slowly ? solved.elastic : solved.relaxing).leave(i);
  }
  solved.elastic.update();
  solved.relaxing.update();
}

// Adds the forces of step V without contact and damping to the velocities before it:
// b = v-^n + dt (g + M^-1 F). Prescribed velocities replace those of step III, too. `swept_drive` are the
// forces of joints outside the solve.
void find_start_velocity(World& world, StepContext& context, const RigidForces& swept_drive) {
  Bodies& bodies = world.bodies;
  GeneralizedVelocity& b = context.solved.start_velocity;
  add_turn_forces(world, context, 1, context.solve.explicit_force);
  add_forces(bodies, context.solve.explicit_force, context.dt, b);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) b.linear[i] += context.dt * world.gravity;
  add_joint_drive(bodies, swept_drive, context.dt, b);
  for (const KinematicStep& step : context.kinematic) {
    b.linear[step.body] = bodies.rigid.state[step.body].velocity;
    b.angular[step.body] = bodies.rigid.state[step.body].angular_velocity;
  }
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    if (is_held(bodies.particles, p))
      b.particle[p] = context.solved.middle_velocity.particle[p] = bodies.particles.v[p];
}

// Updates the contacts at x^{n+1}, with targets for the velocities of step III, which the bodies of the
// searched islands get.
void update_contacts_at_end(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  ContactStage& contact = context.contact;
  const double dt = context.dt;
  take_velocities(context.solved.middle_velocity, context.solved.islands, bodies);
  follow_bodies(bodies.rigid, bodies.bound, bodies.particles);
  update_contacts(contact.graph, bodies, contact.contacts,
                  [&](const ContactPair& pair) { return is_solved(context, bodies, pair); });
  find_impact_planes(bodies, context.states.v_hat_n, dt, world.settings.orientation,
                     world.gravity.norm() * dt * dt, contact.contacts);
  find_speculative_targets(dt, world.settings.orientation, contact.graph, bodies, contact.contacts,
                           PredictionFor::velocity_in_solve);
}

// Solves for the velocities at the end of the step, with contact, pairs of surfaces and joints as unknowns.
// The search starts at the velocities now.
void find_velocity_at_end(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  VelocitySolve& solve = context.solve;
  SolvedContact& solved = context.solved;
  const double dt = context.dt;
  to_generalized(bodies, solve.solution);
  solve.right_side = solved.start_velocity;
  build_forces(world, context, solved.islands, dt, 2);
  if (world.has(Effect::self_repulsion))
    solved.forces.add_pairs(bodies, context.surfaces.repulsion.pairs(), solved.islands, dt, 0,
                            solved.pair_forces, dt, solve.blocks.own());
  build_joint_forces(world, context, solved.islands, RateAt::end, dt, 2);
  ContactProjection* projection = keep_joints(world, context, solved.islands);
  if (projection) projection->satisfy(solve.solution);
  follow_twists(bodies.bound, solve.right_side.linear, solve.right_side.angular, solve.right_side.particle);
  follow_twists(bodies.bound, solve.solution.linear, solve.solution.angular, solve.solution.particle);
  find_blocks(world, context, dt, ImplicitForces::damping);
  find_velocity(world, context,
                {.dt = dt,
                 .projection = projection,
                 .contacts = &solved.forces,
                 .joints = &context.joints.forces,
                 .islands = &solved.islands});
}

// Returns whether the solve has converged. If it has, V plus the residual are the velocities that forces and
// impulses make, which keep momentum to rounding; the solution becomes these.
bool add_residual_if_converged(const World& world, VelocitySolve& solve) {
  double left = 0;
  for (const Vec3& v : solve.newton_residual.particle) left = std::max(left, v.norm());
  const bool has_converged = left <= world.settings.cg_tolerance;
  if (has_converged) VelocitySystem::axpy(1, solve.newton_residual, solve.solution);
  return has_converged;
}

}  // namespace

void solve_contact_halfway(World& world, StepContext& context) {
  SolvedContact& solved = context.solved;
  JointStage& joints = context.joints;
  solved.from_outside = {};
  solved.converged = true;
  for (const int p : context.contact.graph.pairs) {
    ContactPair& pair = context.contact.contacts.pairs[as_index(p)];
    pair.active = pair.active || is_solved(context, world.bodies, pair);
  }
  solved.pair_forces.clear();
  if (solved.islands.searched() == 0) return;
  to_generalized(world.bodies, solved.middle_velocity);
  joints.drive_impulse = joints.swept_impulse = joints.solver.impulses();
  if (world.settings.implicit_elasticity) {
    find_relaxing_islands(world, context);
    solve_halfway(world, context, solved.elastic, ImplicitForces::damping_and_elasticity);
    solve_halfway(world, context, solved.relaxing, ImplicitForces::damping);
  } else {
    solve_halfway(world, context, solved.islands, ImplicitForces::damping);
  }
  if (!solved.islands.has_joints()) return;
  find_drive(joints.solver, joints.drive_impulse, context.dt / 2, joints.drive);
  find_drive(joints.solver, joints.swept_impulse, context.dt / 2, joints.swept_drive);
}

void solve_contact_at_end(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  VelocitySolve& solve = context.solve;
  SolvedContact& solved = context.solved;
  JointStage& joints = context.joints;
  solved.from_outside = {};
  solved.pair_forces_next.clear();
  if (solved.islands.searched() == 0) return;
  const RigidForces& swept_drive = solved.islands.has_joints() ? joints.swept_drive : joints.drive;
  find_start_velocity(world, context, swept_drive);
  update_contacts_at_end(world, context);
  find_velocity_at_end(world, context);
  const bool has_converged = add_residual_if_converged(world, solve);
  solved.converged = solved.converged && has_converged;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    solve.force[p] = solve.explicit_force[p] + solve.damping_force[p];
  // The sweeps of V.4 start from twice the impulses that contacts hold, so that half of them are stored. V.4
  // applies them again, and finds control, friction and limits of other joints anew; both are taken out of
  // the velocities here. The drive of joints in the solve stays.
  solved.forces.store(0.5, context.contact.contacts);
  solved.forces.store_pairs(context.dt, solved.pair_forces_next);
  solve.right_side = solve.solution;
  solved.forces.add_stored_velocities(-1, solve.right_side);
  add_joint_drive(bodies, swept_drive, -context.dt, solve.right_side);
  if (!world.settings.implicit_elasticity) {
    solved.from_outside = solved.forces.impulse_of_pins(bodies.particles);
    solved.from_outside += joints.forces.impulse_of_fixed();
    if (!has_converged)
      return_momentum_to_bodies(world, solved.islands, context.states.x_half, context.dt, solve.right_side);
  }
  take_velocities(solve.right_side, solved.islands, bodies);
  check_finite(world, Stage::contact_in_solve_at_end);
}

}  // namespace duet
