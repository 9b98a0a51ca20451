// Shells and rods for scenes that are built in code. Lengths are in m.
#pragma once

#include "tests/support/scenes.h"

namespace duet::test {

// Adds a material with the default values.
inline scene::Material& add_material(scene::Scene& scene, std::string_view name) {
  scene.materials.emplace_back().name = name;
  return scene.materials.back();
}

// Adds a flat panel of `cells` x `cells` cells across y, of the material that was added last.
inline scene::DeformableBody& add_panel(scene::Scene& scene, std::string_view name, const Vec3& position,
                                        const Vec2& size, int cells, double thickness) {
  scene::DeformableBody& body = scene.deformable.emplace_back();
  body.name = name;
  body.shape.kind = scene::DeformableKind::panel;
  body.shape.panel_size = size;
  body.shape.panel_cells.setConstant(cells);
  body.thickness = thickness;
  body.placement.position = position;
  body.material = scene.materials.back().name;
  return body;
}

// Adds a rod through `points` in `segments` segments, of the material that was added last.
inline scene::DeformableBody& add_rope(scene::Scene& scene, std::string_view name,
                                       const std::vector<Vec3>& points, int segments, double thickness) {
  scene::DeformableBody& body = scene.deformable.emplace_back();
  body.name = name;
  body.shape.kind = scene::DeformableKind::rod;
  body.shape.points = points;
  body.shape.segments = segments;
  body.thickness = thickness;
  body.material = scene.materials.back().name;
  return body;
}

}  // namespace duet::test
