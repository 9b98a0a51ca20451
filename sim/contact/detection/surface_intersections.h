// Whether the surfaces of deformable bodies are free of intersections: what self-collisions keep, and count
// on.
#pragma once

#include <string>
#include <vector>

#include "sim/state/bodies.h"

namespace duet {

// The pairs of triangles of bodies.collision_surface that meet, decided exactly, though their bodies collide
// with each other or themselves. Triangles that share a vertex are not looked at.
std::vector<std::array<int, 2>> self_intersections(const Bodies& bodies);

// Throws SimulationError if surfaces meet, or are so near to each other (1e-6 of their thickness) that
// rounding leaves no side to keep them on.
void check_surfaces_apart(const Bodies& bodies);

// The deformable body that a particle belongs to.
std::size_t body_of(const Bodies& bodies, int particle);
const std::string& body_name(const Bodies& bodies, int particle);

}  // namespace duet
