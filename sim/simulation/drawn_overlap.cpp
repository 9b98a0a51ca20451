#include "sim/simulation/drawn_overlap.h"

#include <algorithm>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/contact/detection/body_bounds.h"
#include "sim/scene/build/build_world.h"
#include "sim/simulation/deepest_point.h"

namespace duet {
namespace {

constexpr std::size_t triangles_at_once = 512;  // for each task of the parallel loop

// The drawn surface of one deformable body at the present positions.
struct DrawnSurfaceNow {
  const std::vector<std::array<Corner, 3>>* triangles = nullptr;
  std::vector<Vec3> x;        // m, world: positions of its vertices
  std::vector<char> is_held;  // for each vertex: whether no force moves it
  Eigen::AlignedBox3d box;    // m, world
};

// Returns whether no force moves the particle: it is pinned, or a static or kinematic body carries it.
bool no_force_moves(const Particles& particles, std::size_t p) {
  return is_held(particles, p) && particles.mass[p] > 0;
}

DrawnSurfaceNow place(const scene::BodyShape& shape, const Particles& particles) {
  DrawnSurfaceNow now;
  now.triangles = &shape.surface.surface.triangles;
  const std::size_t count = shape.surface.surface.positions.size();
  now.x.resize(count);
  now.is_held.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (shape.skin.empty()) {
      const std::size_t p = as_index(shape.surface.vertex_nodes[i]);
      now.x[i] = particles.x[p];
      now.is_held[i] = no_force_moves(particles, p);
    } else {
      now.x[i] = shape.skin.position(i, particles.x.data() + shape.first_particle);
      const std::array<int, 4>& nodes = shape.skin.carriers()[i].nodes;
      now.is_held[i] = std::all_of(nodes.begin(), nodes.end(), [&](int node) {
        return no_force_moves(particles, shape.first_particle + as_index(node));
      });
    }
    now.box.extend(now.x[i]);
  }
  return now;
}

// Returns the deepest point of the surface in a host. `host_moves` says whether forces move the host.
DeepestPoint deepest_in(const DepthSearch& host, bool host_moves, const DrawnSurfaceNow& surface) {
  const auto deeper = [](const DeepestPoint& a, const DeepestPoint& b) {
    return b.distance < a.distance ? b : a;
  };
  return parallel_reduce(
      surface.triangles->size(), triangles_at_once, DeepestPoint(),
      [&](std::size_t begin, std::size_t end) {
        DeepestPoint deepest;
        for (std::size_t t = begin; t < end; ++t) {
          const std::array<Corner, 3>& corners = (*surface.triangles)[t];
          const auto vertex = [&](std::size_t k) { return as_index(corners[k].position); };
          if (!host_moves && surface.is_held[vertex(0)] && surface.is_held[vertex(1)] &&
              surface.is_held[vertex(2)])
            continue;
          host.at_triangle(surface.x[vertex(0)], surface.x[vertex(1)], surface.x[vertex(2)], 0, deepest);
        }
        return deepest;
      },
      deeper);
}

// Returns the spacing (m) that finds overlaps of deformable body `d` with rigid body `h`: half the thickness
// of the rigid body, which may lie between the corners of a triangle, but between 1/2 and 1/8 of the
// elements, by which drawn surface and contact surface differ. Smaller ones take more time.
double spacing_for(const Bodies& bodies, std::size_t d, std::size_t h) {
  const double element = bodies.deformable[d].element_size;
  return std::clamp(bodies.rigid.properties[h].shape.min_size() / 2, element / 8, element / 2);
}

}  // namespace

std::optional<DeepestOverlap> drawn_overlap(const scene::BuiltWorld& built, std::optional<double> spacing) {
  const Bodies& bodies = built.world.bodies;
  const std::size_t first = built.shapes.size() - bodies.deformable.size();
  const auto is_apart = [](const scene::BodyShape& shape) { return !shape.is_touched; };
  if (std::none_of(built.shapes.begin(), built.shapes.end(), is_apart)) return std::nullopt;
  DeepestOverlap deepest;
  if (!built.world.contact_filter().rigid_deformable) return deepest;
  std::vector<BodyBounds> bounds;
  bound_bodies(bodies, bounds);
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    const scene::BodyShape& shape = built.shapes[first + d];
    if (shape.is_touched) continue;
    const DrawnSurfaceNow surface = place(shape, bodies.particles);
    for (std::size_t h = 0; h < bodies.rigid.size(); ++h) {
      const int host = static_cast<int>(h);
      if (is_excluded_deformable(bodies, host, static_cast<int>(d)) ||
          (!bounds[h].is_half_space && !world_box(bounds[h], 0).intersects(surface.box)))
        continue;
      const bool host_moves = bodies.rigid.properties[h].is_dynamic() && bodies.push_back;
      const DeepestPoint point =
          deepest_in(DepthSearch(bodies.rigid, bounds[h], host, spacing.value_or(spacing_for(bodies, d, h))),
                     host_moves, surface);
      if (-point.distance > deepest.depth)
        deepest = {-point.distance, shape.name, bodies.rigid.name[h], point.place};
    }
  }
  return deepest;
}

}  // namespace duet
