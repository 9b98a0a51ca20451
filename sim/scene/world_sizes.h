// How much a scene holds, as `duet explain` prints it.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/scene/build/initial_overlaps.h"

namespace duet {

struct GridSize {    // of a level set that bodies of one mesh share
  std::string body;  // the first of them
  int bodies = 0;
  Vec3i nodes = Vec3i::Zero();
  double spacing = 0;    // m
  double thickness = 0;  // m, diameter of the largest ball inside
};
struct TetSize {     // of the tets that bodies of one shape share
  std::string body;  // the first of them
  int bodies = 0;
  int tets = 0;
  double smallest_altitude = 0;               // m, bounds the time step
  double least_angle = 0, largest_angle = 0;  // degrees, between two faces of a tet
};
struct SkinSize {    // of a surface that is drawn in place of the tets' boundary, which touches
  std::string body;  // the first of those that are alike
  int bodies = 0;
  int triangles = 0;
  double outside = 0;  // m, the farthest that it lies out of the tets: so deep it may be drawn in others
  double inside = 0;   // m, the farthest that it lies below their boundary: so wide a gap may be drawn
  double extent = 0;   // m, the longest edge of the box around it
};
struct WorldSizes {
  int rigid_dynamic = 0, rigid_kinematic = 0, rigid_static = 0, deformable = 0;
  int thin = 0;  // of the deformable ones: sheets and rods
  int particles = 0, tets = 0, surface_triangles = 0;
  int rigid_samples = 0;              // surface sample points of rigid bodies
  int face_samples = 0;               // contact points on deformable faces and edges, vertices not counted
  double lightest = 0, heaviest = 0;  // kg, of the dynamic bodies
  std::vector<GridSize> grids;
  std::vector<TetSize> tet_meshes;
  std::vector<SkinSize> skins;      // without contact of their own
  double elastic_dt = 0;            // s, the elastic bound on the time step at rest (0: no deformable body)
  double undamped_elastic_dt = 0;   // s, the same if damping did not lift it (solver.relaxation)
  double time_step = 0;             // s, the longest that the rule allows now
  std::string time_step_bound;      // what bounds it, in words
  std::vector<std::string> stages;  // labels of those of a step, in their order (sim/step/stage_table.h)
  std::vector<InitialOverlap> initial_overlaps;
};

}  // namespace duet
