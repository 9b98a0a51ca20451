#include "sim/io/export/split_surface.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::io {
namespace {

void add(SplitSurfaces& all, const ExportedBody& body, int index) {
  const auto order = [](const Corner& a, const Corner& b) {
    return std::tie(a.position, a.normal, a.uv) < std::tie(b.position, b.normal, b.uv);
  };
  const Surface& surface = body.rest;
  std::vector<Corner> corners;
  corners.reserve(3 * surface.triangles.size());
  std::vector<bool> is_used(surface.positions.size());
  for (const auto& triangle : surface.triangles)
    for (const Corner& corner : triangle) {
      corners.push_back(corner);
      is_used[static_cast<std::size_t>(corner.position)] = true;
    }
  for (std::size_t i = 0; i < is_used.size(); ++i)
    if (!is_used[i]) corners.push_back({static_cast<int>(i), -1, -1});
  std::sort(corners.begin(), corners.end(), order);
  corners.erase(std::unique(corners.begin(), corners.end(),
                            [&](const Corner& a, const Corner& b) { return !order(a, b); }),
                corners.end());
  const std::size_t first = all.vertices.size();
  if (first + corners.size() > std::numeric_limits<std::int32_t>::max())
    throw Error(ExitStatus::usage, "the bodies have more than 2^31 vertices (choose fewer with --bodies)");
  for (const Corner& corner : corners)
    all.vertices.push_back({index, corner.position, corner.uv, corner.normal});
  for (const auto& triangle : surface.triangles) {
    auto& vertices = all.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      vertices[k] = static_cast<std::int32_t>(
          first +
          static_cast<std::size_t>(std::lower_bound(corners.begin(), corners.end(), triangle[k], order) -
                                   corners.begin()));
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

float PlacedBodies::strain(const SplitSurfaces::Vertex& v, const FrameValues& values) const {
  const ExportedBody& body = bodies_[index(v.body)];
  return body.is_rigid() ? 0.0F : values.strain[body.first_point + index(v.position)];
}

}  // namespace duet::io
