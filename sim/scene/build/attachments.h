// Particles of deformable bodies that rigid ones hold.
#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/state/bodies.h"

namespace duet::scene {

// The particle moves with the kinematic body of that name, if the plan lets it move.
void let_carry(const std::string& carrier, int particle, Bodies& bodies);

// Binds the particle to the first of the rigid bodies that it is inside of, whose place in the list of names
// it returns; else their number.
std::size_t attach(const std::vector<std::string>& names, std::size_t particle, Bodies& bodies);

// A body that holds nothing is a mistake in its place: throws Error (usage). `held` are the numbers of
// particles by every body of `attach`.
void check_attached(const DeformableBody& description, const std::vector<int>& held);

// Gives every particle inside of a bone that holds it by springs an anchor, a particle without mass that the
// bone carries, and a tether to it. To be called once, when all deformable bodies have their particles.
void attach_softly(const Scene& scene, Bodies& bodies);

}  // namespace duet::scene
