#include "sim/simulation/overlaps.h"

#include <algorithm>
#include <cmath>

#include "sim/base/parallel.h"
#include "sim/contact/detection/broad_phase.h"
#include "sim/simulation/deepest_point.h"
#include "sim/step/world.h"

namespace duet {
namespace {

// Finds the deepest overlaps of all pairs of bodies whose bounds meet.
class Finder {
 public:
  Finder(const World& world, const std::vector<BodySurface>& surfaces, double spacing)
      : bodies_(world.bodies), surfaces_(surfaces), spacing_(spacing) {
    bound_bodies(bodies_, search_.bounds);
    search_.margin.assign(search_.bounds.size(), 0);
    pairs_ = search_.find(world.contact_filter());
  }

  Overlaps find() const {
    std::vector<Overlaps> found(pairs_.size());
    parallel_for(pairs_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) found[i] = look(pairs_[i]);
    });
    Overlaps deepest;
    for (const Overlaps& one : found) {
      if (one.rigid.depth > deepest.rigid.depth) deepest.rigid = one.rigid;
      if (one.deformable.depth > deepest.deformable.depth) deepest.deformable = one.deformable;
    }
    return deepest;
  }

 private:
  // Returns the deepest overlap of one pair. Two rigid bodies are searched both ways.
  Overlaps look(const BodyPair& pair) const {
    Overlaps found;
    if (pair.guest_rigid < 0) {
      if (!is_excluded_deformable(bodies_, pair.host, pair.guest_deformable)) {
        const DeformableBody& guest = bodies_.deformable[as_index(pair.guest_deformable)];
        const std::size_t number =
            surfaces_.size() - bodies_.deformable.size() + as_index(pair.guest_deformable);
        found.deformable =
            overlap(touches_with_skin(bodies_, guest) ? of_surface(surfaces_[number].surface, pair.host)
                                                      : of_deformable(guest, pair.host),
                    guest.name, pair.host);
      }
    } else if (!is_excluded(bodies_, pair.host, pair.guest_rigid)) {
      const DeepestOverlap one = overlap(of_rigid(pair.guest_rigid, pair.host),
                                         bodies_.rigid.name[as_index(pair.guest_rigid)], pair.host);
      const DeepestOverlap other = overlap(of_rigid(pair.host, pair.guest_rigid),
                                           bodies_.rigid.name[as_index(pair.host)], pair.guest_rigid);
      found.rigid = one.depth < other.depth ? other : one;
    }
    return found;
  }

  DeepestOverlap overlap(const DeepestPoint& deepest, const std::string& guest, int host) const {
    if (!(deepest.distance < 0)) return {};
    return {-deepest.distance, guest, bodies_.rigid.name[as_index(host)], deepest.place};
  }

  DepthSearch host(int body) const { return {bodies_.rigid, search_.bounds[as_index(body)], body, spacing_}; }

  // Returns the deepest point of a rigid guest in the host `body`. The ground has no surface, so it is never
  // a guest.
  DeepestPoint of_rigid(int guest, int body) const {
    if (search_.bounds[as_index(guest)].is_half_space) return {};
    return of_surface(surfaces_[as_index(guest)].surface, body);
  }

  // Returns the deepest point of a drawn surface in the host `body`.
  DeepestPoint of_surface(const Surface& surface, int body) const {
    DeepestPoint deepest;
    const DepthSearch look = host(body);
    const auto x = [&](int vertex) { return surface.positions[as_index(vertex)]; };
    for (const auto& triangle : surface.triangles)
      look.at_triangle(x(triangle[0].position), x(triangle[1].position), x(triangle[2].position), 0, deepest);
    return deepest;
  }

  // Returns the deepest point of a deformable guest in the host `body`. Segments and single particles are
  // degenerate triangles.
  DeepestPoint of_deformable(const DeformableBody& guest, int body) const {
    DeepestPoint deepest;
    const DepthSearch look = host(body);
    const std::vector<Vec3>& x = bodies_.particles.x;
    const double around = guest.thickness / 2;
    for (int t = guest.first_triangle; t < guest.first_triangle + guest.triangle_count; ++t) {
      const Triangle& triangle = bodies_.triangles[as_index(t)];
      look.at_triangle(x[as_index(triangle[0])], x[as_index(triangle[1])], x[as_index(triangle[2])], around,
                       deepest);
    }
    if (guest.triangle_count == 0 && guest.segment_count == 0)  // a single particle
      look.at_triangle(x[as_index(guest.first_particle)], x[as_index(guest.first_particle)],
                       x[as_index(guest.first_particle)], around, deepest);
    for (int s = guest.first_segment; s < guest.first_segment + guest.segment_count; ++s) {
      const auto& segment = bodies_.segments[as_index(s)];
      look.at_triangle(x[as_index(segment[0])], x[as_index(segment[1])], x[as_index(segment[1])], around,
                       deepest);
    }
    return deepest;
  }

  const Bodies& bodies_;
  const std::vector<BodySurface>& surfaces_;
  double spacing_;
  BroadPhase search_;
  std::vector<BodyPair> pairs_;
};

}  // namespace

Overlaps find_overlaps(const Simulation& simulation, double spacing) {
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  Overlaps found = Finder(simulation.world(), surfaces, spacing).find();
  found.drawn = simulation.drawn_overlap(spacing);
  return found;
}

}  // namespace duet
