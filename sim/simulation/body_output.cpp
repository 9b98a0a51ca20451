#include "sim/simulation/body_output.h"

#include <algorithm>
#include <span>
#include <variant>

#include "sim/scene/build/build_world.h"
#include "sim/scene/build/level_set_export.h"

namespace duet {

void write_surfaces(const scene::BuiltWorld& built, const std::vector<float>& particle_strain,
                    std::vector<BodySurface>& out) {
  const Bodies& bodies = built.world.bodies;
  const std::vector<scene::BodyShape>& shapes = built.shapes;
  out.resize(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const BoundarySurface& rest = shapes[i].surface;
    Surface& surface = out[i].surface;
    if (surface.triangles.size() != rest.surface.triangles.size()) surface = rest.surface;
    out[i].name = shapes[i].name;
    if (const std::optional<scene::ThinShape>& thin = shapes[i].thin) {
      const std::span<const Vec3> x(bodies.particles.x.data() + thin->first_particle, thin->particle_count);
      std::visit([&](const auto& thick) { thick.update(x, surface); }, thin->surface);
    } else if (!shapes[i].skin.empty()) {
      shapes[i].skin.update(bodies.particles.x.data() + shapes[i].first_particle, surface);
      shapes[i].skin.interpolate(particle_strain.data() + shapes[i].first_particle, surface.strain);
    } else if (rest.vertex_nodes.empty()) {
      const Pose pose = shape_pose(bodies.rigid, i);
      for (std::size_t k = 0; k < surface.positions.size(); ++k)
        surface.positions[k] = pose.to_world(rest.surface.positions[k]);
      for (std::size_t k = 0; k < surface.normals.size(); ++k)
        surface.normals[k] = (pose.orientation * rest.surface.normals[k].cast<double>()).cast<float>();
    } else {
      for (std::size_t k = 0; k < surface.positions.size(); ++k)
        surface.positions[k] = bodies.particles.x[static_cast<std::size_t>(rest.vertex_nodes[k])];
      update_normals(surface);
      surface.strain.resize(surface.positions.size());
      for (std::size_t k = 0; k < surface.strain.size(); ++k)
        surface.strain[k] = particle_strain[static_cast<std::size_t>(rest.vertex_nodes[k])];
    }
  }
}

namespace {

// Appends the velocities (m/s) of the surface vertices of a thin body to `out`:
//   (surface(x + h v) - surface(x)) / h.
// The surface depends on the positions x (m) of its particles, which have the velocities v (m/s), and on the
// angles between its elements; the error of the difference is of order h. `rest` is a surface with the
// topology of the body.
void add_thin_velocities(const scene::ThinShape& thin, Surface rest, std::span<const Vec3> x,
                         std::span<const Vec3> v, std::vector<Vec3f>& out) {
  // Step of the difference, s. The rounding of positions x, 1e-16 |x|, becomes 1e-11 |x| per second, and the
  // truncation error is of order h, so that the result keeps some six digits, about as many as its floats. A
  // larger value raises the truncation error, a smaller one the rounding error.
  constexpr double h = 1e-5;
  std::vector<Vec3> later(x.begin(), x.end());
  for (std::size_t i = 0; i < later.size(); ++i) later[i] += h * v[i];
  std::visit([&](const auto& thick) { thick.update(x, rest); }, thin.surface);
  Surface moved = rest;
  std::visit([&](const auto& thick) { thick.update(std::span<const Vec3>(later), moved); }, thin.surface);
  for (std::size_t k = 0; k < rest.positions.size(); ++k)
    out.push_back(((moved.positions[k] - rest.positions[k]) / h).cast<float>());
}

}  // namespace

void write_surface_velocities(const scene::BuiltWorld& built, std::size_t rigid_count,
                              std::vector<Vec3f>& out) {
  const Bodies& bodies = built.world.bodies;
  const std::vector<scene::BodyShape>& shapes = built.shapes;
  const std::vector<Vec3>& v = bodies.particles.v;
  out.clear();
  for (std::size_t i = rigid_count; i < shapes.size(); ++i) {
    const scene::BodyShape& shape = shapes[i];
    if (shape.thin) {
      const auto of_body = [&](const std::vector<Vec3>& all) {
        return std::span<const Vec3>(all.data() + shape.thin->first_particle, shape.thin->particle_count);
      };
      add_thin_velocities(*shape.thin, shape.surface.surface, of_body(bodies.particles.x), of_body(v), out);
    } else if (!shape.skin.empty()) {
      for (const CarriedSurface::Carrier& carrier : shape.skin.carriers()) {
        Vec3 sum = Vec3::Zero();
        for (std::size_t k = 0; k < 4; ++k)
          sum += carrier.weights[k] * v[as_index(shape.first_particle) + as_index(carrier.nodes[k])];
        out.push_back(sum.cast<float>());
      }
    } else {
      for (const int node : shape.surface.vertex_nodes) out.push_back(v[as_index(node)].cast<float>());
    }
  }
}

void write_surface_values(const scene::BuiltWorld& built, std::size_t rigid_count,
                          const std::vector<float>& of_particles, std::vector<float>& out) {
  out.clear();
  std::vector<float> of_skin;
  for (std::size_t i = rigid_count; i < built.shapes.size(); ++i) {
    const scene::BodyShape& shape = built.shapes[i];
    if (shape.thin) {
      out.insert(out.end(), shape.surface.surface.positions.size(), 0.0F);
    } else if (!shape.skin.empty()) {
      shape.skin.interpolate(of_particles.data() + shape.first_particle, of_skin);
      out.insert(out.end(), of_skin.begin(), of_skin.end());
    } else {
      for (const int node : shape.surface.vertex_nodes) out.push_back(of_particles[as_index(node)]);
    }
  }
}

std::vector<BodyLevelSet> level_sets_of(const RigidBodies& rigid, std::size_t count) {
  std::vector<BodyLevelSet> sets;
  std::vector<int> distinct;
  for (std::size_t i = 0; i < count; ++i) {
    const LevelSet shape = rigid.properties[i].shape;
    BodyLevelSet set;
    set.name = rigid.name[i];
    set.distance = [shape](const Vec3& x) { return shape.distance(x); };
    set.lower = shape.lower();
    set.upper = shape.upper();
    set.voxel_size = exported_voxel_size(shape);
    set.pose = shape_pose(rigid, i);
    set.is_static = !rigid.properties[i].moves();
    const auto same = std::find_if(distinct.begin(), distinct.end(), [&](int k) {
      return rigid.properties[static_cast<std::size_t>(k)].shape == shape;
    });
    if (same != distinct.end())
      set.same_as = *same;
    else
      distinct.push_back(static_cast<int>(i));
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace duet
