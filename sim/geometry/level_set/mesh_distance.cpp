#include "sim/geometry/level_set/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "sim/base/elementary.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

// Fraction of the size of a triangle. For points nearer to the surface than that, the vector from the nearest
// point is mostly rounding and gives no direction. A larger value would use pseudonormals where exact normals
// are available.
constexpr double on_surface = 1e-9;
// Fraction of the length that a pseudonormal has along the normal of a face if all faces around are in one
// plane. It is less if one of them is turned by 1e-6, or if the mesh is open. At flat places the normal of
// the face replaces the vector from the nearest point, because rounding along a large face turns and
// lengthens a short vector.
constexpr double flat = 1 - 1e-13;

// Returns the angle between two vectors, rad.
double angle_between(const Vec3& a, const Vec3& b) { return math::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

MeshDistance::MeshDistance(const TriangleMesh& mesh) : tree_(mesh), faces_(mesh.triangles.size()) {
  std::map<std::pair<int, int>, Vec3> edges;
  std::vector<Vec3> vertices(mesh.positions.size(), Vec3::Zero());
  const auto edge = [&](std::size_t t, std::size_t k) {
    const Triangle& triangle = mesh.triangles[t];
    return std::pair<int, int>(std::minmax(triangle[(k + 1) % 3], triangle[(k + 2) % 3]));
  };
  for (std::size_t t = 0; t < faces_.size(); ++t) {
    Face& face = faces_[t];
    const Vec3 area = area_vector(mesh, t);
    face.normal = area.squaredNorm() > 0 ? Vec3(area.normalized()) : Vec3(Vec3::Zero());
    for (std::size_t k = 0; k < 3; ++k) {
      face.corner[k] = mesh.corner(t, k);
      edges.try_emplace(edge(t, k), Vec3::Zero()).first->second += face.normal;
      const Vec3 to_next = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k);
      const Vec3 to_last = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
      vertices[as_index(mesh.triangles[t][k])] += angle_between(to_next, to_last) * face.normal;
    }
  }
  for (std::size_t t = 0; t < faces_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      faces_[t].at_edge[k] = edges[edge(t, k)];
      faces_[t].at_corner[k] = vertices[as_index(mesh.triangles[t][k])];
    }
}

SignedDistance MeshDistance::from(const TriangleTree::Nearest& nearest, const Vec3& x) const {
  const Face& face = faces_[as_index(nearest.triangle)];
  const Vec3 weight = nearest_weights(face.corner[0], face.corner[1], face.corner[2], x);
  Vec3 pseudonormal = face.normal;
  double of_flat = 1;  // length of the pseudonormal if all faces around are in one plane
  for (int k = 0; k < 3; ++k)
    if (weight[k] == 1) {
      pseudonormal = face.at_corner[k];
      of_flat = 2 * std::numbers::pi;
    } else if (weight[k] == 0 && weight[(k + 1) % 3] != 0 && weight[(k + 2) % 3] != 0) {
      pseudonormal = face.at_edge[k];
      of_flat = 2;
    }
  const Vec3 way = x - nearest.point;
  if (face.normal.dot(pseudonormal) > flat * of_flat) return {face.normal.dot(way), face.normal};
  const double side = way.dot(pseudonormal) < 0 ? -1 : 1;
  const double size = (face.corner[1] - face.corner[0]).norm();
  if (nearest.distance > on_surface * size) return {side * nearest.distance, side / nearest.distance * way};
  return {side * nearest.distance,
          pseudonormal.squaredNorm() > 0 ? Vec3(pseudonormal.normalized()) : Vec3(Vec3::UnitY())};
}

}  // namespace duet
