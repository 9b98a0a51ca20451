// Describes the deformable bodies of a scene at rest, in their own coordinates, and the forces that hold them
// together.
#pragma once

#include <vector>

#include "sim/geometry/mesh/sheets.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Returns the nodes (m) and triangles of a shell at rest.
Sheet rest_sheet(const DeformableShape& shape);
/// Returns the nodes (m) of a rod at rest.
Curve rest_curve(const DeformableShape& shape);
/// Returns the nodes (m) of any deformable body at rest. Throws as TetMeshes::of() does.
std::vector<Vec3> rest_nodes(const DeformableBody& body);

/// Returns the distance (m) of the point `x` (m, shape's coordinates) from the segment of the pin.
double distance(const Pin& pin, const Vec3& x);

/// Returns the material that the body names. The scene must have it.
const Material& material_of(const Scene& scene, const DeformableBody& body);

/// The kinds of forces that resist the deformation of a body.
struct Resistance {
  bool elements = false;  ///< Finite elements, by Effect::deformable_elasticity.
  bool springs = false;   ///< Springs, by Effect::springs; also the elements of rods.
  bool bending = false;   ///< Bending elements or springs, by Effect::bending.
};
/// Returns the kinds of forces that resist the deformation of a body with this shape and material.
Resistance resistance(const DeformableShape& shape, const Material& material);

}  // namespace duet::scene
