#include "sim/scene/build/body_damping.h"

#include <cmath>
#include <numbers>

namespace duet::scene {
namespace {

// What springs do against a uniform stretch.
struct Stretching {
  double stiffness = 0,  // J, twice the energy over the squared strain
      viscosity = 0;     // J s, the power that damping takes over the squared rate of strain
};

// Returns what the edge springs of the last body do against a stretch along `axis`. They are the last ones.
Stretching stretching(const duet::DeformableBody& body, const Bodies& bodies, Eigen::Index axis) {
  const std::vector<Spring<2>>& springs = bodies.forces.edge_springs.all();
  const std::vector<Vec3>& x = bodies.particles.x;
  Stretching sum;
  for (auto spring = springs.rbegin(); spring != springs.rend() && spring->particle[0] >= body.first_particle;
       ++spring) {
    const Vec3 edge = x[as_index(spring->particle[0])] - x[as_index(spring->particle[1])];
    const double elongation = edge[axis] * edge[axis] / edge.norm();  // m, for a strain of 1
    sum.stiffness += spring->stiffness * elongation * elongation;
    sum.viscosity += spring->viscosity * elongation * elongation;
  }
  return sum;
}

// Returns the volume of a body at rest, m^3.
double rest_volume(const DeformableBody& description, const duet::DeformableBody& body,
                   const Bodies& bodies) {
  const std::vector<Vec3>& x = bodies.particles.x;
  double sum = 0;
  if (description.shape.is_volume()) {
    for (int t = body.first_tet; t < body.first_tet + body.tet_count; ++t)
      sum += bodies.forces.elements.volume(as_index(t));
    return sum;
  }
  for (int t = body.first_triangle; t < body.first_triangle + body.triangle_count; ++t) {
    const Triangle& triangle = bodies.triangles[as_index(t)];
    const Vec3& a = x[as_index(triangle[0])];
    sum += (x[as_index(triangle[1])] - a).cross(x[as_index(triangle[2])] - a).norm() / 2 * body.thickness;
  }
  for (int s = body.first_segment; s < body.first_segment + body.segment_count; ++s) {
    const std::array<int, 2>& ends = bodies.segments[as_index(s)];
    sum += (x[as_index(ends[0])] - x[as_index(ends[1])]).norm() * std::numbers::pi / 4 * body.thickness *
           body.thickness;
  }
  return sum;
}

}  // namespace

BodyDamping damping_of_last(const DeformableBody& description, const Material& material,
                            const Bodies& bodies) {
  const duet::DeformableBody& body = bodies.deformable.back();
  Eigen::AlignedBox3d box;
  double mass = 0;  // kg
  for_each_particle(body, [&](std::size_t p) {
    box.extend(bodies.particles.x[p]);
    mass += bodies.particles.mass[p];
  });
  Eigen::Index axis = 0;
  const double length = box.sizes().maxCoeff(&axis);
  if (!(length > 0)) return {0, material.damping};  // a single particle
  const double pace = std::numbers::pi / length;
  if (material.has_springs) {
    const Stretching springs = stretching(body, bodies, axis);
    if (!(springs.stiffness > 0 && mass > 0)) return {};
    return {pace * std::sqrt(springs.stiffness / mass), springs.viscosity / springs.stiffness};
  }
  const double volume = description.mass ? rest_volume(description, body, bodies) : 0;
  const double density = volume > 0 ? *description.mass / volume : material.density;
  return {pace * std::sqrt(material.youngs_modulus / density), material.damping};
}

}  // namespace duet::scene
