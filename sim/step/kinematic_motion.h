// Kinematic bodies within a time step. Every stage sees the velocity that belongs to what it does:
//
//   II.1     v^n, the exact velocity of time n: so that what rests on an accelerating body does not bounce
//   II, III  the constant velocity and angular velocity that lead from x^n to x^{n+1} in this step: so that
//            predicted positions, contact at v^{n+1/2} and the pose reached agree. A point of a turning body
//            moves along the chord of its path; the twist leads along the tangent, which would let everything
//            that rides on the body drift outward. The difference is the contact's path velocity.
//   IV       the exact pose of time n+1
//   V.2      the mean of the exact velocities of times n and n+1, as the trapezoidal rule takes it
//   V.4      v^{n+1}, the exact velocity of time n+1, at the contact point
//
// The particles that it carries move from place to place at a constant velocity, which they have in V.2, too,
// and end with their body's, at x^{n+1}.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"

namespace duet {

// One kinematic body's motion over the step.
struct KinematicStep {
  std::size_t body = 0;                       // index of the rigid body
  MotionState end;                            // of time n+1
  Vec3 mean_velocity = Vec3::Zero();          // m/s, from x^n to x^{n+1}
  Vec3 mean_angular_velocity = Vec3::Zero();  // rad/s
  Mat3 path = Mat3::Zero();  // 1/s: (R - 1)/dt - w^*, for the rotation R = exp(dt w^*) of the step
};

// Fills `steps` with the motion of all kinematic bodies from where they are to their places at `end` (s).
void evaluate_motions(const RigidBodies& rigid, double end, double dt, std::vector<KinematicStep>& steps);

// For the particles that kinematic bodies carry, with `steps` as evaluate_motions has filled them: the
// constant velocity that leads from `x_n` (m) to x^{n+1}; the places x^{n+1}; the velocities v^{n+1}.
void carry(const std::vector<KinematicStep>& steps, const std::vector<Vec3>& x_n, double dt, Bodies& bodies);
void place_carried(const std::vector<KinematicStep>& steps, Bodies& bodies);
void end_carrying(const std::vector<KinematicStep>& steps, Bodies& bodies);

// Sets the path velocities of the contacts in `graph`. A rigid partner is taken to turn with the kinematic
// body, which is what it does where friction holds it: its centre then follows the chord.
void set_path_velocities(const Bodies& bodies, const std::vector<KinematicStep>& steps,
                         const ContactGraph& graph, ContactSet& contacts);

}  // namespace duet
