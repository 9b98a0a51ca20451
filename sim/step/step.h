// One time step (paper section 2), and the functions that its stages share. sim/step/stages.h declares the
// stages, and sim/step/stage_table.h holds their order.
#pragma once

#include <limits>
#include <string_view>

#include "sim/step/stages.h"
#include "sim/step/world.h"

namespace duet {

/// The caller's leave to refuse a step, and the reason why the last step was refused.
///
/// A step is refused if jointed bodies turn farther than the time-step rule foresaw, if the joints miss too
/// much of the energy of the motion between them, if the step gains energy, or if its solves with contact do
/// not converge.
struct Refusal {
  /// True if the caller accepts a refusal; otherwise every step is taken.
  bool is_allowed = true;
  /// Energy that the last refused step gained, J; infinity if it was not refused for a gain.
  ///
  /// A shorter step that still gains half as much or more is taken if the gain is small, because what contact
  /// gains does not vanish with shorter steps.
  double gain = std::numeric_limits<double>::infinity();
  /// Number of steps that were refused in a row because their solves with contact did not converge.
  int unsolved = 0;
};
/// Advances the world by `dt` (s) from `time` (s), and returns whether the step was taken.
///
/// If `refusal` is given and allows it, a step that proves too long is refused: the state is then that of
/// time n, the result is false, and the caller tries a shorter step. Throws SimulationError, which names
/// stage and body, when a value stops being finite or when joints or surfaces cannot be kept; the positions
/// and velocities of time n are then in `world.context`, and restore_step_start() puts them back.
bool step(World& world, double time, double dt, Refusal* refusal = nullptr);

/// Returns whether steps of this world are checked for a gain of energy.
///
/// They are if elasticity is implicit, or, without internal forces, if rigid bodies are in contact.
bool may_gain_energy(const World& world);
/// The energy that a world has.
struct StoredEnergy {
  double moving = 0,  ///< J, kinetic and elastic energy
      all = 0;        ///< J, kinetic and elastic energy and that of gravity
};
/// Returns the energy of the world now.
StoredEnergy energy_now(const World& world);
/// Returns the elastic and gravitational energy of all bodies, J.
double potential_energy(const World& world);
/// Returns whether the step that began with the energy `before` is to be refused for its gain of energy.
///
/// A step is refused if it has gained more than a scene that nothing drives may, and if a shorter step helps.
/// Never in scenes with motors or with kinematic bodies that move others by joints or pins. The work of other
/// kinematic bodies, and of parting bodies that overlap since the start, is left out. Stores the gain in
/// `refusal`.
bool gains_energy(const World& world, const StoredEnergy& before, Refusal& refusal);

/// Puts the positions, orientations and velocities of time n back, as begin_step() stored them.
void restore_step_start(World& world);
/// Finishes a step: recomputes what follows from the state, and checks that the state is finite.
///
/// w = I^-1 L is recomputed without the rounding of its increments, so that a state is x, q, v and L alone.
/// Particles that dynamic bodies carry are placed. Throws SimulationError if a value is not finite.
void end_step(World& world);

/// The quantity that bounds the length of a time step.
enum class TimeStepBound {
  setting,     ///< solver.max_time_step
  elasticity,  ///< a fraction of the elastic stability limit 2/omega_max of the elements as they are now
  stretching,  ///< no element may be deformed by more than a quarter of its size, or half of its volume
  turn,        ///< no rigid body may turn by more than solver.max_rotation, nor its sinusoids' phase
  swing,       ///< no pendulum may swing through more than 0.1 rad of its phase
  approach     ///< no body may get too deep into another one
};
/// The longest time step that the rule allows, and its reason.
struct TimeStepChoice {
  double seconds = 0;                            ///< s
  TimeStepBound bound = TimeStepBound::setting;  ///< which bound is the smallest
  int body = -1,  ///< body that turns or meets another: rigid bodies are numbered before deformable ones; -1:
                  ///< none
      other = -1;  ///< the other body that it meets; -1: none
};
/// Returns the longest step that the rule allows at `time` (s), and what bounds it.
///
/// Two bodies bound the step only if they can meet within it; kinematic bodies count with the motion that is
/// ahead of them. Bodies far apart may approach until they almost touch. Bodies near each other may get no
/// deeper into each other than solver.max_travel times the thickness of a dynamic body, and half the
/// thickness of a body that is not dynamic, so that nothing passes through another body however fast it is.
TimeStepChoice bounded_time_step(World& world, double time);
/// Describes a choice for the user: "the turn of `bar`".
std::string describe(const TimeStepChoice& choice, const Bodies& bodies);
/// Returns the seconds of bounded_time_step().
double choose_time_step(World& world, double time);

/// Stores x^n and v^n, and chooses the bodies with contact inside their velocity solves.
///
/// It comes before all stages; tests that look between stages call it themselves.
void begin_step(World& world, StepContext& context);
/// Runs the stages from the first row of `first` to the last row of `last` that the scene needs.
///
/// For tests that look between stages: it runs no check for too long steps.
void run_stages(World& world, Stage first, Stage last);

/// The two contact solves of a step.
enum class ContactSolve {
  halfway,  ///< step III, for the velocities v^{n+1/2} that move the positions
  at_end    ///< step V.4, for the velocities v^{n+1}
};
/// Solves for the joints with their control, before contact.
///
/// It also prepares context.joints.response, by which contact knows what joints and control do to the bodies
/// that it meets.
void control_joints(World& world, StepContext& context, ContactSolve solve);
/// Solves contact and joints in turn, until contact no longer disturbs the joints.
///
/// At most ten rounds. Joints are solved last, so that their constraints hold exactly.
void solve_contacts(World& world, StepContext& context, ContactSolve solve);

/// Returns whether a dynamic rigid body has less than a tenth of the mass of some deformable body.
///
/// Only then can a deformable body crush a rigid one between itself and an obstacle.
bool may_crush(const Bodies& bodies);
/// Chooses the deformable bodies with contact inside their velocity solves in this step, at its start.
///
/// Sets context.solved.bodies; the contacts that held a force at the end of the last step stand for those of
/// this step. The file sim/step/solved_bodies.cpp says which bodies are chosen, and why.
void choose_solved_bodies(World& world, StepContext& context);
/// Returns whether choose_pressed_layers() may choose a body in some step, by the plan and the bodies.
bool may_press_layers(const World& world);
/// Adds the sheets and rods that lie in layers under a load, and what lies on them.
///
/// Extends context.solved.bodies by the pairs of surfaces and the cached contacts of x^n. The file
/// sim/step/pressed_layers.cpp says which bodies are chosen, and why.
void choose_pressed_layers(World& world, StepContext& context);
/// Returns the place of a cached contact on its deformable guest.
SurfacePoint soft_place(const Bodies& bodies, const CachedContact& remembered);
/// Adds the deformable bodies that crush a rigid one by the contacts of this step.
///
/// Extends context.solved.bodies; the islands of context.solved.islands hold the contacts of this step.
void add_solved_bodies(const World& world, StepContext& context);
/// Finds the islands of this step's contacts that hold a chosen body, and leaves out all others.
///
/// Sets context.solved.islands, whose searched islands are those with contact inside their velocity solve.
void find_solved_islands(World& world, StepContext& context);
/// Returns whether a pair of bodies has its contact inside a velocity solve.
bool is_solved(const StepContext& context, const Bodies& bodies, const ContactPair& pair);
/// Brings the contacts that hold impulses to the poses now, and gives them the response of jointed bodies.
///
/// Returns what a ContactProjection needs to know of jointed bodies: see ArticulatedResponse::prepare.
const ArticulatedResponse* link_active_contacts(World& world, StepContext& context);
/// Makes context.solve.projection that of the contacts that hold an impulse, of self-repulsions and of
/// joints.
///
/// Contacts of `sticking` bodies that stick are held along their tangents too; see ContactProjection::build.
void project_active_contacts(World& world, StepContext& context, const StickingBodies& sticking = {});

/// Sets context.solve.force to gravity and the elastic forces (N) at the positions now.
///
/// If contact may be part of a solve, context.solve.explicit_force gets the same forces. Unless `turn` is
/// null, InternalForces::add_kept_turn_forces() can add its forces next.
void find_explicit_forces(World& world, StepContext& context, const Turn* turn);
/// Adds the change of the viscous forces (N) between x^{n+1/2}, the state of the elements, and the fraction
/// `at` of the step, to which the velocities of a solve belong, at the mean velocities of the step; see
/// InternalForces::add_turn_forces().
void add_turn_forces(World& world, StepContext& context, double at, std::vector<Vec3>& force);
/// Holds the particles at x^{n+1/2} while it lives.
///
/// It exchanges the particle positions with context.states.x_half, and exchanges them back when it ends.
class AtMiddle {
 public:
  /// Takes the particles of `world` from x^{n+1} to x^{n+1/2}.
  explicit AtMiddle(World& world) : world_(world) {
    world_.bodies.particles.x.swap(world_.context.states.x_half);
  }
  /// Takes the particles back to x^{n+1}.
  ~AtMiddle() { world_.bodies.particles.x.swap(world_.context.states.x_half); }
  AtMiddle(const AtMiddle&) = delete;
  AtMiddle& operator=(const AtMiddle&) = delete;

