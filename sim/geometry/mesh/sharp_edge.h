// The angle from which on an edge of a mesh counts as sharp, for all code that treats sharp edges separately.
#pragma once

namespace duet {

/// An edge is sharp if the cosine of the angle between the normals of its faces is below this value, which is
/// that of 30 degrees. Smaller angles occur between the facets of round bodies.
inline constexpr double sharp_edge = 0.866;

}  // namespace duet
