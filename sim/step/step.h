// One time step (paper section 2), and what its stages share. The stages themselves: sim/step/stages.h; their
// order: sim/step/stage_table.h.
#pragma once

#include <limits>
#include <string_view>

#include "sim/step/stages.h"
#include "sim/step/world.h"

namespace duet {

// Advances the world by `dt` (s) from `time` (s). Throws SimulationError, naming stage and body, when a value
// stops being finite; the positions and velocities of time n are then in world.context (restore_step_start
// puts them back).
//
// A step that proves too long, as bodies on joints turn farther than the rule foresaw, a joint would have to
// do more work than is between the bodies, or the step gains energy, is refused where the caller
// allows it: the state is then that of time n, the result is false, and a shorter step is to be tried.
struct Refusal {
  bool is_allowed = true;
  /// J, that the last step gained, if that is why it was refused. A shorter one that gains half as much or
  /// more, and little, is taken: what contact gains does not go away with shorter steps.
  double gain = std::numeric_limits<double>::infinity();
};
bool step(World& world, double time, double dt, Refusal* refusal = nullptr);

/// Whether a step has to be asked if it gains energy: implicit ones, and those of rigid bodies in contact.
bool may_gain_energy(const World& world);
/// Kinetic and elastic energy, and these with that of gravity, J.
struct StoredEnergy {
  double moving = 0, all = 0;
};
StoredEnergy energy_now(const World& world);
/// Whether the step that began with `before` has gained more than a scene that nothing drives may, and a
/// shorter one would help. Keeps in `refusal` what it gained.
bool gains_energy(const World& world, const StoredEnergy& before, Refusal& refusal);

void restore_step_start(World& world);
void end_step(World& world);  // w = I^-1 L without the rounding of its increments, so that a state is x, q, v
                              // and L alone

// The longest step that the rule allows at `time` (s), and what bounds it: the settings' largest step, a
// fraction of the elastic stability limit 2/omega_max of the elements as they are now, a quarter of their
// size by which they deform, the turn of a rigid body (or the phase of its sinusoid), or two bodies that can
// meet within the step, kinematic ones by the motion that is ahead of them. Of those, a step brings the ones
// far apart no farther than almost into contact, and near ones no deeper into each other than max_travel of
// the size of the moving and half the thickness of the standing body, so that however fast they are nothing
// passes through.
enum class TimeStepBound { setting, elasticity, stretching, turn, approach };
struct TimeStepChoice {
  double seconds = 0;
  TimeStepBound bound = TimeStepBound::setting;
  int body = -1, other = -1;  // who turns, or meets: rigid bodies, then deformable ones
};
TimeStepChoice bounded_time_step(World& world, double time);
std::string describe(const TimeStepChoice& choice, const Bodies& bodies);  // "the turn of `bar`"
double choose_time_step(World& world, double time);

// The parts of a step that are no stages, for tests that look between stages.
void begin_step(World& world, StepContext& context);  // remembers x^n and v^n
// Runs the stages from the first row of `first` to the last one of `last` that the scene needs, and no check.
void run_stages(World& world, Stage first, Stage last);

// The two contact solves of a step: III, whose velocities move the positions, and V.4.
enum class ContactSolve { halfway, at_end };
// Joints with their control, before contact, which then knows what control does to the bodies that it meets.
void control_joints(World& world, StepContext& context, ContactSolve solve);
// Contact and joints in turn, until contact no longer disturbs the joints.
void solve_contacts(World& world, StepContext& context, ContactSolve solve);

// Contact inside the velocity solves, for the islands that find_solved_islands() finds in step III, and that
// no sweeps over the contacts go through then (sim/step/solved_contact.cpp).
bool may_crush(const Bodies& bodies);  // whether a deformable body is much heavier than a rigid one
void choose_solved_bodies(World& world, StepContext& context);
void add_solved_bodies(const World& world, StepContext& context);  // on the islands of context.solved
void find_solved_islands(World& world, StepContext& context);
bool is_solved(const StepContext& context, const Bodies& bodies, const ContactPair& pair);
// Brings the contacts that have impulses to the poses now, for a projection: as ArticulatedResponse::prepare.
const ArticulatedResponse* link_active_contacts(World& world, StepContext& context);
// Makes context.projection that of the contacts that hold an impulse, and of joints. `rests`: as
// ContactProjection::build.
void project_active_contacts(World& world, StepContext& context, const std::vector<char>& rests = {});

// Gravity and the elastic forces at the positions now, N, in context.force; also in context.explicit_force if
// contact may be part of a solve.
void find_explicit_forces(World& world, StepContext& context);
// While it lives, the particles are at x^{n+1/2}, which is context.x_half; then at x^{n+1} again.
class AtMiddle {
 public:
  explicit AtMiddle(World& world) : world_(world) { world_.bodies.particles.x.swap(world_.context.x_half); }
  ~AtMiddle() { world_.bodies.particles.x.swap(world_.context.x_half); }
  AtMiddle(const AtMiddle&) = delete;
  AtMiddle& operator=(const AtMiddle&) = delete;

