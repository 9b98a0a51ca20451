#include "sim/contact/detection/surface_intersections.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/deformable/self_contact/collision_candidates.h"
#include "sim/geometry/queries/triangle_intersection.h"

namespace duet {
namespace {

// Least distance of two surfaces, relative to their thickness. Below it rounding leaves no side to keep them
// on.
constexpr double min_gap = 1e-6;

MeetingSurfaces meeting_at(const Bodies& bodies, int first, int second, std::string how) {
  return {body_of(bodies, first), body_of(bodies, second), bodies.particles.x[as_index(first)],
          std::move(how)};
}

// Returns the part of the message that names all pairs of bodies that meet but the first: "; so do those of
// `a` and `b`, of `c` and `d`".
std::string others_that_meet(const Bodies& bodies, const std::vector<std::array<int, 2>>& meeting) {
  const CollisionSurface& surface = bodies.collision_surface;
  std::vector<std::array<int, 2>> pairs;
  for (const std::array<int, 2>& triangles : meeting) {
    const auto [a, b] = std::minmax(surface.triangle_body[as_index(triangles[0])],
                                    surface.triangle_body[as_index(triangles[1])]);
    if (std::find(pairs.begin(), pairs.end(), std::array{a, b}) == pairs.end()) pairs.push_back({a, b});
  }
  std::string text;
  for (std::size_t i = 1; i < pairs.size(); ++i)
    text += fmt::format("{} of `{}` and `{}`", i == 1 ? "; so do those" : ",",
                        bodies.deformable[as_index(pairs[i][0])].name,
                        bodies.deformable[as_index(pairs[i][1])].name);
  return text;
}

}  // namespace

std::vector<std::array<int, 2>> self_intersections(const Bodies& bodies) {
  const CollisionSurface& surface = bodies.collision_surface;
  std::vector<std::array<int, 2>> pairs = intersecting_triangles(bodies.particles.x, surface.triangles);
  std::erase_if(pairs, [&](const std::array<int, 2>& pair) {
    const int body = surface.triangle_body[as_index(pair[0])];
    return body == surface.triangle_body[as_index(pair[1])] && !surface.bodies[as_index(body)].itself;
  });
  return pairs;
}

std::optional<MeetingSurfaces> find_meeting_surfaces(const Bodies& bodies) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const CollisionSurface& surface = bodies.collision_surface;
  const std::vector<std::array<int, 2>> meeting = self_intersections(bodies);
  if (!meeting.empty())
    return meeting_at(bodies, surface.triangles[as_index(meeting.front()[0])][0],
                      surface.triangles[as_index(meeting.front()[1])][0],
                      fmt::format("touch or intersect in {} pair{} of triangles{}", meeting.size(),
                                  meeting.size() == 1 ? "" : "s", others_that_meet(bodies, meeting)));
  CollisionCandidates candidates;
  candidates.update(surface, x, x);
  for (const CandidatePair& pair : candidates.near()) {
    const double distance = closest_points(pair.kind, corners(pair.particle, x)).difference.norm();
    if (distance < min_gap * pair.thickness)
      return meeting_at(bodies, pair.particle[0], pair.particle[3], "touch");
  }
  return std::nullopt;
}

std::size_t body_of(const Bodies& bodies, int particle) {
  const auto found = std::partition_point(
      bodies.deformable.begin(), bodies.deformable.end(),
      [&](const DeformableBody& body) { return particle >= body.first_particle + body.particle_count; });
  return static_cast<std::size_t>(found - bodies.deformable.begin());
}

const std::string& body_name(const Bodies& bodies, int particle) {
  return bodies.deformable[body_of(bodies, particle)].name;
}

}  // namespace duet
