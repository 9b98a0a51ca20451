// The level set of a mesh: a grid of exact distances, interpolated between its nodes. Far from the mesh,
// where there is no grid, the nearest triangle is searched for, so that distances are exact there as well and
// no bound that is drawn from them misses a contact. So it is around walls that are thinner than one and a
// half cells, which have no node in their middle: interpolated, they would not be there; and near sharp
// edges, along which interpolation is off by a part of a cell.
#pragma once

#include "sim/geometry/level_set/dense_grid.h"
#include "sim/geometry/level_set/mesh_distance.h"

namespace duet {

class GridLevelSet {
 public:
  // Of a closed mesh with triangles facing outward, in body space; `cells` along its longest extent. What is
  // filled with elements takes its sharp edges rounded, as they are interpolated: these cut no slivers.
  enum class SharpEdges { exact, rounded };
  GridLevelSet(const TriangleMesh& mesh, int cells, SharpEdges sharp_edges = SharpEdges::exact);

  double distance(const Vec3& x) const;  // m, trilinear
  // Whether x is in a cell whose distances are not interpolated, as around sharp edges.
  bool is_exact(const Vec3& x) const;
  Vec3 normal(const Vec3& x) const;  // unit, along the gradient of the trilinear interpolant

  double bounding_radius() const { return bounding_radius_; }  // m, about the origin
  const Vec3& lower() const { return bounds_.min(); }          // m, of the mesh
  const Vec3& upper() const { return bounds_.max(); }
  // m, of the thinnest wall if any is thinner than one and a half cells, else the diameter of the largest
  // ball inside
  double thickness() const { return thickness_; }
  const MeshDistance& exact() const { return exact_; }
  const DenseGrid& grid() const { return grid_; }

 private:
  bool inside_grid(const Vec3& local) const;
  // Whether distances in the cell around a place in the grid, in units of cells, are not interpolated.
  bool is_exact_at(const Vec3& local) const;
  void find_thin_walls(const TriangleMesh& mesh);
  void find_creases(const TriangleMesh& mesh);
  void mark_around(const Vec3& x);
  MeshDistance exact_;
  DenseGrid grid_;
  double inverse_spacing_ = 0;
  Vec3 last_ = Vec3::Zero();  // the last node along each axis
  Eigen::AlignedBox3d bounds_;
  double bounding_radius_ = 0, thickness_ = 0;
  std::vector<char>
      is_exact_;  // of every cell, by the number of its first node; empty where all are interpolated
};

}  // namespace duet
