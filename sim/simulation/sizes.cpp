#include "sim/simulation/sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/scene/build/build_world.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Returns the sizes of the grids of meshes, each one once.
std::vector<GridSize> grid_sizes(const RigidBodies& rigid) {
  std::vector<GridSize> sizes;
  std::vector<const GridLevelSet*> known;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    const GridLevelSet* grid = rigid.properties[i].shape.grid.get();
    if (!grid) continue;
    const auto found = std::find(known.begin(), known.end(), grid);
    if (found == known.end()) {
      known.push_back(grid);
      sizes.push_back({rigid.name[i], 1, grid->grid().count, grid->grid().spacing, grid->thickness()});
    } else {
      ++sizes[static_cast<std::size_t>(found - known.begin())].bodies;
    }
  }
  return sizes;
}

// Returns whether all points (m) lie within `tolerance` (m) of one line.
bool are_on_line(const std::vector<Vec3>& points, double tolerance) {
  Vec3 way = Vec3::Zero();  // from the first point to the one farthest from it
  for (const Vec3& x : points)
    if ((x - points.front()).squaredNorm() > way.squaredNorm()) way = x - points.front();
  if (way.norm() <= tolerance) return true;
  return std::all_of(points.begin(), points.end(), [&](const Vec3& x) {
    return way.cross(x - points.front()).norm() <= tolerance * way.norm();
  });
}

// Returns the bones that hold particles of a flesh on one line only.
std::vector<LooseBone> loose_bones(const Bodies& bodies) {
  constexpr double on_line = 0.1;  // largest distance from the line, relative to the size of the elements
  std::vector<LooseBone> loose;
  for (const DeformableBody& flesh : bodies.deformable)
    for (std::size_t bone = 0; bone < bodies.rigid.size(); ++bone) {
      std::vector<Vec3> held;
      for (const EmbeddedParticle& bound : bodies.bound)
        if (const int p = static_cast<int>(bound.at) - flesh.first_particle;
            bound.body == bone && p >= 0 && p < flesh.particle_count)
          held.push_back(bound.arm);
      if (!held.empty() && are_on_line(held, on_line * flesh.element_size))
        loose.push_back({bodies.rigid.name[bone], flesh.name, static_cast<int>(held.size())});
    }
  return loose;
}

}  // namespace

WorldSizes sizes_of(scene::BuiltWorld& built, const std::vector<InitialOverlap>& overlaps, double time) {
  World& world = built.world;
  const Bodies& bodies = world.bodies;
  WorldSizes sizes;
  for (const StageRow& row : stage_table)
    if (runs(row, world)) sizes.stages.emplace_back(row.label);
  sizes.initial_overlaps = overlaps;
  const TimeStepChoice choice = bounded_time_step(world, time);
  sizes.time_step = choice.seconds;
  sizes.time_step_bound = describe(choice, bodies);
  sizes.lightest = std::numeric_limits<double>::infinity();
  const auto weigh = [&](double mass) {
    sizes.lightest = std::min(sizes.lightest, mass);
    sizes.heaviest = std::max(sizes.heaviest, mass);
  };
  for (const RigidProperties& properties : bodies.rigid.properties) {
    ++(properties.is_dynamic() ? sizes.rigid_dynamic
       : properties.moves()    ? sizes.rigid_kinematic
                               : sizes.rigid_static);
    sizes.rigid_samples += static_cast<int>(properties.samples.size());
    if (properties.is_dynamic()) weigh(properties.mass);
  }
  for (const DeformableBody& body : bodies.deformable) {
    ++sizes.deformable;
    if (body.thickness > 0) ++sizes.thin;
    sizes.surface_triangles += body.triangle_count;
    sizes.face_samples += body.sample_count;
    weigh(body.mass);
  }
  sizes.grids = grid_sizes(bodies.rigid);
  sizes.tet_meshes = built.tet_meshes;
  sizes.skins = built.skins;
  if (!bodies.bound.empty()) sizes.loose_bones = loose_bones(bodies);
  sizes.particles = static_cast<int>(bodies.particles.size());
  sizes.tets = static_cast<int>(bodies.forces.elements.size());
  if (bodies.forces.rest_omega_squared() > 0) {
    sizes.elastic_dt = 2 / std::sqrt(bodies.forces.rest_omega_squared());
    sizes.undamped_elastic_dt = 2 / std::sqrt(bodies.forces.elastic_omega_squared());
  }
  if (!std::isfinite(sizes.lightest)) sizes.lightest = 0;
  return sizes;
}

}  // namespace duet
