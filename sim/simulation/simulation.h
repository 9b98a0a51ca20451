// Runs a scene: builds its World and advances it frame by frame. The program, the tests and the studies use
// this class; the time step itself is in sim/step/step.cpp.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"
#include "sim/simulation/frame.h"
#include "sim/step/effects.h"
#include "sim/step/stage_hashes.h"

namespace duet {

struct World;

/// A simulation of one scene. It holds the state of one frame, frame 0 at first.
class Simulation {
 public:
  /// Builds the world of `scene` with the effects of `plan` and no others. Throws Error if the world cannot
  /// be built, SimulationError if the initial state is not finite, and SceneError if surfaces of deformable
  /// bodies intersect, or if bodies overlap in a scene with solver.initial_overlap = "refuse".
  Simulation(const scene::Scene& scene, const EffectSet& plan);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Keeps the ledger of momentum and energy from now on, in stats().ledger. This costs time and changes no
  /// result.
  void keep_ledger();

  /// Hands hashes of the state after every stage of every step to `sink` from now on
  /// (sim/step/stage_hashes.h). This costs time and changes no result.
  void hash_stages(StageHashes::Sink sink);

  int frame() const;         ///< Number of the current frame, 0 at first.
  FrameStats stats() const;  ///< Statistics of the current frame. Frame 0 has no substeps.

  /// Returns the pairs of bodies that overlap at frame 0. The first call of advance_frame() begins with
  /// moving them apart.
  const std::vector<InitialOverlap>& initial_overlaps() const;

  /// Returns hashes of the current state for each body and quantity. stats().hash is that of the whole state.
  std::vector<BodyHashes> state_hashes() const;

  /// Makes advance_frame() throw Stopped (sim/base/stop.h) soon after `flag` becomes true. The flag is read
  /// between the stages of a step and in the iterations of its solvers, and has to outlive its use. Null: the
  /// simulation never stops.
  void stop_when(const std::atomic<bool>* flag);

  /// Advances to the next frame. A time step that fails is retried with half its size, down to a floor. If
  /// this fails too, or the flag of stop_when() is set, throws an Error (SimulationError or Stopped) and
  /// restores the state of the last good frame.
  void advance_frame();

  /// Steering, between two frames. Saved states do not hold what these functions change, so that a simulation
  /// that loads one has to be steered again. All throw Error (usage) and change nothing if there is no joint
  /// or body `name`, or a number is not finite.
  ///
  /// Lets the target of the controlled joint `name` go linearly from its present value to `value` over the
  /// next frame, where it stays. `value` is a rotation vector in the joint's frame, rad; hinges read its x
  /// component, and prismatic joints take that as the travel, m.
  void set_target(const std::string& name, const Vec3& value);
  /// Moves the kinematic body `name` over the next frame to `pose` (center of mass and principal axes, as
  /// rigid_motion() returns them), with constant velocity and by the shortest rotation. It stops there unless
  /// it gets another target.
  void set_target(const std::string& name, const Pose& pose);
  /// Adds a force (N) and a moment (N m), both in world axes, on the body `name` during the next frame. A
  /// rigid body takes the force at its center of mass, or at the world position `at` (m). A deformable body
  /// takes it distributed by mass, or on the free particle nearest to `at`, and no moment. Forces on one body
  /// add up. Throws Error if the body is not dynamic.
  void add_force(const std::string& name, const Vec3& force, const Vec3& moment = Vec3::Zero(),
                 const std::optional<Vec3>& at = {});
  /// Lets go of what is called `name` from the next frame on: removes a joint; removes the pins and
  /// attachments of a deformable body; or makes a static or kinematic rigid body dynamic with `density`
  /// (kg/m^3). Positions and velocities stay, and bodies that could not touch before still cannot. It builds
  /// the world anew, which takes as long as the constructor.
  void release(const std::string& name, std::optional<double> density = {});

  /// Fills `out` with the render surfaces in world space: rigid bodies, then deformable bodies, in the order
  /// of the scene. The ground has none. `out` keeps its storage from call to call; topology is constant.
  void surfaces(std::vector<BodySurface>& out) const;
  /// Fills `out` with the render surfaces at rest, m, in the order of surfaces(). Rigid bodies are given in
  /// the axes of their pose. Deformable bodies are given where they are now, so that this function is meant
  /// for frame 0.
  void rest_surfaces(std::vector<BodySurface>& out) const;
  /// Fills `out` with the motion of the rigid bodies, in the order of the scene.
  void rigid_motion(std::vector<RigidMotion>& out) const;
  /// Fills `out` with the velocities (m/s, world axes) of the vertices of the render surfaces of all
  /// deformable bodies, one body after the other.
  void surface_velocities(std::vector<Vec3f>& out) const;
  /// Fills `stress` (Pa) and `energy` (J/m^3) with the von Mises stress and the density of elastic energy at
  /// these vertices, see FiniteElements::measure_stress(); 0 for thin bodies and springs.
  void surface_stress(std::vector<float>& stress, std::vector<float>& energy) const;
  /// Sets `out` to the forces of contact, as means over the time between the frame before and this one. All
  /// are 0 at frame 0 and after load_state(). `surfaces` are surfaces() of this frame.
  void contact_loads(const std::vector<BodySurface>& surfaces, ContactLoads& out) const;
  /// Returns the deepest overlap of a drawn surface that is not the contact surface of its body, with its
  /// triangles subdivided to `spacing` (m); see sim/simulation/drawn_overlap.h. stats() has it with the
  /// spacing that drawn_overlap() chooses.
  std::optional<DeepestOverlap> drawn_overlap(double spacing) const;
  /// Returns the signed distances of the rigid bodies with their current poses, in the order of the scene.
  /// The voxel size follows from the thickness of a body and has a lower bound from the area of its surface;
  /// see exported_voxel_size().
  std::vector<BodyLevelSet> level_sets() const;

  /// Returns everything that the next step reads, as bytes. A simulation of the same scene that loads them
  /// continues bit-identically.
  std::vector<unsigned char> save_state() const;
  /// Restores the state that save_state() returned. Throws Error and keeps the current state if `bytes` do
  /// not fit this scene.
  void load_state(const std::vector<unsigned char>& bytes);

  WorldSizes sizes() const;    ///< Numbers of bodies, particles and elements, for `duet explain`.
  World& world();              ///< The world that the steps read and write.
  const World& world() const;  ///< The world that the steps read and write.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace duet
