// What the deformable bodies of a scene are at rest, in their own coordinates, and what holds them together.
#pragma once

#include <vector>

#include "sim/geometry/mesh/sheets.h"
#include "sim/scene/scene.h"

namespace duet::scene {

Sheet rest_sheet(const DeformableShape& shape);  // of a shell
Curve rest_curve(const DeformableShape& shape);  // of a rod
// Of any body; throws what TetMeshes does.
std::vector<Vec3> rest_nodes(const DeformableBody& body);

double distance(const Pin& pin, const Vec3& x);  // m

const Material& material_of(const Scene& scene, const DeformableBody& body);

// The effects that resist the deformation of a body.
struct Resistance {
  bool elements = false;  // Effect::deformable_elasticity
  bool springs = false;
  bool bending = false;
};
Resistance resistance(const DeformableShape& shape, const Material& material);

}  // namespace duet::scene
