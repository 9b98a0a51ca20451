// A triangle surface as it is drawn and exported. Positions are shared by triangles, while normals and
// texture coordinates have indices of their own, so that a box has sharp edges and is still one closed mesh.
// The topology never changes during a run.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/base/types.h"

namespace duet {

/// A corner of a triangle, as indices into the arrays of its Surface.
struct Corner {
  int position = 0,  ///< Index into Surface::positions.
      uv = 0,        ///< Index into Surface::uvs.
      normal = 0;    ///< Index into Surface::normals.
};

/// A triangle surface with normals and texture coordinates.
struct Surface {
  std::vector<Vec3> positions;  ///< Positions, m; doubles, because floats are too coarse far from the origin.
  std::vector<Vec3f> normals;   ///< Unit vectors, outward.
  std::vector<Vec2f> uvs;       ///< Texture coordinates.
  std::vector<std::array<Corner, 3>> triangles;  ///< Counter-clockwise seen from outside.
  /// The largest |stretch - 1| around each position (1), see FiniteElements::add_strain(); empty for surfaces
  /// of bodies that do not deform.
  std::vector<float> strain{};
  /// Values around each position, in their unit, if pictures are to show them as colors in place of strain;
  /// else empty.
  std::vector<float> shown{};
};

}  // namespace duet
