#include "sim/io/level_set_writer.h"

#include <cmath>

#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include "sim/base/files.h"
#include "sim/io/vdb_file.h"

namespace duet::io {
namespace {

constexpr int half_band = vdb_half_band;

// Samples one block of voxels, whose first voxel is `origin`. Voxels with |distance| < half_band voxels are
// active; all others are inactive and hold the background with the sign of the distance. A block without
// active voxels becomes a tile. A block that is too far from the surface for active voxels, judging by the
// distance at its center, is skipped.
void sample_block(const BodyLevelSet& body, openvdb::FloatTree& tree, const openvdb::Coord& origin) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  const double band = half_band * body.voxel_size;
  const auto distance = [&](const Vec3& voxel) { return body.distance(voxel * body.voxel_size); };
  const Vec3 corner(origin.x(), origin.y(), origin.z());
  const double to_corner = 0.5 * std::sqrt(3.0) * (Leaf::DIM - 1);  // half diagonal of the block, voxels
  const double center_distance = distance(corner + Vec3::Constant(0.5 * (Leaf::DIM - 1)));
  if (std::abs(center_distance) >= band + to_corner * body.voxel_size) return;

  Leaf* leaf = tree.touchLeaf(origin);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const openvdb::Coord c = leaf->offsetToGlobalCoord(i);
    const double d = distance(Vec3(c.x(), c.y(), c.z()));
    if (std::abs(d) < band) {
      leaf->setValueOn(i, static_cast<float>(d));
    } else {
      leaf->setValueOff(i, static_cast<float>(d < 0 ? -band : band));
    }
  }
  if (leaf->isEmpty()) tree.addTile(1, origin, static_cast<float>(center_distance < 0 ? -band : band), false);
}

// Samples the narrow band of a body's level set, with body axes and the voxel as unit of the grid's
// coordinates.
openvdb::FloatGrid::Ptr sample(const BodyLevelSet& body) {
  const double band = half_band * body.voxel_size;
  auto grid = openvdb::FloatGrid::create(static_cast<float>(band));
  constexpr int block = openvdb::FloatTree::LeafNodeType::DIM;
  const auto block_of = [&](double x) { return static_cast<int>(std::floor(x / (body.voxel_size * block))); };
  const Vec3 lower = body.lower.array() - band, upper = body.upper.array() + band;
  for (int x = block_of(lower.x()); x <= block_of(upper.x()); ++x)
    for (int y = block_of(lower.y()); y <= block_of(upper.y()); ++y)
      for (int z = block_of(lower.z()); z <= block_of(upper.z()); ++z)
        sample_block(body, grid->tree(), openvdb::Coord(x * block, y * block, z * block));
  openvdb::tools::signedFloodFill(grid->tree());  // makes the skipped blocks inside negative
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName(body.name);
  grid->insertMeta("units", openvdb::StringMetadata("metres, seconds; y up, right-handed"));
  return grid;
}

// Returns the transform from voxel coordinates to the world. OpenVDB multiplies row vectors from the left,
// hence the transposed rotation.
openvdb::math::Transform::Ptr placement(const Pose& pose, double voxel_size) {
  const Mat3 columns = voxel_size * pose.orientation.toRotationMatrix();
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix(row, column) = columns(column, row);
    matrix(3, row) = pose.position[row];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

// Writes the grids to the file. If there are no grids, removes the file that an earlier run left, which
// would show other bodies.
void write_or_remove(const RunDirectory& run, const fs::path& path, const openvdb::GridCPtrVec& grids) {
  if (grids.empty()) {
    run.remove(path);
  } else {
    run.write(path, vdb_bytes(grids));
  }
}

}  // namespace

struct LevelSetWriter::Impl {
  std::vector<openvdb::FloatGrid::Ptr> grids;  // one for each body, without pose
  bool static_written = false;                 // true once static.vdb has been written or removed

  // Returns the grid of a body with the pose of `at`.
  openvdb::FloatGrid::Ptr placed(std::size_t body, const BodyLevelSet& at) const {
    openvdb::FloatGrid::Ptr grid = grids[body]->copy();  // shares the voxels
    grid->setTransform(placement(at.pose, at.voxel_size));
    return grid;
  }
};

LevelSetWriter::LevelSetWriter(const std::vector<BodyLevelSet>& bodies) : impl_(std::make_unique<Impl>()) {
  openvdb::initialize();
  for (const BodyLevelSet& body : bodies) {
    if (body.same_as < 0) {
      impl_->grids.push_back(sample(body));
    } else {
      impl_->grids.push_back(impl_->grids.at(static_cast<std::size_t>(body.same_as))->copy());
      impl_->grids.back()->setName(body.name);
    }
  }
}

LevelSetWriter::~LevelSetWriter() = default;

void LevelSetWriter::write(const RunDirectory& run, int frame, double time,
                           const std::vector<BodyLevelSet>& bodies) {
  openvdb::GridCPtrVec moving, fixed;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].is_static) {
      if (!impl_->static_written) fixed.push_back(impl_->placed(i, bodies[i]));
      continue;
    }
    const openvdb::FloatGrid::Ptr grid = impl_->placed(i, bodies[i]);
    grid->insertMeta("frame", openvdb::Int32Metadata(frame));
    grid->insertMeta("time", openvdb::DoubleMetadata(time));
    moving.push_back(grid);
  }
  if (!impl_->static_written) {
    write_or_remove(run, run.static_level_sets(), fixed);
    impl_->static_written = true;
  }
  write_or_remove(run, run.level_set(frame), moving);
}

}  // namespace duet::io
