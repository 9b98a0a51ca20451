// Accuracy and bounds of a simulation, as a scene file gives them.
#pragma once

#include "sim/contact/push_out/push_out_order.h"
#include "sim/rigid/orientation_update.h"

namespace duet::scene {

/// Presets of the solver's keys; see preset().
enum class Accuracy {
  draft,     ///< Fast: longer steps, fewer iterations, looser tolerances.
  standard,  ///< The default.
  fine       ///< Slow: shorter steps, more iterations, tighter tolerances.
};

/// Interpenetration resolution between rigid bodies in step IV.2.
enum class RigidPushOut {
  all_contacts,   ///< All contacts at once, without friction (sim/contact/push_out/rigid_separation.h).
  deepest_points  ///< Equations 1 and 2 of the paper (section 6.1).
};

/// A setting that may be left to the program.
enum class Switch {
  automatic,  ///< The effect plan decides.
  on,         ///< On if the scene has bodies that it can act on.
  off         ///< Off.
};

/// Time integration of the elastic forces. Damping is always implicit.
enum class Integration {
  semi_implicit,  ///< Elastic forces are explicit, so that stiffness bounds the time step.
  implicit        ///< Elastic forces are implicit, solved by Newton's method.
};

/// Treatment of elements that compression makes stiffer than any is at rest.
enum class Compression {
  damped,   ///< They are damped more and do not shorten the time step.
  followed  ///< They shorten the time step.
};

/// Order of contact and friction and of the implicit solve in step V.
enum class VelocityConstraints {
  after_solve,  ///< Contact and friction come after the solve (paper section 2).
  before_solve  ///< They come before it (paper section 7.2); meant for very large piles.
};
using duet::OrientationUpdate;

/// Treatment of bodies that overlap at frame 0.
enum class OverlapPolicy {
  part,   ///< The first step begins with moving them apart as wholes.
  refuse  ///< The scene is refused with a SceneError.
};

/// Accuracy and bounds of the simulation. Defaults are those of Accuracy::standard; preset() gives the
/// others. A key in the file overrides the preset.
struct Solver {
  Accuracy accuracy = Accuracy::standard;                ///< Preset that the other members start from.
  Integration integration = Integration::semi_implicit;  ///< Integration of the elastic forces.
  int newton_iterations = 20;  ///< Largest number of Newton iterations of an implicit solve.
  double cfl = 0.7;            ///< Time step as a fraction of the elastic stability limit.
  Compression compression = Compression::damped;  ///< Treatment of elements that compression stiffens.
  /// Lower bound on the elastic limit over the damping time tau of materials that damp for tau: their limit
  /// is at least relaxation * tau. 1, in [0, 0.25]; 0: damping never raises the limit.
  double relaxation = 0;
  /// Largest depth by which bodies that meet may enter each other in a step, as a fraction of a moving body's
  /// thickness, 1. Larger values make steps longer and contact less exact.
  double max_travel = 0.1;
  double max_rotation = 0.314159;   ///< Largest rotation of a rigid body in a step, rad.
  double max_time_step = 1.0 / 48;  ///< Largest time step, s.
  /// Fraction of a semi-implicit step at which the damping forces are evaluated, 1, in [0.5, 1]. 0.5 is the
  /// trapezoidal rule of the paper, which reverses strongly damped motion in every step: soft surfaces that
  /// touch chatter. 0.75 reverses a third of such motion at most.
  double damping_at = 0.75;
  /// Largest residual velocity of the conjugate gradients, m/s. In implicit steps of scenes with deformable
  /// bodies of a diameter L below 1 m it is multiplied by the square root of L / 1 m.
  double cg_tolerance = 1e-3;
  int cg_iterations = 1000;      ///< Largest number of conjugate-gradient iterations of a solve.
  int collision_iterations = 5;  ///< Gauss-Seidel sweeps over the collisions of step II.
  int contact_iterations = 20;   ///< Gauss-Seidel sweeps over the contacts of steps III and V.4.
  /// True if small rigid islands are solved directly where sweeps leave an error.
  bool whole_islands = true;
  int max_substeps = 100'000;  ///< Largest number of steps of a frame; beyond it the simulation stops.
  /// Largest relative error of the volume around a particle of an incompressible body after a step, 1.
  double volume_tolerance = 1e-4;
  int pressure_iterations = 100;  ///< Largest number of iterations of the pressure solves of I.2 and V.1.
  int push_out_iterations = 4;    ///< Number of times that step IV.2 finds and resolves overlaps.
  int push_out_sweeps = 10;  ///< Largest number of sweeps over the central bodies for one set of overlaps.
  /// True if the first half of `push_out_iterations` removes a growing fraction of every overlap.
  bool push_out_gradual = true;
  PushOutOrder push_out_order = PushOutOrder::together;      ///< Order of the central bodies of step IV.2.
  RigidPushOut rigid_push_out = RigidPushOut::all_contacts;  ///< Step IV.2 between rigid bodies.
  bool deformable_collision = true;  ///< True if deformable bodies collide with each other and themselves.
  Switch shock_propagation = Switch::automatic;  ///< Shock propagation after the contact sweeps.
  /// Order of contact and solve in step V.
  VelocityConstraints velocity_constraints = VelocityConstraints::after_solve;
  /// Forward and backward sweeps of the contact projection in the conjugate gradients.
  int projection_iterations = 4;
  /// Order of the lattice of contact points on deformable faces, and on their edges from 2 on. 0: only
  /// vertices are contact points.
  int face_samples = 4;
  /// True if flat rigid faces touch only with the points that carry the load.
  bool contact_reduction = true;
  OrientationUpdate orientation = OrientationUpdate::exact;  ///< Update of the rigid orientations.
  bool keep_spin = true;  ///< True if deformable bodies and bones that nothing touches keep their spin.
  OverlapPolicy initial_overlap = OverlapPolicy::part;  ///< Treatment of bodies that overlap at frame 0.
};

}  // namespace duet::scene
