#include "sim/geometry/mesh/triangle_mesh.h"

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"

namespace duet {

Vec3 area_vector(const TriangleMesh& mesh, std::size_t triangle) {
  const Vec3& a = mesh.corner(triangle, 0);
  return (mesh.corner(triangle, 1) - a).cross(mesh.corner(triangle, 2) - a) / 2;
}

TriangleMesh in_frame(const TriangleMesh& mesh, double scale, const Pose& frame) {
  DUET_ASSERT(scale > 0);
  TriangleMesh result = mesh;
  for (Vec3& x : result.positions) x = frame.to_body(scale * x);
  const Eigen::Quaternionf to_frame = frame.orientation.conjugate().cast<float>();
  for (auto& corners : result.normals)
    for (Vec3f& n : corners) n = to_frame * n;
  return result;
}

namespace {

// Returns the axes of a symmetric tensor as columns, right-handed. If its off-diagonal entries are rounding,
// they are the coordinate axes, so that shapes as simple as a cube keep theirs.
Mat3 principal_axes(const Mat3& tensor) {
  const double off_diagonal = std::abs(tensor(0, 1)) + std::abs(tensor(1, 2)) + std::abs(tensor(2, 0));
  // Rounding of a sum over 1e4 triangles. A larger value would leave bodies with axes that are not principal.
  if (off_diagonal <= 1e-12 * tensor.trace()) return Mat3::Identity();
  Mat3 axes = symmetric_eigen<3>(tensor).vectors;
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  return axes;
}

}  // namespace

MassProperties mass_properties(const TriangleMesh& mesh) {
  // Signed tetrahedra reach from one point to all triangles. That point is a vertex of the mesh, because
  // large tetrahedra from a far point would cancel. The integral of x x^T over a tetrahedron with one corner
  // at the origin is volume / 20 * (sum of corner corner^T + (sum of corners) (sum of corners)^T).
  const Vec3 origin = mesh.positions.front();
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = mesh.corner(t, 0) - origin, b = mesh.corner(t, 1) - origin, c = mesh.corner(t, 2) - origin;
    const Vec3 sum = a + b + c;
    const double part = a.cross(b).dot(c) / 6;
    volume += part;
    first += part / 4 * sum;
    second += part / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  const Vec3 center = first / volume;
  const Mat3 covariance = second / volume - center * center.transpose();
  const Mat3 inertia = covariance.trace() * Mat3::Identity() - covariance;

  MassProperties result;
  result.volume = volume;
  const Mat3 axes = principal_axes(inertia);
  result.frame = {origin + center, Quat(axes)};
  result.unit_inertia = (axes.transpose() * inertia * axes).diagonal();
  return result;
}

}  // namespace duet
