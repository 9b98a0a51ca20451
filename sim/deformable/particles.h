// The particles of all deformable bodies, stored by use, and the ranges of them that the bodies own.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/base/assert.h"
#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// State of all particles, as a structure of arrays of equal length.
struct Particles {
  std::vector<Vec3> x;  ///< m, positions in the world
  std::vector<Vec3> v;  ///< m/s, velocities in the world
  /// kg; 0 if a dynamic rigid body has taken it over, and for anchors of zero-length springs
  std::vector<double> mass;
  std::vector<double> inverse_mass;  ///< 1/kg; 0 for a particle that no force moves
  /// Returns the number of particles.
  std::size_t size() const { return x.size(); }
};

/// Returns whether no force moves particle `p`: it is pinned, or a rigid body carries it.
inline bool is_held(const Particles& particles, std::size_t p) { return particles.inverse_mass[p] == 0; }

/// Point of a deformable body that can touch others: a particle, or a point on a boundary edge or face.
///
/// It moves with up to four particles by barycentric weights. An impulse on it is distributed by the weights,
/// so that linear and angular momentum are kept exactly.
struct SurfacePoint {
  std::array<int, 4> particle{0, 0, 0, 0};   ///< indices of the particles; the first `count` are in use
  std::array<double, 4> weight{1, 0, 0, 0};  ///< barycentric weights of the particles; they add up to 1
  int count = 1;                             ///< number of particles in use, 1 to 4
  double inverse_mass = 0;                   ///< 1/kg, sum of weight^2 / mass: the effective inverse mass
  /// m, contact offset: the depth below the other surface at which the point starts to act. A positive one
  /// keeps face samples out of flat contact that vertices carry; a negative one gives a body a thickness
  /// around its particles.
  double contact_offset = 0;
};

/// Edge of the boundary, which sharp edges of rigid bodies can cross anywhere between its surface points.
struct BoundaryEdge {
  std::array<int, 2> particle{0, 0};  ///< indices of the two end particles
  double contact_offset = 0;          ///< m, contact offset with the meaning of SurfacePoint::contact_offset
};

/// One deformable body: its ranges of the shared arrays, and its constants.
///
/// Its surface points are the boundary particles first, then samples on faces and edges. Its triangles are
/// counter-clockwise seen from outside, or from the front of a shell.
struct DeformableBody {
  std::string name;        ///< name in the scene
  int first_particle = 0,  ///< index of its first particle
      particle_count = 0;  ///< number of its particles
  int first_tet = 0,       ///< index of its first tetrahedron
      tet_count = 0;       ///< number of its tetrahedra; 0 for a shell or a rod
  int first_point = 0,     ///< index of its first surface point
      point_count = 0;     ///< number of its surface points
  int sample_count = 0;    ///< number of its surface points that are samples, not particles
  int first_triangle = 0,  ///< index of its first triangle
      triangle_count = 0;  ///< number of its triangles: the boundary of a volume, or all of a shell
  int first_segment = 0,   ///< index of its first segment
      segment_count = 0;   ///< number of its segments; 0 unless it is a rod
  double mass = 0;         ///< kg, sum over its particles
  /// m, of a shell, a rod or a single particle: contact begins half of it away; 0 for a volume
  double thickness = 0;
  double air_drag = 0;      ///< 1/m, deceleration by air over the square of the speed
  int first_edge = 0,       ///< index of its first boundary edge
      edge_count = 0;       ///< number of its boundary edges
  int parts_per_edge = 0;   ///< number of parts into which surface points divide each boundary edge
  double element_size = 0;  ///< m, mean length of its boundary edges or segments at rest
};

/// Calls work(index) for the particles of `body` in ascending order.
template <class Work>
void for_each_particle(const DeformableBody& body, Work&& work) {
  const auto first = static_cast<std::size_t>(body.first_particle);
  for (std::size_t p = first; p < first + static_cast<std::size_t>(body.particle_count); ++p) work(p);
}

/// Returns the weighted sum of per-particle `values` (positions, velocities) at a surface point.
inline Vec3 weighted(const SurfacePoint& point, const std::vector<Vec3>& values) {
  DUET_ASSERT(point.count >= 1 && point.count <= 4);
  Vec3 sum = point.weight[0] * values[static_cast<std::size_t>(point.particle[0])];
  for (std::size_t i = 1; i < static_cast<std::size_t>(point.count); ++i)
    sum += point.weight[i] * values[static_cast<std::size_t>(point.particle[i])];
  return sum;
}

/// Applies `impulse` (N s, world) to a surface point: adds weight times impulse over mass to the velocity of
/// each of its particles.
inline void apply_impulse(const SurfacePoint& point, const Vec3& impulse, Particles& particles) {
  DUET_ASSERT(point.count >= 1 && point.count <= 4);
  for (std::size_t i = 0; i < static_cast<std::size_t>(point.count); ++i) {
    const auto p = static_cast<std::size_t>(point.particle[i]);
    particles.v[p] += point.weight[i] * particles.inverse_mass[p] * impulse;
  }
}

}  // namespace duet
