// All that the simulator needs of a rigid body's shape, in body space: about the centre of mass, along the
// principal axes.
#pragma once

#include <optional>
#include <vector>

#include "sim/geometry/level_set/feature_edges.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

struct Solid {
  LevelSet level_set;
  double volume = 0;                 // m^3
  Vec3 unit_inertia = Vec3::Zero();  // m^2, principal moments per unit mass
  Pose frame;                 // body space in the shape's own coordinates; other than identity for meshes
  std::vector<Vec3> samples;  // m, tested against other bodies' level sets
  std::vector<Vec3> inside;   // m, see points_inside
  std::vector<char> on_flat;  // see on_flat_faces
  FeatureEdges ridges;
  Surface surface;  // as it is drawn
};

// `sample_spacing` in m; without one, default_sample_spacing. `detail` of the drawn surface: see
// shape_surface.
Solid make_solid(const LevelSet& shape, std::optional<double> sample_spacing = {}, double detail = 1);

// Of a mesh that repair() finds no flaw in, scaled about the origin of its coordinates; `cells` of the level
// set along its longest extent.
Solid make_solid(const TriangleMesh& mesh, double scale, int cells,
                 std::optional<double> sample_spacing = {});

}  // namespace duet
