// Texture coordinates of surfaces.
#pragma once

#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// Of a point on a face with the given normal, where nothing better is known: the metres across the normal's
// dominant axis.
Vec2f planar_uv(const Vec3& x, const Vec3& normal);

// Gives `surface` the texture coordinates of a mesh that lies where it lies, more or less: those of the
// nearest points. A triangle that reaches across a seam, where they jump, goes on beyond it as the mesh does
// below its middle.
void transfer_texture(const TriangleMesh& mesh, Surface& surface);

}  // namespace duet
