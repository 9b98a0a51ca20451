#include "sim/contact/detection/facing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "sim/contact/detection/edge_contacts.h"
#include "sim/contact/detection/near_faces.h"
#include "sim/deformable/support_point.h"

namespace duet {
namespace {

// Longest exit against the mean normal of the faces around a point, relative to the size of these faces. A
// larger value would let points that have entered a host far behind an edge leave it through another side.
constexpr double longest_exit = 0.1;
// Relative to the size of the faces: how precisely the length of that exit is found, and how far outside it
// ends.
constexpr double at_surface = 1e-6;
// Depth at which is_nearest_to_edge() looks, relative to the smallest size of the host.
constexpr double below_edge = 1e-3;
// At that depth below a flat or smooth surface, its distance is the depth; below an edge it is less. The
// surface is sharp if it is less than this fraction of the depth.
constexpr double min_flat_distance = 0.98;
// Place at which way_out_beside() looks for the side of the host that a face lies on, relative to the
// displacement from the point to the middle of the face.
constexpr double farther_in = 1e-3;

// Returns whether the surface of the host is sharp where it is nearest to a point outside of it.
bool is_edge(const LevelSet& shape, const NearestSurface& nearest) {
  const double below = below_edge * shape.min_size();
  return shape.distance(nearest.from - (nearest.distance + below) * nearest.normal) >
         -min_flat_distance * below;
}

// Returns the exit through a side of the host that a face with the point lies on, for a point at `x` (m,
// world) that may be at an edge of the host. It is the side nearest to a place a little farther in on the
// face. Of several faces the one that faces its side most squarely counts, and only within 18 degrees;
// nothing if there is none.
std::optional<Exit> way_out_beside(const Bodies& bodies, const LevelSet& shape, const Pose& pose,
                                   const SurfacePoint& point, const Vec3& x) {
  std::optional<Exit> found;
  double facing = squarely;
  for (const int t : bodies.faces_around.of(point.particle[0])) {
    const Triangle& face = bodies.triangles[as_index(t)];
    if (!lies_on(point, face)) continue;
    std::array<Vec3, 3> corner;
    for (std::size_t i = 0; i < 3; ++i) corner[i] = bodies.particles.x[as_index(face[i])];
    const Vec3 inward = farther_in * ((corner[0] + corner[1] + corner[2]) / 3 - x);
    const Vec3 in_host = pose.to_body(x + inward);
    const double distance = shape.distance(in_host);
    if (std::abs(distance) > inward.norm()) continue;
    const Vec3 normal = pose.orientation * shape.normal(in_host);
    const Vec3 area = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (const double now = -normal.dot(area); now > facing * area.norm()) {
      facing = now / area.norm();
      found = Exit{normal, normal.dot(inward) - distance};
    }
  }
  return found;
}

}  // namespace

Exit faced_exit(const Bodies& bodies, int host, const Pose& pose, const SurfacePoint& point, const Vec3& x,
                const NearestSurface& surface) {
  const Exit nearest{pose.orientation * surface.normal, -surface.distance};
  const LevelSet& shape = bodies.rigid.properties[as_index(host)].shape;
  if (bodies.faces_around.first.empty() || point.count > 3 || is_swept_by_ball(shape) ||
      shape.kind == LevelSet::Kind::half_space)
    return nearest;
  // The normal from an edge to a point right above it is rounding, and pushes corners off what they lie on.
  const bool is_above_edge = nearest.depth < 0 && is_edge(shape, surface);
  if (is_above_edge)
    if (const auto beside = way_out_beside(bodies, shape, pose, point, x)) return *beside;
  if (faces_squarely(bodies.faces_around, bodies.triangles, bodies.particles.x, point, -nearest.normal))
    return nearest;
  const FacesAround around = look_around(bodies.faces_around, bodies.triangles, bodies.particles.x, point,
                                         weighted(point, bodies.particles.x), -nearest.normal);
  if (around.count == 0 || around.rise <= max_rise) return nearest;
  if (!is_above_edge)
    if (const auto beside = way_out_beside(bodies, shape, pose, point, x)) return *beside;
  if (nearest.depth < 0) {
    if (around.max_facing >= min_facing && !is_above_edge) return nearest;
    return {nearest.normal, -std::numeric_limits<double>::infinity()};
  }
  const double size = std::sqrt(2 * around.area.norm() / around.count);
  const Vec3 way = -around.area.normalized();
  const auto is_out = [&](double length) { return shape.distance(pose.to_body(x + length * way)) >= 0; };
  double in = 0, out = std::max(nearest.depth, at_surface * size);  // m
  for (; !is_out(out); out *= 2) {
    if (out > longest_exit * size) return nearest;
    in = out;
  }
  while (out - in > at_surface * size) (is_out((in + out) / 2) ? out : in) = (in + out) / 2;
  const Vec3 exit = x + (out + at_surface * size) * way;
  const Vec3 normal = pose.orientation * shape.normal(pose.to_body(exit));
  if (!(normal.dot(way) >= min_facing)) return nearest;
  return {normal, normal.dot(exit - x) - shape.distance(pose.to_body(exit))};
}

bool is_support_point(const Bodies& bodies, const SurfacePoint& point, const Vec3& x, const Vec3& normal) {
  return bodies.faces_around.first.empty() ||
         look_around(bodies.faces_around, bodies.triangles, bodies.particles.x, point, x, -normal).rise <=
             max_rise;
}

ElementLists faces_around(const Bodies& bodies) {
  std::vector<char> of_volume(bodies.triangles.size(), 0);
  bool any = false;
  for (const DeformableBody& body : bodies.deformable) {
    if (body.thickness > 0) continue;
    any = any || body.triangle_count > 0;
    std::fill_n(of_volume.begin() + body.first_triangle, body.triangle_count, 1);
  }
  if (!any) return {};
  std::vector<int> numbers(bodies.triangles.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  return elements_around(bodies.particles.size(), numbers, [&](int t) {
    const Triangle& face = bodies.triangles[as_index(t)];
    return std::span(face.begin(), of_volume[as_index(t)] ? face.size() : 0);
  });
}

}  // namespace duet
