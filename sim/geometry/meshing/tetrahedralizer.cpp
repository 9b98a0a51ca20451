#include "sim/geometry/meshing/tetrahedralizer.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/geometry/meshing/lattice_stencils.h"
#include "sim/geometry/meshing/tet_smoothing.h"

namespace duet {

TetMesh tetrahedralize(const LevelSet& shape, double spacing, CellSizes sizes) {
  TetMesh mesh = tets_inside(cut_lattice(bcc_lattice(shape, spacing, sizes), shape));
  raise_altitudes(mesh, shape, spacing);
  return mesh;
}

double default_spacing(const LevelSet& shape) {
  return std::min(shape.min_size() / 4, (shape.upper() - shape.lower()).maxCoeff() / 10);
}

LevelSet fine_level_set(const TriangleMesh& mesh, std::optional<double> spacing) {
  // Bounds on the number of grid cells along the longest extent. The lower one also applies without a
  // spacing; the upper one bounds memory, which grows with its cube.
  constexpr double min_cells = 64, max_cells = 256;
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.positions) box.extend(x);
  const double wanted = spacing ? 2 * box.sizes().maxCoeff() / *spacing : 0;
  const int cells = static_cast<int>(std::clamp(std::ceil(wanted), min_cells, max_cells));
  return LevelSet::mesh(std::make_shared<const GridLevelSet>(mesh, cells, GridLevelSet::SharpEdges::rounded));
}

}  // namespace duet
