// Measures how deep drawn surfaces lie in rigid bodies if these touch another surface: a mesh or a skin that
// is drawn around tetrahedra whose boundary touches.
#pragma once

#include <optional>

#include "sim/simulation/frame.h"

namespace duet {

namespace scene {
struct BuiltWorld;
}

/// Returns the deepest overlap of a drawn surface that is not the contact surface of its deformable body in a
/// rigid body or the ground, at the present positions. Empty if the drawn surfaces of all bodies are their
/// contact surfaces; without an overlap the depth is 0.
///
/// Triangles are subdivided until they are no longer than `spacing` (m); without a value, than half the
/// thickness of the rigid body, but at most 1/2 and at least 1/8 of the mean edge of the body's tetrahedra on
/// their boundary. Pairs that contact excludes, such as flesh and its bones,
/// are left out, as are triangles that no force moves in rigid bodies that none moves.
std::optional<DeepestOverlap> drawn_overlap(const scene::BuiltWorld& built, std::optional<double> spacing);

}  // namespace duet
