#include "sim/simulation/overlaps.h"

#include <algorithm>
#include <cmath>

#include "sim/base/parallel.h"
#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/broad_phase.h"
#include "sim/step/world.h"

namespace duet {
namespace {

// The deepest point found so far on the surface of a guest.
struct Deepest {
  double distance = 0;  // m, from the host, less half the thickness around the surface; negative inside
  Vec3 place = Vec3::Zero();
};

// Searches the deepest points of surfaces in one host.
class Look {
 public:
  Look(const RigidBodies& rigid, const BodyBounds& bounds, int host, double spacing)
      : shape_(rigid.properties[as_index(host)].shape),
        pose_(shape_pose(rigid, as_index(host))),
        bounds_(bounds),
        spacing_(spacing) {}

  // Updates `deepest` by the points of a triangle (m, world space) with the radius `around` (m) around it.
  // Halves the triangle along its longest edge until its edges are no longer than the spacing. A part is
  // skipped if none of its points can be deeper than the deepest one known: a signed distance changes by no
  // more than the length of the displacement.
  void at_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double around, Deepest& deepest) const {
    const Vec3 middle = (a + b + c) / 3;
    const double radius = std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
    if (min_distance(middle) - radius - around >= deepest.distance) return;
    const double ab = (b - a).norm(), bc = (c - b).norm(), ca = (a - c).norm();
    if (std::max({ab, bc, ca}) <= spacing_) {
      for (const Vec3& x : {middle, a, b, c}) at(x, around, deepest);
    } else if (ab >= bc && ab >= ca) {
      at_triangle(a, (a + b) / 2, c, around, deepest);
      at_triangle((a + b) / 2, b, c, around, deepest);
    } else {
      at_triangle(b, c, a, around, deepest);
    }
  }

 private:
  // Returns a cheap lower bound of the distance (m) of `x` from the host.
  double min_distance(const Vec3& x) const {
    const double outside = bounds_.is_half_space ? 0 : world_box(bounds_, 0).exteriorDistance(x);
    return outside > 0 ? outside : shape_.distance(pose_.to_body(x)) - shape_.tolerance();
  }

  // Updates `deepest` by one point.
  void at(const Vec3& x, double around, Deepest& deepest) const {
    if (min_distance(x) - around >= deepest.distance) return;
    const double distance = shape_.exact(pose_.to_body(x)).distance - around;
    if (distance < deepest.distance) deepest = {distance, x};
  }

  const LevelSet& shape_;
  Pose pose_;  // of the shape of the host
  const BodyBounds& bounds_;
  double spacing_;
};

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
        found.deformable = overlap(of_deformable(guest, pair.host), guest.name, pair.host);
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

  DeepestOverlap overlap(const Deepest& deepest, const std::string& guest, int host) const {
    if (!(deepest.distance < 0)) return {};
    return {-deepest.distance, guest, bodies_.rigid.name[as_index(host)], deepest.place};
  }

  Look host(int body) const { return {bodies_.rigid, search_.bounds[as_index(body)], body, spacing_}; }

  // Returns the deepest point of a rigid guest in the host `body`. The ground has no surface, so it is never
  // a guest.
  Deepest of_rigid(int guest, int body) const {
    Deepest deepest;
    if (search_.bounds[as_index(guest)].is_half_space) return deepest;
    const Look look = host(body);
    const Surface& surface = surfaces_[as_index(guest)].surface;
    const auto x = [&](int vertex) { return surface.positions[as_index(vertex)]; };
    for (const auto& triangle : surface.triangles)
      look.at_triangle(x(triangle[0].position), x(triangle[1].position), x(triangle[2].position), 0, deepest);
    return deepest;
  }

  // Returns the deepest point of a deformable guest in the host `body`. Segments and single particles are
  // degenerate triangles.
  Deepest of_deformable(const DeformableBody& guest, int body) const {
    Deepest deepest;
    const Look look = host(body);
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
  return Finder(simulation.world(), surfaces, spacing).find();
}

}  // namespace duet
