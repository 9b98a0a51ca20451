// Skins of volumes: drawn surfaces that tetrahedra carry, their sizes and masses.
#pragma once

#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/scene/build/build_world.h"

namespace duet::scene {

/// Returns the drawn surface of a body with a skin, bound to the tetrahedra of `mesh` that carry it, whose
/// first node is the particle `first_particle`. Throws Error (usage) if the scene was read without its
/// meshes.
BodyShape skinned(const scene::DeformableBody& description, const TetMesh& mesh, std::size_t first_particle);

/// Checks that contact can act on the vertices of a skin that other bodies touch: an impulse on a vertex
/// moves the particles of its tetrahedron.
///
/// Particles that a dynamic rigid body (a bone) carries take no impulses. Vertices inside of a bone that
/// carries all of their particles need none, because the bone touches there. Throws SceneError that counts
/// the others whose tetrahedra have such particles. The particles of the body must have been added to
/// `bodies` and bound.
void check_skin_contact(const Scene& scene, const scene::DeformableBody& description, const BodyShape& skin,
                        const Bodies& bodies);

/// Measures how far the vertices of the skin lie from the boundary of the tetrahedra (m), both at rest.
SkinSize measure_skin(const BodyShape& skin, const TetMesh& mesh, const std::vector<Triangle>& boundary);

/// Adds the size of a skin to the list, or counts it as one more body if an equal size is there.
void add_skin_size(const SkinSize& size, std::vector<SkinSize>& sizes);

/// Adds the mass of a skin to the masses (kg) of the nodes that carry it. Total mass and center of mass are
/// kept. Throws Error (usage) if the skin reaches so far out of the tetrahedra that a node's mass would not
/// be positive.
void add_skin_mass(const scene::DeformableBody& description, const BodyShape& skin,
                   std::vector<double>& masses);

}  // namespace duet::scene
