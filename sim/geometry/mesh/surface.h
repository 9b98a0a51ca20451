// A triangle surface as it is drawn and exported: shared positions, with normals and texture coordinates
// indexed apart, so that a box has sharp edges and stays one closed mesh. Topology never changes during a
// run.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/base/types.h"

namespace duet {

struct Corner {  // indices into positions, uvs and normals
  int position = 0, uv = 0, normal = 0;
};

struct Surface {
  std::vector<Vec3> positions;  // m; doubles, because far from the origin floats are too coarse
  std::vector<Vec3f> normals;   // unit, outward
  std::vector<Vec2f> uvs;
  std::vector<std::array<Corner, 3>> triangles;  // counter-clockwise seen from outside
  std::vector<float>
      strain{};  // of the positions, see FiniteElements::add_strain; empty where nothing deforms
};

}  // namespace duet
