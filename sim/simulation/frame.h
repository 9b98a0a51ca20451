// Defines what one frame of a run consists of: the contract between the simulator, the file writers and the
// renderer.
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

/// The render surface of one body at a frame.
struct BodySurface {
  std::string name;  ///< Name of the body in the scene. The ground has no surface and is not listed.
  Surface surface;   ///< Triangles with positions (m) and normals in world space.
};

/// Position and motion of a rigid body at a frame.
///
/// Of a bone that carries the mass of flesh, the center of mass and the axes are those of the bone alone.
struct RigidMotion {
  Pose pose;                             ///< Center of mass (m) and principal axes, from body to world space.
  Vec3 velocity = Vec3::Zero();          ///< Velocity of the center of mass, m/s, world axes.
  Vec3 angular_velocity = Vec3::Zero();  ///< Angular velocity, rad/s, world axes.
};

/// Forces of contact with other bodies, the ground included: means over the time of a frame, which are the
/// impulses of its steps over its length. Friction is included.
struct ContactLoads {
  std::vector<Vec3> rigid_force,  ///< N, on each rigid body, world axes.
      rigid_torque;               ///< N m, on each rigid body about RigidMotion::pose, world axes.
  std::vector<Vec3f> force;       ///< N, on each vertex of the deformable surfaces, world axes.
  /// Pa, normal forces on each vertex of the deformable surfaces over its third of the triangles around it.
  std::vector<float> pressure;
};

/// The signed distance of a rigid body: a function in shape space that a pose places in the world every
/// frame. Writers sample it once, because only the pose changes.
struct BodyLevelSet {
  std::string name;  ///< Name of the body in the scene.
  /// Signed distance (m) of a shape-space point; negative inside.
  std::function<double(const Vec3&)> distance;
  Vec3 lower,                ///< Lower corner of the bounding box of the surface, m, shape space.
      upper;                 ///< Upper corner of it, m, shape space.
  double voxel_size = 0.05;  ///< Edge of a voxel, m.
  Pose pose;                 ///< From body to world space at this frame.
  /// Index of an earlier body in the list with the same distance and voxels, whose samples can be reused.
  /// -1: none.
  int same_as = -1;
  bool is_static = false;  ///< True if the pose is the same in all frames.
};

/// Time that one stage of the step took in a frame, summed over the steps.
struct StageStats {
  std::string name;        ///< Label of the stage in sim/step/stage_table.h, such as "I.1 advance velocity".
  double seconds = 0;      ///< Wall time, s.
  std::int64_t calls = 0;  ///< Number of times that the stage was entered; 0 if the scene does not need it.
};

/// Change of momentum and energy of all bodies by one stage, or by the whole step, in a frame. Values are
/// sums over the steps, angular momenta are about the origin; sim/contact/response/ledger.h defines them.
struct LedgerStats {
  std::string name;                              ///< Label of the stage; "step" for the whole step.
  Vec3 momentum = Vec3::Zero(),                  ///< Linear momentum gained, kg m/s.
      external_momentum = Vec3::Zero();          ///< Part of it from outside (such as gravity), kg m/s.
  Vec3 angular_momentum = Vec3::Zero(),          ///< Angular momentum gained, kg m^2/s.
      external_angular_momentum = Vec3::Zero();  ///< Part of it from outside, kg m^2/s.
  double momentum_defect = 0,       ///< Largest |gained - external| linear momentum of one step, kg m/s.
      angular_momentum_defect = 0;  ///< Largest |gained - external| angular momentum of one step, kg m^2/s.
  double kinetic = 0,               ///< Kinetic energy gained, J.
      stored = 0;                   ///< Elastic and gravitational energy gained, J.
};

