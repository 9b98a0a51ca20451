// Texture coordinates of surfaces.
#pragma once

#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// Returns texture coordinates for a point on a face with the given normal if nothing better is known: its
/// two coordinates (m) across the dominant axis of the normal.
Vec2f planar_uv(const Vec3& x, const Vec3& normal);

/// Gives `surface` the texture coordinates of a mesh that lies in about the same place and has some: those of
/// the nearest points of the mesh. A triangle that reaches across a seam, where texture coordinates jump,
/// extends the texture found below its middle.
void transfer_texture(const TriangleMesh& mesh, Surface& surface);

}  // namespace duet