 private:
  World& world_;
};
/// Sets the arms of forces on bound particles to those at x^{n+1/2}.
///
/// The particles stand at x^{n+1/2}; the body's center is the mean of those in `rigid_n`, the rigid states of
/// time n, and in the states now.
void bring_bound_to_middle(Bodies& bodies, const std::vector<RigidState>& rigid_n);
/// Applies the forces (N) on bound particles over `dt` (s) to the bodies that carry the particles.
///
/// `force` has an entry per particle. Forces act at the arms that EmbeddedParticle::offset holds.
void apply_bound_forces(Bodies& bodies, const std::vector<Vec3>& force, double dt);
/// Adds to `velocity` what the pressures of the last step change of velocities within `dt` (s).
///
/// The pressures act at the positions now.
void add_held_pressures(World& world, StepContext& context, double dt, GeneralizedVelocity& velocity);
/// Adds `sign` times the velocities now to context.spin.twice_moved, for keep_spin().
///
/// A change of velocities between a call with -1 and one with 1 counts as forces at x^{n+1/2}. begin_spin()
/// makes the first count with -1.
void count_middle_forces(World& world, StepContext& context, double sign);

/// Forces from outside that a velocity solve has to know: damping acts on the velocities that they leave.
struct KnownForces {
  const RigidForces* drive;  ///< those of control, friction and limits of joints
  double applied_for;        ///< s, for which the solve adds the applied forces
};
/// Sets `drive` to mean forces of control, friction and limits: `impulses` of all rows of joints over
/// `seconds` (s).
void find_drive(const JointSolver& joints, const std::vector<double>& impulses, double seconds,
                RigidForces& drive);
/// Adds the velocities that the forces `drive` make in `dt` (s) to v.
void add_joint_drive(const Bodies& bodies, const RigidForces& drive, double dt, GeneralizedVelocity& v);
/// The step that a velocity solve belongs to.
enum class SolveOf {
  advance_velocity,  ///< I.1
  update_velocity    ///< V.2
};
/// Solves for the implicit velocity of I.1 or V.2:
///
///     V = v + dt M^-1 (F + F_damping(V))
///
/// where v are the velocities now, and F gravity and the elastic forces. `dt` (s) is the time after which
/// damping is evaluated: solver.damping_at times the step, or half of the step in implicit ones. Sets
/// context.solve.solution to V and context.solve.force to F + F_damping(V). Semi-implicitly, F is what
/// find_explicit_forces() left in context.solve.force. With implicit elasticity, in I.1 alone, F is taken at
/// x^n + dt V; the solve leaves the particles there, and context.solve.converged says whether it converged.
///
/// `projection` holds the constraints on V, or is null.
void solve_velocity(World& world, StepContext& context, double dt, const KnownForces& known,
                    ContactProjection* projection, SolveOf stage);
/// Solves V = b + dt M^-1 F_damping(V) by conjugate gradients, for the damping alone.
///
/// The search starts at context.solve.solution and leaves V there; b is context.solve.right_side, which is
/// overwritten. Adds F_damping(V) (N) to context.solve.force. `projection` holds the constraints on V, or is
/// null. `blocks` are those of the preconditioner that are assembled for the deformation now; with
/// AssembleBlocks::missing the preconditioner of the last such solve is kept, and islands with contact inside
/// their solve are left out. Returns whether V is finite.
bool solve_with_damping(World& world, StepContext& context, double dt, ContactProjection* projection,
                        AssembleBlocks blocks);
/// Returns the potential that the implicit solve minimizes without damping, J:
///
///     1/2 |V - v - dt g|_M^2 + elastic energy at x^n + dt V
///
/// for V in context.solve.solution and v in context.solve.right_side; `dt` is in s. Leaves the particles at
/// x^n + dt V.
double incremental_potential(World& world, const StepContext& context, double dt);
/// An equation V = b + dt M^-1 F for a velocity, which find_velocity() solves.
///
/// b is context.solve.right_side, and the search starts at context.solve.solution. F are the damping forces
/// at the deformation of the last elastic evaluation; with elasticity, F are gravity, elastic and damping
/// forces at x^n + dt V, where the search leaves the particles. Impulses of contacts and constraints are
/// added if there are any.
struct VelocityProblem {
  double dt = 0;                            ///< s
  bool is_elastic = false;                  ///< true if elastic forces are part of F
  ContactProjection* projection = nullptr;  ///< constraints on V; null: none
  ContactForces* contacts = nullptr;        ///< contacts whose impulses are unknowns; null: none
  JointForces* joints = nullptr;            ///< joints whose drive is unknown, with contacts only; null: none
  const Islands* islands = nullptr;         ///< islands whose velocities are sought; null: all
};
/// Solves `problem` by Newton's method, and returns whether it converged.
///
/// Leaves V in context.solve.solution, and in context.solve.newton_residual the residual: by how much V falls
/// short of the right side under the constraints, m/s. The search has converged if the residual is less than
/// the tolerance; a bound on its iterations may end it before.
bool find_velocity(World& world, StepContext& context, const VelocityProblem& problem);
/// Fills context.solve.blocks, the preconditioner, for a solve over `dt` (s).
///
/// The blocks hold the damping of the last elastic evaluation's deformation, and its elasticity if that is
/// one of the `forces` of the solve.
void find_blocks(World& world, StepContext& context, double dt, ImplicitForces forces);
/// Returns the potential (J) that find_velocity() minimizes, at context.solve.solution.
double solve_potential(World& world, StepContext& context, const VelocityProblem& problem);
/// The velocities whose means a rigid fallback takes.
enum class FallbackFrom {
  start,    ///< v^n + dt/2 g: in I.1.
  solution  ///< V: after contact.
};
/// Applies the rigid fallback to an implicit solve that did not converge: V becomes (V + W) / 2.
///
/// W is the mean velocity of each deformable body: of v^n + dt/2 g, or of V after contact. Positions
/// move by dt V, which is twice as far as x^n + dt/2 V, the least energy that was found; as far beyond it
/// again, the energy may be far higher. So deformation stops at the least energy, and each body moves on as a
/// whole.
///
/// After contact V is kept if the residual is smaller than what the fallback would take of V, both in the
/// mass norm: in that norm the error of V is no larger than the residual, as long as the energy is convex.
void apply_rigid_fallback(const World& world, StepContext& context, FallbackFrom from);

/// Gives back the momentum that a solve with contact has lost, to islands as wholes.
///
/// After a solve over `dt` (s) without elasticity, each searched island in context.solve.solution moves on as
/// a rigid body by the momentum that context.solve.newton_residual has left of it, about the positions now.
/// Islands with joints are left out, because their joints may hold them to something fixed.
void return_momentum_to_islands(World& world, StepContext& context, const Islands& islands, double dt);
/// Gives back the momentum that a solve with contact has lost, to every body by itself.
///
/// Changes `velocity`: each deformable body moves on as a rigid body by what context.solve.newton_residual
/// has left of it, about the particle positions `x` (m), and each rigid body by its own. Does nothing if a
/// searched island has joints.
void return_momentum_to_bodies(const World& world, const Islands& islands, const std::vector<Vec3>& x,
                               double dt, GeneralizedVelocity& velocity);
/// Returns the impulse of pins and mass-proportional damping in a solve over `dt` (s), about the origin.
///
/// It counts what they give to the searched `islands` at context.solve.solution beyond what they gave without
/// contact, which context.solve.solved_change holds.
Momentum impulse_of_holders(const World& world, const Islands& islands, double dt);

/// Throws SimulationError, which names `stage`, if a particle's or a body's state is not finite.
void check_finite(const World& world, std::string_view stage);
/// Throws SimulationError, which names `stage`, if a particle's or a body's state is not finite.
void check_finite(const World& world, Stage stage);

}  // namespace duet
