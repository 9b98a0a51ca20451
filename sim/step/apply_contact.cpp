// Step III: contact and joints (paper section 5), and the functions that V.4 shares with it.
#include "sim/base/stop.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {

namespace {

// Factor on the largest number of sweeps of islands without a warm start, as at the start of a scene. With
// fewer sweeps a house of cards would lean before its forces are found.
constexpr int cold_start = 10;
constexpr int joint_rounds = 10,  // largest number of rounds in which contact and joints take turns
    joint_share = 4;              // in such a round contact gets its number of sweeps divided by this

// Solves contact once in `round` (from 0) of the turns with joints. `articulated_response` is the response of
// jointed bodies, or null; if it knows all joints, the first round gets all sweeps. Islands without joints
// are solved in the first round, as if there were no joints in the scene.
void sweep_contacts(World& world, StepContext& context, int round,
                    ArticulatedResponse* articulated_response) {
  ContactSolveSettings settings = world.settings.contact;
  settings.fall = world.gravity.norm() * context.dt;
  if (round == 0) settings.cold_iterations = (cold_start - 1) * settings.iterations;
  const bool knows_joints = articulated_response && articulated_response->is_complete();
  settings.jointed_iterations = settings.iterations;
  if (world.has(Effect::articulation) && !(round == 0 && knows_joints))
    settings.jointed_iterations = (settings.iterations + joint_share - 1) / joint_share;
  if (round > 0) settings.iterations = 0;
  world.counters.contact_sweeps +=
      solve_contact(world.bodies, context.contact.graph, settings, context.contact.contacts,
                    context.contact.solve, articulated_response);
  if (world.has(Effect::shock_propagation) && (round == 0 || settings.shocks_everywhere))
    world.clock.time(Stage::shock_propagation, [&] {
      propagate_shocks(world.bodies, context.contact.graph, settings, context.contact.contacts);
    });
}

// Returns the time for which impulses act, s.
double duration_of(const StepContext& context, ContactSolve solve) {
  return solve == ContactSolve::at_end ? context.dt : context.dt / 2;
}

// Returns how step V treats the impulses of limits in step III. They stay where they acted, at x^n, as those
// of structure rows and of contacts between rigid bodies do: with all of them at x^{n+1}, bodies that slide
// along a limit of swing gain or lose energy in proportion to the step. Velocity solves for internal forces
// find limits again.
HalfwayLimits limits_halfway(const World& world) {
  return world.has_internal_forces() ? HalfwayLimits::are_found_again : HalfwayLimits::are_kept;
}

// Sets context.joints.drive to the mean forces of the last joint solve.
void find_joint_drive(const World& world, StepContext& context, ContactSolve solve) {
  if (world.has_internal_forces())
    find_drive(context.joints.solver, context.joints.solver.impulses(), duration_of(context, solve),
               context.joints.drive);
}

// Solves for the joints with their control, and returns their largest violation before, m/s or rad/s.
double solve_joints(World& world, StepContext& context, ContactSolve solve) {
  double off = 0;
  const Articulation& articulation = world.bodies.articulation;
  world.clock.time(Stage::joints, [&] {
    off = solve == ContactSolve::at_end
              ? context.joints.solver.stabilize_and_control(articulation, world.bodies.rigid)
              : context.joints.solver.pre_stabilize(articulation, world.bodies.rigid, context.end_pose,
                                                    context.dt, world.settings.orientation);
  });
  find_joint_drive(world, context, solve);
  return off;
}

}  // namespace

void find_drive(const JointSolver& joints, const std::vector<double>& impulses, double seconds,
                RigidForces& drive) {
  joints.sum_drive(impulses, drive.linear, drive.angular);
  for (std::vector<Vec3>* values : {&drive.linear, &drive.angular})
    for (Vec3& value : *values) value /= seconds;
}

void control_joints(World& world, StepContext& context, ContactSolve solve) {
  JointStage& joints = context.joints;
  if (world.touches())
    joints.response.prepare(world.bodies, joints.solver, ControlledJoints::are_held,
                            context.contact.contacts);
  joints.solver.begin_impulses(world.bodies.articulation, duration_of(context, solve));
  if (solve == ContactSolve::at_end) {
    if (limits_halfway(world) == HalfwayLimits::are_kept) joints.solver.start_limits();
    joints.forces.hand_to(joints.solver);
  }
  solve_joints(world, context, solve);
}

// Joints are solved last in each round, so that they hold exactly. If contact knows the response of the
// joints, one or two rounds are enough.
void solve_contacts(World& world, StepContext& context, ContactSolve solve) {
  const bool joints = world.has(Effect::articulation);
  ArticulatedResponse* articulated_response = joints ? context.joints.response.prepared() : nullptr;
  for (int round = 0; round < joint_rounds; ++round) {
    stop_if_asked();
    if (articulated_response) articulated_response->begin(world.bodies.rigid);
    sweep_contacts(world, context, round, articulated_response);
    if (!joints) break;
    if (articulated_response) articulated_response->finish(world.bodies.rigid);
    double off = solve_joints(world, context, solve);
    if (articulated_response) off = articulated_response->difference(world.bodies.rigid);
    if (off < world.settings.contact.tolerance) break;
    if (!articulated_response || !context.joints.solver.limits_have_changed()) continue;
    articulated_response->release(context.contact.contacts);
    articulated_response =
        articulated_response->prepare(world.bodies, context.joints.solver,
                                      ControlledJoints::are_held_with_limits, context.contact.contacts);
  }
}

const ArticulatedResponse* link_active_contacts(World& world, StepContext& context) {
  for (ContactPoint& contact : context.contact.contacts.points)
    if (!contact.impulse.isZero(0)) update_geometry(world.bodies, contact);
  return context.joints.response.prepare(world.bodies, context.joints.solver, ControlledJoints::are_free,
                                         context.contact.contacts);
}

void find_contact_graph(World& world, StepContext& context) {
  ContactStage& contact = context.contact;
  Bodies& bodies = world.bodies;
  build_contact_graph(bodies, world.gravity,
                      world.has(Effect::rigid_contact) ? RigidPairs::are_active : RigidPairs::are_left_out,
                      contact.contacts, contact.graph);
  if (world.has(Effect::shock_propagation)) build_shock_layers(contact.contacts, contact.graph);
  set_path_velocities(bodies, context.kinematic, contact.graph, contact.contacts);
  find_speculative_targets(context.dt, world.settings.orientation, contact.graph, bodies, contact.contacts,
                           PredictionFor::motion_in_step);
}

void leave_contact_to_solve(World& world, StepContext& context) {
  find_solved_islands(world, context);
  for (const int p : context.contact.graph.pairs) {
    ContactPair& pair = context.contact.contacts.pairs[as_index(p)];
    if (is_solved(context, world.bodies, pair)) pair.active = false;
  }
}

void start_contact_warm(World& world, StepContext& context) {
  warm_start(world.last_step.contact_cache, context.dt / 2, context.contact.graph, world.bodies,
             context.contact.contacts);
}

void control_joints(World& world, StepContext& context) {
  control_joints(world, context, ContactSolve::halfway);
}

void apply_contact(World& world, StepContext& context) {
  if (world.touches()) {
    solve_contacts(world, context, ContactSolve::halfway);
    note_frames(context.contact.graph, world.bodies, context.contact.contacts, context.contact.first_frames);
  }
  if (world.has(Effect::articulation))
    context.joints.solver.kept_impulses(limits_halfway(world), context.joints.push, context.joints.turn);
  check_finite(world, Stage::contact);
}

}  // namespace duet
