// What the writers of files and the renderer take from a world: surfaces, their velocities and level sets.
#pragma once

#include <vector>

#include "sim/simulation/frame.h"

namespace duet {

struct RigidBodies;
namespace scene {
struct BuiltWorld;
}

/// Writes the drawn surface of every body except the ground to `out`: rigid bodies, then deformable ones.
/// `out` may hold those of an earlier frame, whose memory is reused. `particle_strain` has the strain of
/// every particle, 1.
void write_surfaces(const scene::BuiltWorld& built, const std::vector<float>& particle_strain,
                    std::vector<BodySurface>& out);

/// Writes the velocities (m/s) of the vertices of the deformable surfaces to `out`, body by body. The scene
/// has `rigid_count` rigid bodies without the ground.
void write_surface_velocities(const scene::BuiltWorld& built, std::size_t rigid_count,
                              std::vector<Vec3f>& out);

/// Writes the values of the vertices of the deformable surfaces to `out`, body by body, from those of all
/// particles; 0 for thin bodies. The scene has `rigid_count` rigid bodies without the ground.
void write_surface_values(const scene::BuiltWorld& built, std::size_t rigid_count,
                          const std::vector<float>& of_particles, std::vector<float>& out);

/// Returns the level sets of the first `count` rigid bodies.
std::vector<BodyLevelSet> level_sets_of(const RigidBodies& rigid, std::size_t count);

}  // namespace duet
