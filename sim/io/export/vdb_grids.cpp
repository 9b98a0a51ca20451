#include "sim/io/export/vdb_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>

#include "sim/base/error.h"
#include "sim/io/vdb_file.h"

namespace duet::io {
namespace {

namespace fs = std::filesystem;

// Grids of a run at a frame, by the name of their body.
using GridsOfBodies = std::map<std::string, openvdb::FloatGrid::Ptr, std::less<>>;

void read_grids(const RunDirectory& run, const fs::path& path, GridsOfBodies& grids) {
  run.require_whole(path);
  for (openvdb::FloatGrid::Ptr& grid : read_vdb(path)) {
    const std::string name = grid->getName();
    grids[name] = std::move(grid);
  }
}

// Returns the distance between the place of a grid and that of its body's pose, relative to `unit`.
double misplacement(const openvdb::FloatGrid& grid, const Vec3& position, double unit) {
  const openvdb::Vec3d at = grid.indexToWorld(openvdb::Vec3d(0, 0, 0));
  return (Vec3(at.x(), at.y(), at.z()) - position).norm() / unit;
}

// Returns a copy of a grid of the run in the axes of its body and the unit of the export.
openvdb::FloatGrid::Ptr in_body_axes(const openvdb::FloatGrid& grid, double scale) {
  openvdb::FloatGrid::Ptr result = scale == 1 ? openvdb::ConstPtrCast<openvdb::FloatGrid>(grid.copy())
                                              : openvdb::ConstPtrCast<openvdb::FloatGrid>(grid.deepCopy());
  const double voxel = grid.voxelSize()[0];
  result->clearMetadata();
  result->setTransform(openvdb::math::Transform::createLinearTransform(scale * voxel));
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  result->setName(vdb_grid_name);
  if (scale == 1) return result;
  const auto factor = static_cast<float>(scale);
  result->tree().root().setBackground(factor * result->background(), /*updateChildNodes=*/false);
  for (auto value = result->tree().beginValueAll(); value; ++value) value.setValue(factor * *value);
  return result;
}

// Returns the first exported frame with a file of level sets; -1 if there is none.
int first_frame_with_level_sets(const ExportedRun& run) {
  for (const int frame : run.frames())
    if (fs::exists(run.run().level_set(frame))) return frame;
  return -1;
}

}  // namespace

ShapeGrids read_shape_grids(const ExportedRun& run) {
  ShapeGrids result;
  result.of_body.assign(run.bodies().size(), -1);
  if (std::none_of(run.bodies().begin(), run.bodies().end(),
                   [](const ExportedBody& body) { return body.is_rigid(); }))
    return result;
  openvdb::initialize();
  GridsOfBodies grids;
  const int frame = first_frame_with_level_sets(run);
  if (frame >= 0) read_grids(run.run(), run.run().level_set(frame), grids);
  if (fs::exists(run.run().static_level_sets())) read_grids(run.run(), run.run().static_level_sets(), grids);
  const FrameValues values = run.read(frame >= 0 ? frame : run.frames().front());
  std::map<const void*, int> shape_of_tree;
  for (std::size_t i = 0; i < run.bodies().size(); ++i) {
    const ExportedBody& body = run.bodies()[i];
    if (!body.is_rigid()) continue;
    const auto found = grids.find(body.name);
    if (found == grids.end())
      throw FileError((run.run().root / "levelset").string(),
                      fmt::format("has no level set of {} at the exported frames", body.name),
                      "simulate the run again, or leave the body out by --bodies");
    const openvdb::FloatGrid& grid = *found->second;
    const Vec3 place = run.axes().conjugate() *
                       values.rigid.at(static_cast<std::size_t>(body.row)).pose.position / run.scale();
    constexpr double tolerance = 1e-3;  // voxels; places are equal but for rounding, far from the origin too
    if (!(misplacement(grid, place, grid.voxelSize()[0]) < tolerance))
      throw FileError(
          (body.kind == "static" ? run.run().static_level_sets() : run.run().level_set(frame)).string(),
          fmt::format("{} is not where values/ has it", body.name), "simulate the run again");
    const auto [shape, is_new] =
        shape_of_tree.emplace(grid.constTreePtr().get(), static_cast<int>(result.shapes.size()));
    if (is_new) result.shapes.push_back({i, in_body_axes(grid, run.scale())});
    result.of_body[i] = shape->second;
  }
  return result;
}

bool has_inside(const Surface& surface) {
  std::vector<std::array<int, 2>> edges;
  edges.reserve(3 * surface.triangles.size());
  for (const std::array<Corner, 3>& triangle : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = triangle[k].position, b = triangle[(k + 1) % 3].position;
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    const auto end = std::upper_bound(edges.begin() + static_cast<std::ptrdiff_t>(i), edges.end(), edges[i]);
    const auto next = static_cast<std::size_t>(end - edges.begin());
    if ((next - i) % 2 != 0) return false;
    i = next;
  }
  return !edges.empty();
}

double band_voxels(const Surface& surface, double voxel) {
  double area = 0;
  for (const std::array<Corner, 3>& triangle : surface.triangles) {
    const auto corner = [&](std::size_t k) -> const Vec3& {
      return surface.positions[static_cast<std::size_t>(triangle[k].position)];
    };
    area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  }
  return 2 * vdb_half_band * area / (voxel * voxel);
}

openvdb::FloatGrid::Ptr surface_grid(const Surface& surface, double voxel) {
  openvdb::initialize();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  // Voxels lie at multiples of their width, so that those of a body at rest stay the same. Floats hold the
  // points relative to one of the voxels, in units of voxels: OpenVDB refuses voxels below 1.44e-5.
  const Vec3 origin = (box.center() / voxel).array().round();
  std::vector<openvdb::Vec3s> points;
  points.reserve(surface.positions.size());
  for (const Vec3& position : surface.positions) {
    const Vec3f x = (position / voxel - origin).cast<float>();
    points.emplace_back(x.x(), x.y(), x.z());
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(surface.triangles.size());
  for (const std::array<Corner, 3>& triangle : surface.triangles)
    triangles.emplace_back(triangle[0].position, triangle[1].position, triangle[2].position);
  const auto unit = openvdb::math::Transform::createLinearTransform(1.0);
  openvdb::FloatGrid::Ptr grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      openvdb::tools::QuadAndTriangleDataAdapter(points, triangles), *unit, static_cast<float>(vdb_half_band),
      static_cast<float>(vdb_half_band));
  const auto factor = static_cast<float>(voxel);
  grid->tree().root().setBackground(factor * grid->background(), /*updateChildNodes=*/false);
  for (auto value = grid->tree().beginValueAll(); value; ++value) value.setValue(factor * *value);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  transform->postTranslate(voxel * openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName(vdb_grid_name);
  return grid;
}

}  // namespace duet::io
