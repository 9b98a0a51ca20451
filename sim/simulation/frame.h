// What one frame of a run consists of: the contract between the simulator, the writers and the renderer.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

struct BodySurface {
  std::string name;  // of the body in the scene; "ground" is not written as a mesh
  Surface surface;   // in world space
};

/// Where a rigid body is at a frame, and how it moves.
struct RigidMotion {
  Pose pose;                             ///< center of mass and principal axes
  Vec3 velocity = Vec3::Zero();          ///< m/s, of the center of mass
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, world axes
};

// A body's signed distance, sampled once in body space and placed by a pose every frame.
struct BodyLevelSet {
  std::string name;
  std::function<double(const Vec3&)> distance;  // m, body space, negative inside
  Vec3 lower, upper;                            // m, bounds of the surface in body space
  double voxel_size = 0.05;                     // m
  Pose pose;
  int same_as = -1;  // index of an earlier body with the same distance and voxels, which are then shared
  bool is_static = false;  // the pose never changes
};

struct StageStats {
  std::string name;  // "I.1 advance velocity"
  double seconds = 0;
  std::int64_t calls = 0;
};

// What a stage, or the whole step, did to the momentum and energy of all bodies in a frame: sums over the
// steps, about the origin; see sim/contact/response/ledger.h.
struct LedgerStats {
  std::string name;                                                // of the stage; "step": the whole
  Vec3 momentum = Vec3::Zero(), external_momentum = Vec3::Zero();  // kg m/s
  Vec3 angular_momentum = Vec3::Zero(), external_angular_momentum = Vec3::Zero();  // kg m^2/s
  double momentum_defect = 0, angular_momentum_defect = 0;                         // the largest of any step
  double kinetic = 0, stored = 0;                                                  // J
};

// A thin deformable body that was pinched in a frame, see sim/contact/push_out/pinching.h.
struct PinchStats {
  std::string body, first, second;  // it, and the two that leave less room than it is thick
  double thickness = 0;             // m
  double room = 0;                  // m, the least in the frame; negative where the two overlap
  double time = 0;                  // s, of the first step with too little
};

// One line of stats.jsonl.
struct FrameStats {
  int frame = 0;
  double time = 0;  // s, simulated
  int substeps = 0;
  double dt_min = 0, dt_max = 0;           // s
  double seconds = 0;                      // s, wall time of simulating the frame (no file output)
  double processor_seconds = 0;            // s, of all threads for it
  std::vector<StageStats> stages;          // every stage and effect of the program, 0 calls where not entered
  std::int64_t cg_iterations = 0;          // sum over the frame
  std::int64_t contacts = 0;               // active contact points at the end of the frame
  double max_penetration = 0;              // m, deepest overlap of any pair at the frame's end, >= 0
  std::int64_t pressure_iterations = 0;    // sum over the frame
  double volume_error = 0;                 // largest |V/V_0 - 1| of an incompressible body
  double min_det_F = 1;                    // least determinant of a deformation gradient
  int inverted = 0;                        // elements with det F <= 0
  double max_stretch = 1;                  // largest principal stretch of an element
  std::int64_t self_repulsions = 0;        // pairs of deformable surface elements nearer than their thickness
  std::int64_t self_collisions = 0;        // impulses that kept surfaces from crossing, sum over the frame
  std::int64_t impact_zone_particles = 0;  // that had to move as rigid zones, sum over the frame
  std::optional<std::int64_t> self_intersections;  // pairs of triangles that meet, exactly; with the effect
                                                   // self_collision
  double kinetic = 0, potential = 0, elastic = 0;  // J; potential is that of gravity
  Vec3 momentum = Vec3::Zero();                    // kg m/s
  Vec3 angular_momentum = Vec3::Zero();            // kg m^2/s, about the origin
  std::uint64_t hash = 0;                          // of the whole state
  std::vector<LedgerStats> ledger;                 // empty unless asked for
  std::vector<PinchStats> pinched;                 // empty unless a body was
  double pushed_mass = 0, pushed_moment = 0;       // kg m, kg m^2: the largest net displacement of push-out
};

}  // namespace duet
