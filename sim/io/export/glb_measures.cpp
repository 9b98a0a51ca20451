#include <cmath>

#include "sim/io/export/glb_scene.h"

namespace duet::io {
namespace {

// Distance from the origin up to which the coordinates of a run are kept, relative to half the diagonal of
// its bounding box at the first frame. If the center of the box is farther away, coordinates are relative
// to a point near it. Floats keep 24 bits of the distance from the origin, and so at least 20 bits of the
// run's size; doubling the value costs another bit.
constexpr double farthest_center = 8;

// Returns the bounding box of all bodies at a frame, in the axes and unit of the export.
Eigen::AlignedBox3d box_around(const ExportedRun& run, const FrameValues& values) {
  Eigen::AlignedBox3d box;
  for (const ExportedBody& body : run.bodies()) {
    Surface surface = body.rest;
    place(body, values, surface);
    for (const Vec3& x : surface.positions) box.extend(x);
  }
  return box;
}

// Returns the origin of the file's coordinates: 0, or the center of the run rounded to multiples of a power
// of ten, so that users can type it.
Vec3 file_origin(const ExportedRun& run, const FrameValues& values) {
  const Eigen::AlignedBox3d box = box_around(run, values);
  if (box.isEmpty()) return Vec3::Zero();
  const double radius = box.diagonal().norm() / 2;
  if (box.center().norm() <= farthest_center * radius) return Vec3::Zero();
  if (!(radius > 0)) return box.center();
  double unit = 1;
  while (unit > radius) unit /= 10;
  while (10 * unit <= radius) unit *= 10;
  return Vec3((box.center() / unit).array().round()) * unit;
}

// Returns true for deformable bodies that have a mesh in the file.
bool is_drawn_deformable(const ExportedBody& body) {
  return !body.is_rigid() && !body.rest.triangles.empty();
}

}  // namespace

GlbMeasures measure(const ExportedRun& run) {
  const FrameValues first = run.read(run.frames().front());
  GlbMeasures measures{file_origin(run, first), PoseTracks(run), {}, {}, {}, {}};
  measures.poses.add(first);
  for (std::size_t i = 0; i < run.bodies().size(); ++i) {
    if (!is_drawn_deformable(run.bodies()[i])) continue;
    measures.morphed.emplace_back(run.bodies()[i], measures.origin, first);
    measures.bodies.push_back(i);
  }
  measures.changes.assign(measures.morphed.size(), false);
  std::vector<MorphedBody> moving = measures.morphed;
  for (std::size_t frame = 1; frame < run.frames().size(); ++frame) {
    const FrameValues values = run.read(run.frames()[frame]);
    measures.poses.add(values);
    std::vector<MorphFrame>& row = measures.morphs.emplace_back();
    for (std::size_t i = 0; i < moving.size(); ++i) {
      row.push_back(moving[i].advance(values));
      if (row.back().positions.moved > 0 || row.back().normals.moved > 0) measures.changes[i] = true;
    }
  }
  return measures;
}

}  // namespace duet::io
