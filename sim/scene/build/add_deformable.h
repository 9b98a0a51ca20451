// Adds deformable bodies to a world that is being built.
#pragma once

#include <vector>

#include "sim/scene/build/build_world.h"

namespace duet::scene {

// Shells and rods: particles, forces that are in the plan, contact points and what is drawn.
BodyShape add_shell(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                    Bodies& bodies);
BodyShape add_rod(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                  Bodies& bodies);
// A single particle, whose ball touches others.
BodyShape add_particle(const Scene& scene, const DeformableBody& description, Bodies& bodies);

// The particles of a body at the nodes (m, in its own coordinates) with the given masses (kg). Those that a
// pin holds keep their mass for the sums of a run, but no force moves them: their inverse mass is 0, and
// their velocity is 0 or, where the pin belongs to a kinematic body, that body's. Those inside of a rigid
// body that the description attaches them to move with it;
// throws Error (usage) where one of these holds none.
void add_particles(const DeformableBody& description, const EffectSet& plan, const std::vector<Vec3>& nodes,
                   const std::vector<double>& mass, Bodies& bodies);

// Springs on all edges and altitudes of a body's tets (global particle indices).
void add_volume_springs(const std::vector<Tet>& tets, const SpringLaw& law, Bodies& bodies);

// The points at which a body touches others: the nodes of the triangles (indices of the body's own nodes) but
// those that pins hold, and face samples of the lattice order `order`, all of them `reach` (m) above its
// particles.
void add_surface_points(const TetMesh& mesh, const std::vector<Triangle>& triangles, int order, double reach,
                        duet::DeformableBody& body, Bodies& bodies);
// In place of those: the vertices of a skin that the body's tets carry.
void add_surface_points(const CarriedSurface& skin, duet::DeformableBody& body, Bodies& bodies);

}  // namespace duet::scene
