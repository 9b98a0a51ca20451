// Sample points on the surface of a rigid body, which are tested against the level sets of other bodies.
#pragma once

#include <array>
#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// Returns the sample spacing (m) for a body of the given volume (m^3), if a scene does not state one: an
/// eighth of the edge of a cube of the same volume.
double default_sample_spacing(double volume);

/// Returns about how many samples, and nodes of feature edges, a shape with a formula has, without making
/// them.
double estimated_samples(const LevelSet& shape, double spacing);

/// Returns about how many samples a closed mesh of the given surface area (m^2) has, without making them.
double estimated_samples(double area, double spacing);

/// Returns the samples of a shape with a formula (m, body space). Boxes have their corners and points on
/// edges and faces; cylinders have points on their caps and rims; tori have points everywhere. Neighbors are
/// no farther apart than `spacing` (m), on round bodies also no farther than a 24th of the widest ring. On
/// the edges of a box they are also no farther apart than its smallest extent, down to an eighth of
/// `spacing`. Spheres and capsules have no samples, and cylinders have none between their rims: contacts
/// there are found as support points of the shape or as points and edges of the other body.
std::vector<Vec3> surface_samples(const LevelSet& shape, double spacing);

/// Returns the samples of a closed mesh (m). Candidates are its vertices, then points on its edges, then
/// points on its faces, sharper vertices and edges first. Of candidates that are closer together than 0.7
/// spacings or less and face the same way, the first one is kept. No point of the surface is farther than
/// `spacing` (m) from a sample, except beside sharp edges that go inward, which have no samples of their own.
std::vector<Vec3> surface_samples(const TriangleMesh& mesh, double spacing);

/// A sample of a mesh.
struct MeshSample {
  Vec3 position;                          ///< m.
  std::array<int, 3> corner{-1, -1, -1};  ///< Vertices of the mesh: itself, the ends of its edge, or the
                                          ///< corners of its face; -1 after the last.
};
/// Returns the samples of surface_samples(), and where on the mesh they are.
std::vector<MeshSample> mesh_samples(const TriangleMesh& mesh, double spacing);

/// Returns for each sample whether the surface is flat around it, so that it lies in a face and not on an
/// edge or a bend.
std::vector<char> on_flat_faces(const LevelSet& shape, const std::vector<Vec3>& samples);

/// Returns for each sample a point of the body that lies a quarter of its smallest size inward (m). The
/// direction is opposite to the mean of the normals around the sample, which is along the bisector at an edge
/// or a corner. These points tell on which side of another body the body of the sample lies.
std::vector<Vec3> points_inside(const LevelSet& shape, const std::vector<Vec3>& samples);

}  // namespace duet
