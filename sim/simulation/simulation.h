// A scene in motion: builds the World of a scene and advances it frame by frame. What the program, the tests
// and the studies use; the time step itself is sim/step/step.cpp.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"
#include "sim/simulation/frame.h"
#include "sim/step/effects.h"
#include "sim/step/stage_hashes.h"

namespace duet {

struct World;

class Simulation {
 public:
  // Effects in `plan` are simulated, no others. Throws SimulationError if the initial state cannot be
  // simulated, and SceneError where bodies overlap that solver.initial_overlap refuses.
  Simulation(const scene::Scene& scene, const EffectSet& plan);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  // Keeps the ledger of momentum and energy from now on: stats().ledger. Costs time, changes no result.
  void keep_ledger();

  /// Hands hashes of the state after every stage of every step to `sink` from now on
  /// (sim/step/stage_hashes.h). Costs time, changes no result.
  void hash_stages(StageHashes::Sink sink);

  int frame() const;         // of the state now held; 0 at first
  FrameStats stats() const;  // of the frame now held (frame 0: no substeps)

  /// The pairs of bodies that overlap at frame 0. Advancing from there begins with parting them.
  const std::vector<InitialOverlap>& initial_overlaps() const;

  /// Hashes of the state now held, for each body and quantity; stats().hash is that of the whole state.
  std::vector<BodyHashes> state_hashes() const;

  /// From now on advance_frame() gives up its frame soon after `flag` becomes true: it is looked at between
  /// the stages of a step and in the iterations of its solvers. Null: never. The flag has to outlive its use.
  void stop_when(const std::atomic<bool>* flag);

  // Advances to the next frame. On an Error, be it a SimulationError or Stopped (sim/base/stop.h), the state
  // of the last good frame is restored. A time step that fails is retried with half its size down to a floor
  // before that.
  void advance_frame();

  // The bodies' render surfaces in world space, in the order rigid bodies, deformable bodies of the scene
  // (the ground has none). `out` keeps its storage from call to call; topology is constant.
  void surfaces(std::vector<BodySurface>& out) const;
  /// The same at rest, m: rigid bodies in the axes of their pose, deformable bodies where they are at frame
  /// 0, if the simulation has not moved yet.
  void rest_surfaces(std::vector<BodySurface>& out) const;
  /// Of the rigid bodies, in the scene's order.
  void rigid_motion(std::vector<RigidMotion>& out) const;
  /// Of the positions of the render surfaces of all deformable bodies, one body after the other, m/s.
  void surface_velocities(std::vector<Vec3f>& out) const;
  // The signed distances of the rigid bodies, with their poses now. The size of the voxels follows the
  // thickness of a body, and is bounded from below by the area of its surface.
  std::vector<BodyLevelSet> level_sets() const;

  // Everything the next step reads, as bytes; a simulation of the same scene that loads them continues
  // bit-identically. load_state throws Error when the bytes do not fit this scene.
  std::vector<unsigned char> save_state() const;
  void load_state(const std::vector<unsigned char>& bytes);

  WorldSizes sizes() const;
  World& world();
  const World& world() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace duet
