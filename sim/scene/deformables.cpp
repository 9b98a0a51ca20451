#include "sim/scene/deformables.h"

#include <algorithm>

#include "sim/scene/build/tet_meshes.h"

namespace duet::scene {

Sheet rest_sheet(const DeformableShape& shape) {
  if (shape.kind == DeformableKind::disc) return disc(shape.radius, shape.rings);
  return panel(shape.panel_size, shape.panel_cells.x(), shape.panel_cells.y());
}

Curve rest_curve(const DeformableShape& shape) {
  if (shape.kind == DeformableKind::helix)
    return helix(shape.radius, shape.pitch, shape.turns, shape.segments);
  if (shape.kind == DeformableKind::knot)
    return torus_knot(shape.radius, shape.tube, shape.winding.x(), shape.winding.y(), shape.segments);
  return curve_through(shape.points, shape.segments,
                       shape.is_closed ? CurveEnds::are_joined : CurveEnds::are_apart);
}

std::vector<Vec3> rest_nodes(const DeformableBody& body) {
  if (body.shape.is_particle()) return {Vec3::Zero()};
  if (body.shape.is_volume()) return TetMeshes().of(body).nodes;
  return body.shape.is_shell() ? rest_sheet(body.shape).nodes : rest_curve(body.shape).nodes;
}

double distance(const Pin& pin, const Vec3& x) {
  const Vec3 along = pin.to.value_or(pin.from) - pin.from;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((x - pin.from).dot(along) / squared, 0.0, 1.0) : 0;
  return (pin.from + t * along - x).norm();
}

const Material& material_of(const Scene& scene, const DeformableBody& body) {
  return *std::find_if(scene.materials.begin(), scene.materials.end(),
                       [&](const Material& material) { return material.name == body.material; });
}

Resistance resistance(const DeformableShape& shape, const Material& material) {
  if (shape.is_particle()) return {};
  const bool is_rod = !shape.is_volume() && !shape.is_shell();
  Resistance result;
  result.springs = material.has_springs || is_rod;  // the finite element of a rod is a spring
  result.elements = !result.springs;
  result.bending = !shape.is_volume() && (material.has_bending_springs || material.bending_factor > 0);
  return result;
}

}  // namespace duet::scene
