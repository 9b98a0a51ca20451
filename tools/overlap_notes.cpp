#include "tools/overlap_notes.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/simulation/overlaps.h"
#include "sim/step/world.h"

namespace duet::tools {
namespace {

// Depth that is told, over the smallest extent of the body that lies in the other one.
constexpr double told = 0.02;
// Depth that is told again, over that of the overlap told before.
constexpr double deeper = 1.5;

// Returns the smallest extent of a surface along the axes of the world, m.
double smallest_extent(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  return box.isEmpty() ? std::numeric_limits<double>::infinity() : box.sizes().minCoeff();
}

bool is_thin(const Simulation& simulation, const std::string& name) {
  const std::vector<DeformableBody>& bodies = simulation.world().bodies.deformable;
  return std::any_of(bodies.begin(), bodies.end(),
                     [&](const DeformableBody& body) { return body.name == name && body.thickness > 0; });
}

}  // namespace

OverlapNotes::OverlapNotes(const Simulation& simulation) {
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  least_ = std::numeric_limits<double>::infinity();
  for (const BodySurface& body : surfaces) {
    if (is_thin(simulation, body.name)) continue;
    least_ = std::min(least_, told * smallest_extent(body.surface));
  }
}

std::optional<std::string> OverlapNotes::look(const Simulation& simulation, const FrameStats& stats) {
  // Overlaps at the start are told with what becomes of them.
  if (stats.frame == 0 || stats.max_penetration <= std::max(least_, deeper * depth_)) return std::nullopt;
  const Overlaps overlaps = find_overlaps(simulation, stats.max_penetration);
  const DeepestOverlap& deepest =
      overlaps.deformable.depth > overlaps.rigid.depth && !is_thin(simulation, overlaps.deformable.guest)
          ? overlaps.deformable
          : overlaps.rigid;
  if (deepest.depth <= deeper * depth_) return std::nullopt;
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  for (const BodySurface& body : surfaces)
    if (body.name == deepest.guest && deepest.depth <= told * smallest_extent(body.surface))
      return std::nullopt;
  depth_ = deepest.depth;
  guest_ = deepest.guest;
  host_ = deepest.host;
  frame_ = stats.frame;
  return fmt::format(
      "`{}` lies {:.3g} m deep in `{}` at {:.4g} s (frame {}): other bodies leave it no room, or the load is "
      "too "
      "heavy for the solver. Give prescribed motions room, or see `duet explain` for the accuracy",
      guest_, depth_, host_, stats.time, frame_);
}

std::string OverlapNotes::outcome() const {
  if (guest_.empty()) return {};
  return fmt::format("; `{}` up to {:.3g} m deep in `{}` (frame {})", guest_, depth_, host_, frame_);
}

}  // namespace duet::tools
