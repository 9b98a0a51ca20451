#include "sim/scene/build/level_set_export.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/geometry/level_set/grid_level_set.h"

namespace duet {
namespace {

// Returns the area of the surface (m^2) by closed formulas; for a mesh, the area of its bounding box.
double surface_area(const LevelSet& shape) {
  using std::numbers::pi;
  const double r = shape.radius, length = 2 * shape.half_length;
  switch (shape.kind) {
    case LevelSet::Kind::sphere:
      return 4 * pi * r * r;
    case LevelSet::Kind::capsule:
      return 2 * pi * r * (length + 2 * r);
    case LevelSet::Kind::cylinder:
      return 2 * pi * r * (length + r);
    case LevelSet::Kind::torus:
      return 4 * pi * pi * r * shape.tube;
    case LevelSet::Kind::box:
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  const Vec3 size = shape.upper() - shape.lower();
  return 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
}

// Returns the voxel size (m) that the thickness of the shape asks for: the cell of a mesh's grid. For other
// shapes it is 1/40 of the thickness, or up to 1/8 if a thin, wide body would have more than 100 voxels along
// its longest extent, `longest` (m).
double fine_enough(const LevelSet& shape, double longest) {
  if (shape.kind == LevelSet::Kind::grid) return shape.grid->grid().spacing;
  const double thickness = shape.min_size();
  return std::max(thickness / 40, std::min(thickness / 8, longest / 100));
}

}  // namespace

// The size is the largest of the following values.
// - fine_enough(): the size that the thickness asks for.
// - sqrt(area / max_squares): bounds the voxels of plates. The narrow band is six voxels deep, so that
//   there are at most 6e6 voxels.
// - longest / max_along: bounds the voxels of wires, whose band is wider than they are. Some 40 voxels
//   lie across it, so that there are at most 8e5 voxels.
// - least (m): OpenVDB refuses transforms with a determinant below 3e-15 = (1.44e-5)^3.
// Files and memory of thin plates are proportional to max_squares, those of thin wires to max_along.
double exported_voxel_size(const LevelSet& shape) {
  constexpr double max_squares = 1e6, max_along = 2e4, least = 2.2e-5;
  const double longest = (shape.upper() - shape.lower()).maxCoeff();
  return std::max({fine_enough(shape, longest), std::sqrt(surface_area(shape) / max_squares),
                   longest / max_along, least});
}

}  // namespace duet
