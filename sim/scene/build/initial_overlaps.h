// Finds the bodies that overlap at the start of a scene, how deep they do, and by how much each body is moved
// as a whole to part them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/base/types.h"

namespace duet {

struct Surface;
struct World;

/// Two bodies that overlap at the start.
struct InitialOverlap {
  std::string first,  ///< Name of one body.
      second;         ///< Name of the other one.
  double depth = 0;   ///< Depth of the deepest point of either surface in the other body, m; 0: they touch.
  Vec3 place = Vec3::Zero();        ///< That point, m, world space.
  Vec3 first_moves = Vec3::Zero(),  ///< Displacement of the first body that parts all that overlaps, m.
      second_moves = Vec3::Zero();  ///< Displacement of the second body, m.
  double left = 0;                  ///< Depth that remains after the displacements, m.
  bool is_pinned_inside = false;    ///< Whether particles of the second body are pinned inside the first one.
};

/// The displacements by which the first frame begins. Every body is moved as a whole, which changes neither
/// elastic energy nor velocities.
struct InitialSeparation {
  std::vector<InitialOverlap> overlaps;   ///< All pairs that overlap.
  std::vector<std::pair<int, int>> left;  ///< Rigid and deformable bodies that overlap afterwards, sorted.
  std::vector<Vec3> rigid,                ///< Displacement of every rigid body, m; zero for bodies that stay.
      deformable;                         ///< Displacement of every deformable body, m.
  bool moves() const;                     ///< Returns whether any displacement is not zero.
};

/// Finds all pairs that overlap and the displacements u (m) that part them:
///   minimize sum m |u|^2 / 2 subject to n . (u_b - u_a) >= t for every pair (a, b),
/// where t n is the shortest displacement found that takes b out of a. The problem is set up and solved again
/// at the new positions as long as that lessens the overlaps of the bodies that they connect. Only pairs are
/// considered that contact would part and that overlap by more than rounding, see
/// OverlapProbe::min_depth(). Bodies that joints or attachments hold together move together. Bodies that a
/// static or kinematic body or a pin holds stay. Overlaps of deformable bodies that only far longer
/// displacements would open are left, see shortest_exit(). `rigid_surfaces` are the drawn surfaces of the
/// rigid bodies in shape space.
InitialSeparation separate_overlapping_bodies(const World& world, std::vector<const Surface*> rigid_surfaces);

/// Moves the bodies of the world, and the particles that they carry, by the displacements.
void apply(const InitialSeparation& parting, World& world);

/// Returns the overlap as text: "`ball` and `block` overlap by 0.6 m at (0, 0.4, 0)".
std::string describe(const InitialOverlap& overlap);
/// Returns the text of describe(), followed by the displacements and by what they leave of the depth.
std::string describe_separation(const InitialOverlap& overlap);

}  // namespace duet
