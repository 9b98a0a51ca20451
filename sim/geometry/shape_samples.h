// Points on the surface of a rigid body that are tested against other bodies' level sets.
#pragma once

#include <vector>

#include "sim/geometry/level_set.h"
#include "sim/geometry/triangle_mesh.h"

namespace duet {

// What is used unless a scene says otherwise: 8 intervals along the edge of a cube of the same volume.
double default_sample_spacing(double volume);  // m

// Corners, rims and poles, and points on edges and faces whose neighbours are no farther apart than
// `spacing`. Spheres have none: their deepest point is known (see contact_candidates.h).
std::vector<Vec3> surface_samples(const LevelSet& shape, double spacing);

// The same for a closed mesh: no point of it is farther than `spacing` from a sample. Of vertices that are
// closer together than that and face the same way, the sharper ones are kept.
std::vector<Vec3> surface_samples(const TriangleMesh& mesh, double spacing);

// For every sample a point of the body a quarter of its thickness away, inwards: against the mean of the
// normals around the sample, so from an edge or a corner along its bisector. It tells on which side of
// another body the sample's body lies.
std::vector<Vec3> points_inside(const LevelSet& shape, const std::vector<Vec3>& samples);

}  // namespace duet
