// The impulses that contact gives to each particle and each rigid body in a frame, for output.
#pragma once

#include <vector>

#include "sim/contact/detection/contact_point.h"
#include "sim/deformable/contact_impulses.h"
#include "sim/step/stages.h"

namespace duet {

struct World;
struct StepContext;

/// Impulses of contact on all particles and rigid bodies.
struct ContactSums {
  ContactImpulses particle;  ///< on particles
  std::vector<Vec3> linear,  ///< N s, on each rigid body, world axes
      angular;               ///< N m s, about the center of mass of each rigid body, world axes

  /// Sets all impulses on as many particles and rigid bodies as `bodies` has to zero.
  void reset(const Bodies& bodies);
  /// Adds all impulses of `other`, which has as many particles and rigid bodies.
  void add(const ContactSums& other);
  /// Returns whether there is an entry for each particle and each rigid body.
  bool fits(const Bodies& bodies) const {
    return particle.total.size() == bodies.particles.size() && linear.size() == bodies.rigid.size();
  }
};

/// Adds up the impulses of contact that the velocities v^{n+1} of a step contain, over the steps of a frame.
///
/// These are the impulses of collisions (II.1), self-collisions (IV), contact at the end of the step (V.4, or
/// its solve in V.3), repulsions (V.4), and those by which contact answers the pressures of incompressible
/// bodies and damping after contact. Impulses of half steps, which the step drops, do not count. The tally
/// never changes a result.
class ContactTally {
 public:
  /// Forgets all impulses, at the start of a frame.
  void begin_frame() { has_steps_ = false; }
  /// Forgets the impulses of the last step, which may have failed.
  void begin_step(const Bodies& bodies) { step_.reset(bodies); }
  /// Adds the impulses that a stage gave.
  void end_stage(const World& world, Stage stage);
  /// Adds the impulses of the step to those of the frame.
  void end_step(const Bodies& bodies);

  /// Returns the impulses of the step at hand.
  const ContactSums& of_step() const { return step_; }
  /// Returns the impulses on the particles in the step at hand, for stages that add theirs by themselves.
  ContactImpulses& on_particles() { return step_.particle; }
  /// Returns whether of_frame() has the impulses of a step on these bodies.
  bool knows(const Bodies& bodies) const { return has_steps_ && frame_.fits(bodies); }
  /// Returns the impulses of the frame so far. They mean nothing unless knows() returns true.
  const ContactSums& of_frame() const { return frame_; }

 private:
  // Which pairs of bodies count.
  enum class Pairs { all, active };
  // Adds the impulses that the contacts of these pairs hold.
  void add_contacts(const Bodies& bodies, const ContactSet& contacts, const std::vector<int>& pairs,
                    Pairs which);
  void add_self_collisions(const World& world);
  // Adds the impulses by which the projection of pressures differs from the pressures alone.
  void add_answer_to_pressures(const World& world);
  // Adds the impulses by which the projection of damping differs from the damping forces alone.
  void add_answer_to_damping(const World& world);

  ContactSums step_, frame_;
  bool has_steps_ = false;          // true if frame_ has the impulses of a step
  GeneralizedVelocity alone_;       // scratch: m/s and rad/s, velocities that pressures alone give
  std::vector<Vec3> held_impulse_;  // scratch of pressure_change()
};

}  // namespace duet
