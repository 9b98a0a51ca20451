#include "sim/geometry/level_set/solid.h"

#include <utility>

#include "sim/base/assert.h"
#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/geometry/level_set/shape_samples.h"

namespace duet {

Solid make_solid(const LevelSet& shape, std::optional<double> sample_spacing, double detail) {
  Solid solid;
  solid.level_set = shape;
  solid.volume = volume(shape);
  solid.unit_inertia = unit_inertia(shape);
  const double spacing = sample_spacing.value_or(default_sample_spacing(solid.volume));
  solid.samples = surface_samples(shape, spacing);
  solid.inside = points_inside(solid.level_set, solid.samples);
  solid.on_flat = on_flat_faces(solid.level_set, solid.samples);
  solid.feature_edges = find_feature_edges(shape, spacing);
  solid.surface = shape_surface(shape, detail);
  return solid;
}

Solid make_solid(const TriangleMesh& mesh, double scale, int cells, std::optional<double> sample_spacing) {
  DUET_ASSERT(scale > 0);
  const MassProperties mass = mass_properties(in_frame(mesh, scale, Pose{}));
  const TriangleMesh body = in_frame(mesh, scale, mass.frame);
  Solid solid;
  solid.level_set = LevelSet::mesh(std::make_shared<const GridLevelSet>(body, cells));
  solid.volume = mass.volume;
  solid.unit_inertia = mass.unit_inertia;
  solid.frame = mass.frame;
  const double spacing = sample_spacing.value_or(default_sample_spacing(mass.volume));
  const std::vector<MeshSample> samples = mesh_samples(body, spacing);
  for (const MeshSample& sample : samples) solid.samples.push_back(sample.position);
  solid.inside = points_inside(solid.level_set, solid.samples);
  solid.on_flat = on_flat_faces(solid.level_set, solid.samples);
  solid.feature_edges = find_feature_edges(body, solid.level_set, solid.samples, solid.inside, spacing);
  RoundSurface round = find_round_surface(body, samples);
  if (!round.vertices.empty()) {
    round.inside = points_inside(solid.level_set, round.vertices);
    solid.round = std::make_shared<const RoundSurface>(std::move(round));
  }
  solid.surface = mesh_surface(body);
  return solid;
}

}  // namespace duet
