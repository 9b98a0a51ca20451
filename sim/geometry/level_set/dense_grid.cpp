// This is the only file of sim/geometry that includes OpenVDB, whose headers take half a minute to compile.
#include "sim/geometry/level_set/dense_grid.h"

#include <cmath>
#include <limits>

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

// Width in voxels of the band on each side of the surface in which OpenVDB computes distances. One voxel is
// enough for it to know the inside.
constexpr float half_band = 1;

// The mesh in units of voxels, with the first node of the grid as its origin, in the types that OpenVDB's
// mesh conversion takes. Single precision is enough to know the inside.
struct VoxelMesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;

  VoxelMesh(const TriangleMesh& mesh, const Vec3& origin, double spacing) {
    points.reserve(mesh.positions.size());
    for (const Vec3& position : mesh.positions) {
      const Vec3f x = ((position - origin) / spacing).cast<float>();
      points.emplace_back(x.x(), x.y(), x.z());
    }
    triangles.reserve(mesh.triangles.size());
    for (const auto& triangle : mesh.triangles) triangles.emplace_back(triangle[0], triangle[1], triangle[2]);
  }
};

}  // namespace

DenseGrid signed_distances(const TriangleMesh& mesh, const TriangleTree& tree, double spacing, int margin) {
  DUET_ASSERT(!mesh.triangles.empty() && spacing > 0 && margin >= 0);
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.positions) box.extend(x);
  DenseGrid grid;
  grid.spacing = spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::ceil(box.sizes()[axis] / spacing) + 2 * margin;
    grid.count[axis] = static_cast<int>(cells) + 1;
    grid.origin[axis] = box.center()[axis] - cells / 2 * spacing;
  }
  grid.values.resize(static_cast<std::size_t>(grid.count.cast<std::ptrdiff_t>().prod()));

  openvdb::initialize();
  // Only signs are read from OpenVDB, so its distances may be in units of voxels. It refuses voxels below
  // 1.44e-5 m.
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  const VoxelMesh voxel_mesh(mesh, grid.origin, spacing);
  const openvdb::FloatGrid::ConstPtr band = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      openvdb::tools::QuadAndTriangleDataAdapter(voxel_mesh.points, voxel_mesh.triangles), *transform,
      half_band, half_band);
  parallel_for(static_cast<std::size_t>(grid.count.z()), 1, [&](std::size_t begin, std::size_t) {
    const auto voxels = band->getConstAccessor();
    const int k = static_cast<int>(begin);
    for (int j = 0; j < grid.count.y(); ++j) {
      double distance = std::numeric_limits<double>::infinity();
      // From one node to the next, the distance grows by the spacing at most.
      for (int i = 0; i < grid.count.x(); ++i) {
        distance = tree.nearest(grid.origin + spacing * Vec3(i, j, k), distance + spacing).distance;
        const bool inside = voxels.getValue(openvdb::Coord(i, j, k)) < 0;
        grid.values[grid.index(i, j, k)] = static_cast<float>(inside ? -distance : distance);
      }
    }
  });
  return grid;
}

}  // namespace duet
