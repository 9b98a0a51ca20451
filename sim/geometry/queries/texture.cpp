#include "sim/geometry/queries/texture.h"

#include <algorithm>
#include <array>

#include "sim/base/assert.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet {
namespace {

// Returns the pseudoinverse of the matrix E whose columns are two edges of a triangle: its rows are the dual
// basis b x n / n^2 and n x a / n^2 with n = a x b, the normal. Edges that are parallel up to rounding have
// rank one, where the pseudoinverse is E^T / |E|^2.
Eigen::Matrix<double, 2, 3> pseudoinverse(const Eigen::Matrix<double, 3, 2>& edges) {
  const Vec3 a = edges.col(0), b = edges.col(1), n = a.cross(b);
  Eigen::Matrix<double, 2, 3> inverse;
  if (n.squaredNorm() > 1e-28 * a.squaredNorm() * b.squaredNorm()) {
    inverse.row(0) = b.cross(n) / n.squaredNorm();
    inverse.row(1) = n.cross(a) / n.squaredNorm();
  } else {
    const double size = edges.squaredNorm();
    inverse = size > 0 ? Eigen::Matrix<double, 2, 3>(edges.transpose() / size)
                       : Eigen::Matrix<double, 2, 3>::Zero();
  }
  return inverse;
}

// The texture of one triangle of a mesh, extended to all of its plane.
struct PlaneTexture {
  Vec3 origin;
  Vec2 uv;
  Eigen::Matrix<double, 2, 3> gradient;  // 1/m

  PlaneTexture(const TriangleMesh& mesh, std::size_t triangle) : origin(mesh.corner(triangle, 0)) {
    const std::array<Vec2f, 3>& corners = mesh.uvs[triangle];
    uv = corners[0].cast<double>();
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Matrix2d changes;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = mesh.corner(triangle, as_index(k + 1)) - origin;
      changes.col(k) = corners[as_index(k + 1)].cast<double>() - uv;
    }
    gradient = changes * pseudoinverse(edges);
  }
  Vec2 at(const Vec3& x) const { return uv + gradient * (x - origin); }
};

}  // namespace

Vec2f planar_uv(const Vec3& x, const Vec3& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return Vec2(x[(axis + 1) % 3], x[(axis + 2) % 3]).cast<float>();
}

void transfer_texture(const TriangleMesh& mesh, Surface& surface) {
  DUET_ASSERT(mesh.uvs.size() == mesh.triangles.size());
  // Multiple of the change of the texture within a triangle. A corner whose own texture is farther from the
  // extended one lies beyond a seam.
  constexpr double jump = 2;
  const TriangleTree tree(mesh);
  const auto texture_at = [&](const Vec3& x) {
    return PlaneTexture(mesh, as_index(tree.nearest(x).triangle));
  };
  std::vector<Vec2> nearest;  // texture coordinates at each position
  for (const Vec3& x : surface.positions) nearest.push_back(texture_at(x).at(x));

  surface.uvs.clear();
  std::vector<std::vector<int>> uvs_of(surface.positions.size());
  for (std::array<Corner, 3>& triangle : surface.triangles) {
    std::array<Vec3, 3> x;
    for (std::size_t k = 0; k < 3; ++k) x[k] = surface.positions[as_index(triangle[k].position)];
    const Vec3 middle = (x[0] + x[1] + x[2]) / 3;
    const PlaneTexture below = texture_at(middle);
    double change = 0;
    for (const Vec3& corner : x) change = std::max(change, (below.at(corner) - below.at(middle)).norm());
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2& own = nearest[as_index(triangle[k].position)];
      const Vec2 continued = below.at(x[k]);
      const Vec2f uv = ((own - continued).norm() > jump * change ? continued : own).cast<float>();
      std::vector<int>& known = uvs_of[as_index(triangle[k].position)];
      const auto same =
          std::find_if(known.begin(), known.end(), [&](int i) { return surface.uvs[as_index(i)] == uv; });
      if (same != known.end()) {
        triangle[k].uv = *same;
        continue;
      }
      triangle[k].uv = static_cast<int>(surface.uvs.size());
      known.push_back(triangle[k].uv);
      surface.uvs.push_back(uv);
    }
  }
}

}  // namespace duet
