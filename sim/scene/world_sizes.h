// Holds the sizes of a scene's world, as `duet explain` prints them.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/scene/build/initial_overlaps.h"

namespace duet {

/// Size of the level set that all bodies of one mesh at one scale share.
struct GridSize {
  std::string body;             ///< Name of the first of these bodies.
  int bodies = 0;               ///< Number of these bodies.
  Vec3i nodes = Vec3i::Zero();  ///< Nodes of the grid along each axis.
  double spacing = 0;           ///< Distance of the nodes, m.
  double thickness = 0;         ///< Diameter of the largest ball inside the mesh, m.
};
/// Size of the tetrahedral mesh that all bodies of one shape share.
struct TetSize {
  std::string body;         ///< Name of the first of these bodies.
  int bodies = 0;           ///< Number of these bodies.
  int tets = 0;             ///< Number of tetrahedra.
  double min_altitude = 0;  ///< Smallest altitude of a tetrahedron, m; it bounds the time step.
  double min_angle = 0,     ///< Smallest dihedral angle of a tetrahedron, degrees.
      max_angle = 0;        ///< Largest dihedral angle of a tetrahedron, degrees.
};
/// Size of a skin that is drawn in place of the boundary of the tetrahedra, while that boundary is in
/// contact.
struct SkinSize {
  std::string body;    ///< Name of the first of the bodies with equal sizes.
  int bodies = 0;      ///< Number of these bodies.
  int triangles = 0;   ///< Number of triangles.
  double outside = 0;  ///< Largest distance outside the tetrahedra, m: it may be drawn this deep in others.
  double inside = 0;   ///< Largest depth below their boundary, m: a gap this wide may be drawn.
  double extent = 0;   ///< Longest edge of the axis-aligned box around the skin at rest, m.
};
/// A bone that can turn without moving its flesh, because the particles that it holds lie on one line.
struct LooseBone {
  std::string bone,   ///< Name of the rigid body.
      flesh;          ///< Name of the deformable body.
  int particles = 0;  ///< Number of particles that it holds.
};
/// Sizes of a world that has been built, its time step and the stages that it runs.
struct WorldSizes {
  int rigid_dynamic = 0,        ///< Number of dynamic rigid bodies.
      rigid_kinematic = 0,      ///< Number of kinematic rigid bodies.
      rigid_static = 0,         ///< Number of static rigid bodies, with the ground.
      deformable = 0;           ///< Number of deformable bodies.
  int thin = 0;                 ///< Number of deformable bodies with a thickness: shells, rods and particles.
  int particles = 0,            ///< Number of particles.
      tets = 0,                 ///< Number of finite elements (tetrahedra).
      surface_triangles = 0;    ///< Number of triangles on the contact surfaces of deformable bodies.
  int rigid_samples = 0;        ///< Number of sample points on the surfaces of rigid bodies.
  int face_samples = 0;         ///< Number of contact points on deformable faces and edges, without vertices.
  double lightest = 0,          ///< Mass of the lightest dynamic or deformable body, kg; 0: there is none.
      heaviest = 0;             ///< Mass of the heaviest dynamic or deformable body, kg; 0: there is none.
  std::vector<GridSize> grids;  ///< Level sets of meshes.
  std::vector<TetSize> tet_meshes;     ///< Tetrahedral meshes.
  std::vector<LooseBone> loose_bones;  ///< Bones that hold particles of a flesh on one line only.
  std::vector<SkinSize> skins;         ///< Skins that are drawn but not in contact.
  double elastic_dt = 0;               ///< Elastic stability limit of the time step at rest, s; 0: none.
  double undamped_elastic_dt = 0;   ///< The same limit without the effect of damping (solver.relaxation), s.
  double time_step = 0;             ///< Largest time step that the rule allows in the current state, s.
  std::string time_step_bound;      ///< What bounds `time_step`, such as "the turn of `bar`".
  std::vector<std::string> stages;  ///< Labels of the stages that run, in order (sim/step/stage_table.h).
  std::vector<InitialOverlap> initial_overlaps;  ///< Pairs of bodies that overlap at frame 0.
};

}  // namespace duet