/// A thin deformable body that two other bodies pinched in a frame; see sim/contact/push_out/pinching.h.
struct PinchStats {
  std::string body,      ///< Name of the thin body.
      first,             ///< Name of one of the two rigid bodies that leave less room than it is thick.
      second;            ///< Name of the other one.
  double thickness = 0;  ///< Thickness of the thin body, m.
  double room = 0;       ///< Smallest distance of the two in the frame, m; negative if they overlap.
  double time = 0;       ///< Simulated time at the start of the first step with too little room, s.
};

/// The deepest overlap of one kind of pairs of bodies.
struct DeepestOverlap {
  double depth = 0;           ///< Depth, m; 0: no overlap.
  std::string guest,          ///< Name of the body whose surface lies inside the other; empty: no overlap.
      host;                   ///< Name of the rigid body that it lies in; empty: no overlap.
  Vec3 place = Vec3::Zero();  ///< Deepest point of the guest's surface, m, world space.
};

/// Statistics of one frame: one line of stats.jsonl.
struct FrameStats {
  int frame = 0;                   ///< Number of the frame; 0 is the initial state.
  double time = 0;                 ///< Simulated time, s.
  int substeps = 0;                ///< Number of time steps that led to this frame.
  double dt_min = 0,               ///< Shortest time step of the frame, s.
      dt_max = 0;                  ///< Longest time step of the frame, s.
  double seconds = 0;              ///< Wall time of the simulation of the frame, s, without file output.
  double processor_seconds = 0;    ///< Processor time of all threads for it, s.
  std::vector<StageStats> stages;  ///< All stages of the program in the order of the stage table.
  std::int64_t cg_iterations = 0;  ///< Conjugate-gradient iterations, sum over the frame.
  std::int64_t contacts = 0;       ///< Contacts with a nonzero impulse in the last step of the frame.
  double max_penetration = 0;      ///< Depth of the deepest overlap of any pair at the frame, m, >= 0.
  /// Deepest overlap of a drawn surface that is not the contact surface of its body. Empty if the drawn
  /// surfaces of all bodies are their contact surfaces.
  std::optional<DeepestOverlap> drawn_overlap;
  std::int64_t pressure_iterations = 0;  ///< Iterations of the pressure solves, sum over the frame.
  double volume_error = 0;  ///< Largest |V/V_0 - 1| over the incompressible bodies, each as a whole.
  double min_det_F = 1;     ///< Smallest determinant of the deformation gradient of a tetrahedron.
  int inverted = 0;         ///< Number of tetrahedra with det F <= 0.
  double max_stretch = 1;   ///< Largest principal stretch of a tetrahedron, 1 at rest.
  /// Pairs of deformable surface elements nearer than their thickness in the last step.
  std::int64_t self_repulsions = 0;
  /// Impulses that kept deformable surfaces from crossing, sum over the frame.
  std::int64_t self_collisions = 0;
  /// Particles that had to move in rigid impact zones, sum over the frame.
  std::int64_t impact_zone_particles = 0;
  /// Pairs of triangles of deformable surfaces that intersect, found by an exact test. Empty unless the scene
  /// has the effect `self_collision`.
  std::optional<std::int64_t> self_intersections;
  double kinetic = 0,                    ///< Kinetic energy, J.
      potential = 0,                     ///< Gravitational energy, J, zero at the origin.
      elastic = 0;                       ///< Elastic energy, J.
  Vec3 momentum = Vec3::Zero();          ///< Linear momentum of all bodies, kg m/s.
  Vec3 angular_momentum = Vec3::Zero();  ///< Angular momentum of all bodies about the origin, kg m^2/s.
  std::uint64_t hash = 0;                ///< Hash of the bytes of Simulation::save_state().
  std::vector<LedgerStats> ledger;       ///< Empty unless Simulation::keep_ledger() was called.
  std::vector<PinchStats> pinched;       ///< Empty unless a body was pinched in the frame.
  double max_mass_shift = 0,  ///< Largest |sum m dx| by push-out in a step, kg m; 0 without the ledger.
      max_moment_shift = 0;   ///< Largest |sum m x * dx + I theta| by it, kg m^2; 0 without the ledger.
};

}  // namespace duet
