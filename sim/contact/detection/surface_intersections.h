// Checks whether the surfaces of deformable bodies are free of intersections. Self-collisions keep them so,
// and rely on it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/state/bodies.h"

namespace duet {

/// Returns the pairs of triangles of Bodies::collision_surface that intersect, decided exactly. Pairs of
/// triangles of one body count only if that body collides with itself. Triangles that share a vertex are not
/// compared.
std::vector<std::array<int, 2>> self_intersections(const Bodies& bodies);

/// Surfaces of deformable bodies that leave contact no side to keep them on.
struct MeetingSurfaces {
  std::size_t first = 0,         ///< Index of a deformable body.
      second = 0;                ///< Index of the other one, or of the same.
  Vec3 position = Vec3::Zero();  ///< m: a place where they meet.
  std::string how;  ///< What they do: "touch", or "touch or intersect in 23 pairs of triangles; ...".
};

/// Finds surfaces of deformable bodies that intersect, or are so near to each other (1e-6 of their thickness)
/// that rounding leaves no side to keep them on. Returns nothing if there are none.
std::optional<MeetingSurfaces> find_meeting_surfaces(const Bodies& bodies);

/// Returns the index of the deformable body that a particle belongs to.
std::size_t body_of(const Bodies& bodies, int particle);
/// Returns the name of the deformable body that a particle belongs to.
const std::string& body_name(const Bodies& bodies, int particle);

}  // namespace duet