 private:
  World& world_;
};
// Takes the places where forces act on bound particles to x^{n+1/2}, where the particles stand, between the
// rigid states of time n and those now.
void bring_bound_to_middle(Bodies& bodies, const std::vector<RigidState>& rigid_n);
// Gives bones the forces (N) on their flesh over `dt` (s), where they act.
void apply_bound_forces(Bodies& bodies, const std::vector<Vec3>& force, double dt);
// What the pressures of the last step change of velocities within `dt` (s), at the positions now.
void add_held_pressures(World& world, StepContext& context, double dt, std::vector<Vec3>& velocity);
// For keep_spin(): counts the velocities now with `sign`. Forces at x^{n+1/2} are what changes velocities
// between a count with -1, which begin_spin() is the first of, and one with 1.
void count_middle_forces(World& world, StepContext& context, double sign);

// The implicit solve of I.1 and V.2: from the velocities v now, fills `context.solution` with V, V = v + dt
// M^-1 (F + F_damping(V)), and `context.force` with F + F_damping(V), where F are gravity and the elastic
// forces. Semi-implicitly F is what find_explicit_forces() has left in `context.force`; implicitly, in I.1
// alone, it is that of x^n + dt V, where the solve leaves the particles.
// `at_end` tells V.2 from I.1.
void solve_velocity(World& world, StepContext& context, double dt, ContactProjection* projection,
                    bool at_end);
// The conjugate gradients of the damping alone, V = b + dt M^-1 F_damping(V): from the V that
// `context.solution` has to that of the b that `context.right_side` has (and loses). Adds F_damping(V) to
// `context.force`. `anew`: with the damped masses of the deformation now, else with those of the last such
// solve. Whether V is finite.
bool solve_with_damping(World& world, StepContext& context, double dt, ContactProjection* projection,
                        bool anew);
// What the V of the implicit solve minimizes where nothing is damped, at `context.solution`, J: 1/2 |V - v -
// dt g|^2 in the mass norm plus the elastic energy at x^n + dt V, where it leaves the particles.
double incremental_potential(World& world, const StepContext& context, double dt);
// A velocity V = b + dt M^-1 F that a solve seeks, from context.right_side b and starting at
// context.solution, for the damping forces F at the last elastic evaluation's deformation, or with elasticity
// for gravity, elastic and damping forces at x^n + dt V, where it leaves the particles; and for the impulses
// of contacts, if any, under constraints that `projection` keeps, if any.
struct VelocityProblem {
  double dt = 0;  // s
  bool is_elastic = false;
  ContactProjection* projection = nullptr;
  ContactForces* contacts = nullptr;
  const Islands* islands = nullptr;  // whose velocities are sought; null: all
};
// The search by Newton's method leaves in `context.imbalance` by how much V falls short of the right side
// under the constraints. Whether that is less than the tolerance, as the bound on its iterations may end it
// before.
bool find_velocity(World& world, StepContext& context, const VelocityProblem& problem);
// Fills context.blocks for a solve of `dt` (s) with the damping, and if so with the elasticity, of the last
// elastic evaluation's deformation.
void find_blocks(World& world, StepContext& context, double dt, bool with_elasticity);
// J, of what the search seeks the least of, at context.solution.
double solve_potential(World& world, StepContext& context, const VelocityProblem& problem);
// Where that was not found: positions move by twice the way to x^n + dt/2 V, the least energy that was found,
// and that far beyond it may be far worse. So deformation stops there, and each body moves on as a whole: as
// it would by itself, or where contact has acted, as V has it. Where contact has acted, V stays if what is
// left of the imbalance is less than what that would take of V: in the measure of kinetic energy the error of
// V is no larger than the imbalance, as long as the energy is convex.
void settle(const World& world, StepContext& context, bool after_contact);

// After a solve with contact over dt (s) without elasticity: the bodies of an island get as a whole, in
// context.solution, the momentum that context.imbalance has left of it, about their positions now.
void return_momentum_to_islands(World& world, StepContext& context, const Islands& islands, double dt);
// The same, in `velocity`, of every deformable body by itself, about the particles' positions x (m), and of
// rigid bodies.
void return_momentum_to_bodies(const World& world, const Islands& islands, const std::vector<Vec3>& x,
                               double dt, GeneralizedVelocity& velocity);
// What pins and mass-proportional damping gave islands in a solve over dt (s) at context.solution beyond what
// they did without contact (context.solved_change), about the origin.
Momentum impulse_of_holders(const World& world, const Islands& islands, double dt);

// Throws SimulationError, which names the stage, if a particle's or a body's state is not finite.
void check_finite(const World& world, std::string_view stage);
void check_finite(const World& world, Stage stage);

}  // namespace duet
