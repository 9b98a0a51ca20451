// The motion of kinematic bodies within a time step. Where the velocity jumps, a step ends (the simulation
// sees to that): v^n is the velocity after a jump at time n, and v^{n+1} the one before a jump at time n+1.
// Every stage sees the velocity that belongs to its work:
//
//   II.1     v^n, the exact velocity of time n, so that a body that rests on an accelerating
//            body does not bounce
//   II, III  the constant velocity and angular velocity that lead from x^n to x^{n+1} in this
//            step, so that predicted positions, contact at v^{n+1/2} and the pose reached agree.
//            A point of a turning body moves along the chord of its path; the twist leads along
//            the tangent, which would let everything that rides on the body drift outward. The
//            difference is the contact's path velocity.
//   IV       the exact pose of time n+1
//   I.1, V.2 the exact velocities of times n and n+1, interpolated to the time at which damping is evaluated
//   V.4      v^{n+1}, the exact velocity of time n+1, at the contact point
//
// The particles that a kinematic body carries move through the step at a constant velocity, which they keep
// in I.1 and V.2. At the end, at x^{n+1}, they have the velocities of their points of the body.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"

namespace duet {

/// The motion of one kinematic body over a step.
struct KinematicStep {
  std::size_t body = 0;                       ///< index of the rigid body
  MotionState end;                            ///< pose and velocities of time n+1
  Vec3 mean_velocity = Vec3::Zero();          ///< m/s, constant velocity from x^n to x^{n+1}
  Vec3 mean_angular_velocity = Vec3::Zero();  ///< rad/s, constant angular velocity from x^n to x^{n+1}
  /// 1/s, the matrix (R - 1)/dt - w^* for the rotation R = exp(dt w^*) of the step.
  ///
  /// It maps an arm from the body's center at time n to the path velocity there: chord less tangent.
  Mat3 path = Mat3::Zero();
};

/// Returns the first time (s) after `time`, by more than `near`, at which the velocity of a kinematic body
/// jumps.
double next_jump(const RigidBodies& rigid, double time, double near);

/// Gives the kinematic bodies, and the particles that they carry, the velocities after a jump at `time` (s).
///
/// A jump that is at most `near` (s) away counts, and what does not jump keeps its velocities.
void take_velocities_after_jumps(double time, double near, Bodies& bodies);

/// Fills `steps` with the motion of all kinematic bodies from their poses now to those at the time `end` (s).
///
/// `steps` gets one entry per RigidBodies::kinematic; `dt` (s) is the length of the step. The velocities at
/// the end are those before a jump that is at most `near` (s) away.
void evaluate_motions(const RigidBodies& rigid, double end, double dt, double near,
                      std::vector<KinematicStep>& steps);

/// Gives the particles that kinematic bodies carry the constant velocity from `x_n` (m) to x^{n+1}.
///
/// `steps` are those of evaluate_motions(); `dt` (s) is the length of the step.
void carry(const std::vector<KinematicStep>& steps, const std::vector<Vec3>& x_n, double dt, Bodies& bodies);
/// Moves the particles that kinematic bodies carry to their positions x^{n+1}.
void place_carried(const std::vector<KinematicStep>& steps, Bodies& bodies);
/// Gives the particles that kinematic bodies carry their velocities v^{n+1}.
void end_carrying(const std::vector<KinematicStep>& steps, Bodies& bodies);

/// Sets ContactPoint::path_velocity of the contacts in `graph` with kinematic bodies, from the chord of the
/// path of the body's point. find_speculative_targets() adds the part of a rigid partner, which turns as
/// well.
void set_path_velocities(const Bodies& bodies, const std::vector<KinematicStep>& steps,
                         const ContactGraph& graph, ContactSet& contacts);

}  // namespace duet
