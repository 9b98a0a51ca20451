#include "sim/deformable/support_point.h"

#include <algorithm>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Returns by how much a face rises in the direction `toward` from a point of it, as the sine of an angle.
//
// The face has its corners at `x` (m) and the unit normal `normal`; the point is at `at` (m). The rise is
// measured straight uphill if that direction leads from the point into the face, or else along the face's
// edges.
double rise_of(const Triangle& face, const std::array<Vec3, 3>& x, const Vec3& normal,
               const SurfacePoint& point, const Vec3& at, const Vec3& toward) {
  const Vec3 uphill = toward - toward.dot(normal) * normal;
  bool leads_into = true;
  double along_edges = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto end = point.particle.begin() + point.count;
    const auto own = std::find(point.particle.begin(), end, face[i]);
    const double weight =
        own == end ? 0 : point.weight[static_cast<std::size_t>(own - point.particle.begin())];
    const Vec3 opposite = x[(i + 2) % 3] - x[(i + 1) % 3];
    leads_into = leads_into && (weight > 0 || normal.dot(opposite.cross(uphill)) >= 0);
    const Vec3 away = x[i] - at;
    if (const double length = away.norm(); length > 0)
      along_edges = std::max(along_edges, away.dot(toward) / length);
  }
  return leads_into ? uphill.norm() : along_edges;
}

}  // namespace

bool lies_on(const SurfacePoint& point, const Triangle& face) {
  DUET_ASSERT(point.count >= 1 && point.count <= 4);
  const auto is_corner = [&](int p) { return std::find(face.begin(), face.end(), p) != face.end(); };
  return std::all_of(point.particle.begin() + 1, point.particle.begin() + point.count, is_corner);
}

bool faces_squarely(const ElementLists& around, const std::vector<Triangle>& triangles,
                    const std::vector<Vec3>& x, const SurfacePoint& point, const Vec3& toward) {
  DUET_ASSERT(is_unit(toward));
  for (const int t : around.of(point.particle[0])) {
    const Triangle& face = triangles[as_index(t)];
    if (!lies_on(point, face)) continue;
    const Vec3& a = x[as_index(face[0])];
    const Vec3 area = (x[as_index(face[1])] - a).cross(x[as_index(face[2])] - a);
    const double along = area.dot(toward);
    if (along > 0 && along * along >= squarely * squarely * area.squaredNorm()) return true;
  }
  return false;
}

FacesAround look_around(const ElementLists& around, const std::vector<Triangle>& triangles,
                        const std::vector<Vec3>& positions, const SurfacePoint& point, const Vec3& at,
                        const Vec3& toward) {
  DUET_ASSERT(is_unit(toward));
  FacesAround found;
  for (const int t : around.of(point.particle[0])) {
    const Triangle& face = triangles[as_index(t)];
    if (!lies_on(point, face)) continue;
    std::array<Vec3, 3> x;
    for (std::size_t i = 0; i < 3; ++i) x[i] = positions[as_index(face[i])];
    const Vec3 area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
    const double size = area.norm();
    if (!(size > 0)) continue;
    found.area += area;
    ++found.count;
    found.max_facing = std::max(found.max_facing, area.dot(toward) / size);
    const double rise = rise_of(face, x, area / size, point, at, toward);
    if (rise <= found.rise) continue;
    found.rise = rise;
    found.steepest = area / size;
  }
  return found;
}

}  // namespace duet
