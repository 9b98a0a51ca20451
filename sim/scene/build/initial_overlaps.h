// Bodies that overlap at the start of a scene: which ones, how deep, and by how much each of them is moved as
// a whole to part them.
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
  std::string first, second;
  double depth = 0;           ///< m, of the deepest place of either surface in the other body; 0: they touch
  Vec3 place = Vec3::Zero();  ///< m, where that is
  Vec3 first_moves = Vec3::Zero(), second_moves = Vec3::Zero();  ///< m, to part all that overlaps
  double left = 0;                                               ///< m, what these leave of the depth
};

/// How the first frame begins: every body as a whole is moved by its displacement, which changes neither
/// elastic energy nor velocities.
struct Parting {
  std::vector<InitialOverlap> overlaps;
  std::vector<std::pair<int, int>> left;  ///< rigid and deformable bodies that still overlap then, sorted
  std::vector<Vec3> rigid, deformable;    ///< m, displacement of every body; all zero where nothing overlaps
  bool moves() const;
};

/// Finds all pairs that contact would part and that overlap by more than rounding (1e-4 of the thinner body),
/// and the displacements u that part them. These minimize sum m |u|^2 / 2 under n . (u_b - u_a) >= t for
/// every pair, where t n is the shortest way found that takes b out of a: repeated at the new places as long
/// as that lessens the overlaps of the bodies that are connected by them. Bodies that joints or attachments
/// hold together move together; what a static or kinematic body or a pin holds stays.
Parting part_bodies(const World& world, std::vector<const Surface*> rigid_surfaces);

/// Moves the bodies of the world by the displacements.
void apply(const Parting& parting, World& world);

/// "`ball` and `block` overlap by 0.6 m at (0, 0.4, 0)"
std::string describe(const InitialOverlap& overlap);
/// The same, and what the first step does about it.
std::string describe_parting(const InitialOverlap& overlap);

}  // namespace duet
