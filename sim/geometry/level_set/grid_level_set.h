// The level set of a closed mesh: a grid of exact distances, interpolated between its nodes. Three regions
// are answered from the triangles instead. Beyond the grid, exact distances keep every bound that is drawn
// from them valid, so that no contact is missed. Around walls thinner than one and a half cells, which have
// no node in their middle, interpolation would not see the wall. Near sharp edges, interpolation is off by a
// fraction of a cell.
#pragma once

#include "sim/geometry/level_set/dense_grid.h"
#include "sim/geometry/level_set/mesh_distance.h"

namespace duet {

/// Signed distance of a closed mesh, see LevelSet::Kind::grid.
class GridLevelSet {
 public:
  /// How distances near sharp edges are computed.
  enum class SharpEdges {
    /// Distances come from the triangles; for contact.
    exact,
    /// Distances are interpolated, which rounds the edges; for shapes that are filled with tets, as rounded
    /// edges cut
    /// no slivers.
    rounded
  };
  /// Constructs the level set of a closed mesh whose triangles face outward, in body space, with `cells` grid
  /// cells along its longest extent.
  GridLevelSet(const TriangleMesh& mesh, int cells, SharpEdges sharp_edges = SharpEdges::exact);

  /// Returns the signed distance (m) of the point `x`, negative inside. It is trilinear, except where
  /// is_exact() holds and beyond the grid.
  double distance(const Vec3& x) const;
  /// Returns whether `x` lies in a cell of the grid whose distances are not interpolated; false beyond the
  /// grid.
  bool is_exact(const Vec3& x) const;
  /// Returns the unit normal at `x`: along the gradient of the trilinear interpolant in cells that are
  /// interpolated, the exact one elsewhere. It is (0, 1, 0) where the gradient vanishes.
  Vec3 normal(const Vec3& x) const;

  /// Returns the greatest distance (m) of a vertex from the origin.
  double bounding_radius() const { return bounding_radius_; }
  /// Returns the lower corner of the bounding box of the mesh, m.
  const Vec3& lower() const { return bounds_.min(); }
  /// Returns the upper corner of the bounding box of the mesh, m.
  const Vec3& upper() const { return bounds_.max(); }
  /// Returns the thickness of the thinnest wall (m) if any is thinner than one and a half cells, else the
  /// diameter of the largest ball inside, as far as the nodes of the grid tell.
  double thickness() const { return thickness_; }
  /// Returns the exact signed distance, from the triangles.
  const MeshDistance& exact() const { return exact_; }
  /// Returns the grid of distances.
  const DenseGrid& grid() const { return grid_; }

 private:
  // Returns whether a place lies in the grid. `local` is in units of cells from the first node.
  bool inside_grid(const Vec3& local) const;
  // Returns whether distances in the cell around a place in the grid are not interpolated. `local` is in
  // units of cells from the first node.
  bool is_exact_at(const Vec3& local) const;
  // Finds walls thinner than one and a half cells, marks the cells around them and lowers thickness_ to the
  // thinnest one.
  void find_thin_walls(const TriangleMesh& mesh);
  // Marks the cells around sharp edges.
  void find_creases(const TriangleMesh& mesh);
  // Marks the cells within one and a half cells of `x` (m) as exact.
  void mark_around(const Vec3& x);
  MeshDistance exact_;
  DenseGrid grid_;
  double inverse_spacing_ = 0;  // 1/m
  // Number of the last node along each axis.
  Vec3 last_ = Vec3::Zero();
  Eigen::AlignedBox3d bounds_;
  double bounding_radius_ = 0, thickness_ = 0;
  // For each cell, by the index of its first node, whether its distances are exact; empty if all are
  // interpolated.
  std::vector<char> is_exact_;
};

}  // namespace duet
