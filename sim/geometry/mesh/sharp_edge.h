// From which angle on an edge of a mesh is sharp, for all that treats such edges by themselves.
#pragma once

namespace duet {

/// Cosine of the angle between the faces' normals, at most: 30 degrees. Smaller angles are those of the
/// facets of round bodies.
inline constexpr double sharp_edge = 0.866;

}  // namespace duet
