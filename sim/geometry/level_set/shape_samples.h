// Points on the surface of a rigid body that are tested against other bodies' level sets.
#pragma once

#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// What is used unless a scene says otherwise: 8 intervals along the edge of a cube of the same volume.
double default_sample_spacing(double volume);  // m

// Corners and rims, and points on edges and flat faces whose neighbors are no farther apart than `spacing`,
// on the edges of boxes also no farther than these are thin (down to an eighth of the spacing), and on the
// whole of a torus. Spheres and capsules have none, cylinders none between their rims: what touches there is
// found as the deepest point of the shape (see deepest_point.h), or as a point or edge of the other body.
std::vector<Vec3> surface_samples(const LevelSet& shape, double spacing);

// The same for a closed mesh: no point of it is farther than `spacing` from a sample. Of vertices that are
// closer together than that and face the same way, the sharper ones are kept.
std::vector<Vec3> surface_samples(const TriangleMesh& mesh, double spacing);

// Whether the surface is flat around a sample: it lies in a face, not on an edge or on a bend.
std::vector<char> on_flat_faces(const LevelSet& shape, const std::vector<Vec3>& samples);

// For every sample a point of the body a quarter of its thickness away, inwards: against the mean of the
// normals around the sample, so from an edge or a corner along its bisector. It tells on which side of
// another body the sample's body lies.
std::vector<Vec3> points_inside(const LevelSet& shape, const std::vector<Vec3>& samples);

}  // namespace duet
