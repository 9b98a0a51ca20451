// Everything that the simulator needs of the shape of a rigid body, in body space: the origin is the center
// of mass, and the axes are principal axes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sim/geometry/level_set/feature_edges.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/level_set/round_surface.h"
#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// The shape of a rigid body, in body space.
struct Solid {
  LevelSet level_set;                ///< Signed distance.
  double volume = 0;                 ///< Volume, m^3.
  Vec3 unit_inertia = Vec3::Zero();  ///< Principal moments of inertia per unit mass, m^2.
  /// Body space in the own coordinates of the shape; the identity except for meshes.
  Pose frame;
  std::vector<Vec3> samples;   ///< Points that are tested against the level sets of other bodies, m.
  std::vector<Vec3> inside;    ///< A point inside the body for each sample, see points_inside(), m.
  std::vector<char> on_flat;   ///< Nonzero for samples in flat faces, see on_flat_faces().
  FeatureEdges feature_edges;  ///< Feature edges, corners and convex vertices.
  std::shared_ptr<const RoundSurface> round;  ///< Round parts of a mesh; null: there are none.
  Surface surface;                            ///< The surface as it is drawn.
};

/// Returns the solid of a shape with a formula. `sample_spacing` is in m and is by default that of
/// default_sample_spacing(). `detail` is that of shape_surface().
Solid make_solid(const LevelSet& shape, std::optional<double> sample_spacing = {}, double detail = 1);

/// Returns the solid of a mesh in which repair() finds no flaw. The mesh is scaled about the origin of its
/// coordinates; `cells` is the number of cells of its level set along its longest extent, and
/// `sample_spacing` (m) applies after scaling.
Solid make_solid(const TriangleMesh& mesh, double scale, int cells,
                 std::optional<double> sample_spacing = {});

}  // namespace duet
