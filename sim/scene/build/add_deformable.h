// Adds deformable bodies to a world that is being built.
#pragma once

#include <vector>

#include "sim/scene/build/build_world.h"

namespace duet::scene {

/// Adds a shell: its particles, the forces of it that are in the plan, and its contact points. Returns its
/// drawn surface.
BodyShape add_shell(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                    Bodies& bodies);
/// Adds a rod: its particles, the forces of it that are in the plan, and its contact points. Returns its
/// drawn surface.
BodyShape add_rod(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                  Bodies& bodies);
/// Adds a single particle, which is a contact point with a radius. Returns its drawn surface.
BodyShape add_particle(const Scene& scene, const DeformableBody& description, Bodies& bodies);

/// Adds the particles of a body at `nodes` (m, in the coordinates of its shape) with the masses `mass` (kg).
/// Pinned particles keep their mass for sums over all bodies, but their inverse mass is 0, so that no force
/// moves them; their velocity is 0 or, if the pin names a kinematic body, that body's. If the plan has hard
/// bindings, particles inside a rigid body that `description` attaches them to are bound to it; throws Error
/// (usage) if such a body holds none.
void add_particles(const DeformableBody& description, const EffectSet& plan, const std::vector<Vec3>& nodes,
                   const std::vector<double>& mass, Bodies& bodies);

/// Adds springs on all edges and altitudes of a body's tetrahedra (global particle indices).
void add_volume_springs(const std::vector<Tet>& tets, const SpringLaw& law, Bodies& bodies);

/// Adds the contact points and edges of a body: the nodes of `triangles` (indices of the body's own nodes),
/// and samples on faces and edges of the lattice order `order` (below 2: none), which is raised if rigid
/// bodies are thin. Points touch others at the distance `reach` (m), half the thickness of a shell. Points
/// that depend on particles without mass, which a rigid body carries, are left out.
void add_surface_points(const TetMesh& mesh, const std::vector<Triangle>& triangles, int order, double reach,
                        duet::DeformableBody& body, Bodies& bodies);
/// Adds the vertices of a skin, which the body's tetrahedra carry, as the contact points of a body.
void add_surface_points(const CarriedSurface& skin, duet::DeformableBody& body, Bodies& bodies);

}  // namespace duet::scene
