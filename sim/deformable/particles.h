// The particles of all deformable bodies, stored by use.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct Particles {
  std::vector<Vec3> x;               // m
  std::vector<Vec3> v;               // m/s
  std::vector<double> mass;          // kg
  std::vector<double> inverse_mass;  // 1/kg
  std::size_t size() const { return x.size(); }
};

// Whether a pin holds the particle: no force moves it.
inline bool is_held(const Particles& particles, std::size_t p) { return particles.inverse_mass[p] == 0; }

// A point of a deformable body that can touch others: a particle, or a point on a boundary edge or face that
// moves with up to four particles by barycentric weights. An impulse on it is spread by the weights, so that
// linear and angular momentum are kept exactly.
struct SurfacePoint {
  std::array<int, 4> particle{0, 0, 0, 0};
  std::array<double, 4> weight{1, 0, 0, 0};
  int count = 1;            // particles that carry it
  double inverse_mass = 0;  // 1/kg, sum of weight^2 / mass
  // m, depth at which it starts to act: keeps face samples out of flat contact that vertices carry, and is
  // negative where a body has a thickness around its particles.
  double allowance = 0;
};

// An edge of the boundary, which sharp edges of rigid bodies can cross anywhere between its surface points.
struct BoundaryEdge {
  std::array<int, 2> particle{0, 0};
  double allowance = 0;  // m, as of a SurfacePoint
};

// One deformable body: ranges of the shared arrays.
struct DeformableBody {
  std::string name;
  int first_particle = 0, particle_count = 0;
  int first_tet = 0, tet_count = 0;
  int first_point = 0,
      point_count = 0;   // surface points: boundary particles first, then face and edge samples
  int sample_count = 0;  // of the points, those that are no particle
  int first_triangle = 0, triangle_count = 0;  // of the boundary; of a shell, all of it from its front
  int first_segment = 0, segment_count = 0;    // of a rod
  double mass = 0;                             // kg, of its particles
  double thickness = 0;                        // m, of shells and rods: contact is half of it away
  double air_drag = 0;                         // 1/m, deceleration over the square of the speed
  int first_edge = 0, edge_count = 0;          // of the boundary edges
  int parts_per_edge = 0;                      // that surface points divide each of them into
  double element_size = 0;  // m, mean length of the edges of its boundary or of its segments, at rest
};

template <class Work>
void for_each_particle(const DeformableBody& body, Work&& work) {
  const auto first = static_cast<std::size_t>(body.first_particle);
  for (std::size_t p = first; p < first + static_cast<std::size_t>(body.particle_count); ++p) work(p);
}

inline Vec3 weighted(const SurfacePoint& point, const std::vector<Vec3>& values) {
  Vec3 sum = point.weight[0] * values[static_cast<std::size_t>(point.particle[0])];
  for (std::size_t i = 1; i < static_cast<std::size_t>(point.count); ++i)
    sum += point.weight[i] * values[static_cast<std::size_t>(point.particle[i])];
  return sum;
}

inline void apply_impulse(const SurfacePoint& point, const Vec3& impulse, Particles& particles) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(point.count); ++i) {
    const auto p = static_cast<std::size_t>(point.particle[i]);
    particles.v[p] += point.weight[i] * particles.inverse_mass[p] * impulse;
  }
}

}  // namespace duet
