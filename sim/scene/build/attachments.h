// Binds particles of deformable bodies to the rigid bodies that hold them.
#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/state/bodies.h"

namespace duet::scene {

/// Makes the particle move with the kinematic body named `carrier`. Does nothing if there is no such body, as
/// when the plan leaves out kinematic motion.
void prescribe_particle(const std::string& carrier, int particle, Bodies& bodies);

/// Binds the particle to the first of the rigid bodies `names` that it lies inside of. Returns the index of
/// that name; if it lies inside none, returns the number of names and binds nothing.
std::size_t attach(const std::vector<std::string>& names, std::size_t particle, Bodies& bodies);

/// Throws Error (usage) if a rigid body of `description.attach` holds no particle, which is a mistake in its
/// placement. `held` has the number of particles that each of these bodies holds.
void check_attached(const DeformableBody& description, const std::vector<int>& held);

/// Adds the soft bindings of the scene: every particle inside a bone that holds it by springs gets an anchor,
/// which is a particle without mass that the bone carries, and a zero-length spring to it. Must be called
/// once, after all deformable bodies have their particles. Throws as check_attached() does.
void add_soft_bindings(const Scene& scene, Bodies& bodies);

}  // namespace duet::scene
