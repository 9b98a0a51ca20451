#include "sim/io/export/split_surface.h"

#include <limits>

#include "sim/base/error.h"
#include "sim/io/export/split_vertices.h"

namespace duet::io {
namespace {

// Appends the vertices and triangles of a body, which has this index in ExportedRun::bodies().
void add(SplitSurfaces& all, const ExportedBody& body, int index) {
  const SplitVertices split = split_vertices(body.rest, UnusedPositions::kept);
  const std::size_t first = all.vertices.size();
  if (first + split.vertices.size() > std::numeric_limits<std::int32_t>::max())
    throw Error(ExitStatus::usage, "the bodies have more than 2^31 vertices (choose fewer with --bodies)");
  for (const Corner& corner : split.vertices)
    all.vertices.push_back({index, corner.position, corner.uv, corner.normal});
  const auto vertex = [&](std::size_t corner) {
    return static_cast<std::int32_t>(first + split.indices[corner]);
  };
  for (std::size_t k = 0; k < split.indices.size(); k += 3) {
    all.triangles.push_back({vertex(k), vertex(k + 1), vertex(k + 2)});
    all.triangle_body.push_back(index);
  }
}

}  // namespace

SplitSurfaces split_surfaces(const ExportedRun& run) {
  SplitSurfaces all;
  for (std::size_t i = 0; i < run.bodies().size(); ++i) {
    add(all, run.bodies()[i], static_cast<int>(i));
    all.has_deformable = all.has_deformable || !run.bodies()[i].is_rigid();
  }
  return all;
}

PlacedBodies::PlacedBodies(const ExportedRun& run) : bodies_(run.bodies()), velocities_(run.bodies().size()) {
  for (const ExportedBody& body : run.bodies()) surfaces_.push_back(body.rest);
}

void PlacedBodies::place(const FrameValues& values) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    io::place(bodies_[i], values, surfaces_[i]);
    velocities(bodies_[i], values, velocities_[i]);
  }
}

float PlacedBodies::of_point(const SplitSurfaces::Vertex& v, const std::vector<float>& values) const {
  const ExportedBody& body = bodies_[index(v.body)];
  return body.is_rigid() ? 0.0F : values[body.first_point + index(v.position)];
}

Vec3f PlacedBodies::of_point(const SplitSurfaces::Vertex& v, const std::vector<Vec3f>& values) const {
  const ExportedBody& body = bodies_[index(v.body)];
  return body.is_rigid() ? Vec3f::Zero() : values[body.first_point + index(v.position)];
}

}  // namespace duet::io
