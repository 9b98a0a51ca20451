#include "sim/geometry/mesh/tet_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

// Tets per chunk of a parallel loop.
constexpr std::size_t grain = 1024;

// The corner positions of a tet, m.
struct Corners {
  std::array<Vec3, 4> x;
  Corners(const TetMesh& mesh, const Tet& tet) {
    for (std::size_t i = 0; i < 4; ++i) x[i] = mesh.nodes[static_cast<std::size_t>(tet[i])];
  }
  double volume() const { return tet_volume(x[0], x[1], x[2], x[3]); }

  // Returns outward normals of the faces opposite to each corner, twice as long as their areas.
  std::array<Vec3, 4> face_normals() const {
    const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
    const Vec3 at_1 = c.cross(b), at_2 = a.cross(c), at_3 = b.cross(a);
    return {-(at_1 + at_2 + at_3), at_1, at_2, at_3};
  }
};

// Updates `quality` with one tet.
void include(TetQuality& quality, const TetMesh& mesh, const Tet& tet) {
  const Corners corners(mesh, tet);
  quality.volume += corners.volume();
  quality.min_altitude = std::min(quality.min_altitude, min_altitude(mesh, tet));
  for (const double angle : dihedral_angles(mesh, tet)) {
    quality.min_angle = std::min(quality.min_angle, angle);
    quality.max_angle = std::max(quality.max_angle, angle);
    ++quality.angles[std::min<std::size_t>(static_cast<std::size_t>(angle / 10), quality.angles.size() - 1)];
  }
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double length = (corners.x[i] - corners.x[j]).norm();
      quality.shortest_edge = std::min(quality.shortest_edge, length);
      quality.longest_edge = std::max(quality.longest_edge, length);
    }
}

// Returns the quality of two disjoint sets of tets together.
TetQuality joined(TetQuality a, const TetQuality& b) {
  a.volume += b.volume;
  a.min_angle = std::min(a.min_angle, b.min_angle);
  a.max_angle = std::max(a.max_angle, b.max_angle);
  a.min_altitude = std::min(a.min_altitude, b.min_altitude);
  a.shortest_edge = std::min(a.shortest_edge, b.shortest_edge);
  a.longest_edge = std::max(a.longest_edge, b.longest_edge);
  for (std::size_t i = 0; i < a.angles.size(); ++i) a.angles[i] += b.angles[i];
  return a;
}

}  // namespace

std::array<double, 6> dihedral_angles(const TetMesh& mesh, const Tet& tet) {
  const std::array<Vec3, 4> normals = Corners(mesh, tet).face_normals();
  std::array<double, 6> angles{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      // The dihedral angle and the angle between the outward normals add up to 180 degrees. atan2 keeps its
      // accuracy for flat tets, where the arc cosine loses half of the digits.
      const double between = math::atan2(normals[i].cross(normals[j]).norm(), normals[i].dot(normals[j]));
      angles[next++] = 180 - between * 180 / std::numbers::pi;
    }
  return angles;
}

bool has_dihedral_angles_within(const TetMesh& mesh, const Tet& tet, double least, double largest) {
  DUET_ASSERT(least <= largest);
  const double above = math::cos(least * std::numbers::pi / 180),
               below = math::cos(largest * std::numbers::pi / 180);
  const std::array<Vec3, 4> normals = Corners(mesh, tet).face_normals();
  std::array<double, 4> lengths{};
  for (std::size_t i = 0; i < 4; ++i) lengths[i] = normals[i].norm();
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double cosine = -normals[i].dot(normals[j]), scale = lengths[i] * lengths[j];
      if (cosine > above * scale || cosine < below * scale) return false;
    }
  return true;
}

double min_altitude(const TetMesh& mesh, const Tet& tet) {
  const Corners corners(mesh, tet);
  double squared = 0;  // square of twice the largest area of a face, m^4
  for (const Vec3& normal : corners.face_normals()) squared = std::max(squared, normal.squaredNorm());
  return 6 * corners.volume() / std::sqrt(squared);
}

TetQuality tet_quality(const TetMesh& mesh) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  TetQuality none;
  none.min_angle = none.min_altitude = none.shortest_edge = infinity;
  TetQuality quality = parallel_reduce(
      mesh.tets.size(), grain, none,
      [&](std::size_t begin, std::size_t end) {
        TetQuality part = none;
        for (std::size_t t = begin; t < end; ++t) include(part, mesh, mesh.tets[t]);
        return part;
      },
      joined);
  if (mesh.tets.empty()) quality = {};
  quality.nodes = mesh.nodes.size();
  quality.tets = mesh.tets.size();
  return quality;
}

}  // namespace duet
