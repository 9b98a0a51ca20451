// Checks whether the surfaces of deformable bodies are free of intersections. Self-collisions keep them so,
// and rely on it.
#pragma once

#include <string>
#include <vector>

#include "sim/state/bodies.h"

namespace duet {

/// Returns the pairs of triangles of Bodies::collision_surface that intersect, decided exactly. Pairs of
/// triangles of one body count only if that body collides with itself. Triangles that share a vertex are not
/// compared.
std::vector<std::array<int, 2>> self_intersections(const Bodies& bodies);

/// Throws SimulationError if surfaces of deformable bodies intersect, or if they are so near to each other
/// (1e-6 of their thickness) that rounding leaves no side to keep them on.
void check_surfaces_apart(const Bodies& bodies);

/// Returns the index of the deformable body that a particle belongs to.
std::size_t body_of(const Bodies& bodies, int particle);
/// Returns the name of the deformable body that a particle belongs to.
const std::string& body_name(const Bodies& bodies, int particle);

}  // namespace duet
