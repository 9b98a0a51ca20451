#include "sim/scene/build/attachments.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::scene {
namespace {

// The rigid body that holds a point.
struct Holder {
  std::size_t place = 0;  // index in the list of names; their number if nothing holds the point
  std::size_t body = 0;   // number of the rigid body
};

// Finds the first of the named rigid bodies that the point `x` (m, world space) lies inside of.
Holder find_holder(const std::vector<std::string>& names, const Vec3& x, const RigidBodies& rigid) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto body = static_cast<std::size_t>(std::find(rigid.name.begin(), rigid.name.end(), names[i]) -
                                               rigid.name.begin());
    if (rigid.properties[body].shape.distance(shape_pose(rigid, body).to_body(x)) < 0) return {i, body};
  }
  return {names.size(), 0};
}

// Makes the particle move with the rigid body. A dynamic body carries its mass, see take_over_masses(); with
// any other body the particle loses its inverse mass.
void hold(std::size_t particle, std::size_t body, Bodies& bodies) {
  RigidBodies& rigid = bodies.rigid;
  Particles& particles = bodies.particles;
  if (rigid.properties[body].is_dynamic()) {
    bodies.bound.push_back(embed_particle(particle, body, rigid, particles));
    particles.v[particle] = point_velocity(rigid.state[body], bodies.bound.back().offset);
  } else {
    particles.inverse_mass[particle] = 0;
    particles.v[particle].setZero();
    prescribe_particle(rigid.name[body], static_cast<int>(particle), bodies);
  }
}

// Holds the particle to the rigid body by a zero-length spring to an anchor, a new particle without mass that
// moves with the body. Stiffness gain * m (N/m) and damping 2 damping sqrt(gain) m (kg/s) follow from its
// mass m.
void add_soft_binding(std::size_t particle, std::size_t body, const AttachSprings& springs, Bodies& bodies) {
  Particles& particles = bodies.particles;
  const std::size_t anchor = particles.size();
  const Vec3 x = particles.x[particle];
  particles.x.push_back(x);
  particles.v.push_back(Vec3::Zero());
  particles.mass.push_back(0);
  particles.inverse_mass.push_back(0);
  hold(anchor, body, bodies);
  if (bodies.rigid.properties[body].is_dynamic()) bodies.bound.back().at = particle;
  const double mass = particles.mass[particle];
  bodies.forces.zero_length_springs.add({static_cast<int>(particle), static_cast<int>(anchor),
                                         springs.gain * mass,
                                         2 * springs.damping * std::sqrt(springs.gain) * mass});
}

}  // namespace

void prescribe_particle(const std::string& carrier, int particle, Bodies& bodies) {
  const std::vector<KinematicBody>& kinematic = bodies.rigid.kinematic;
  const auto found = std::find_if(kinematic.begin(), kinematic.end(), [&](const KinematicBody& body) {
    return bodies.rigid.name[body.body] == carrier;
  });
  if (found == kinematic.end()) return;
  const RigidState& state = bodies.rigid.state[found->body];
  const Vec3& x = bodies.particles.x[as_index(particle)];
  bodies.particles.v[as_index(particle)] = point_velocity(state, x - state.pose.position);
  bodies.carried.push_back(
      {particle, static_cast<std::size_t>(found - kinematic.begin()), state.pose.to_body(x)});
}

std::size_t attach(const std::vector<std::string>& names, std::size_t particle, Bodies& bodies) {
  const Holder holder = find_holder(names, bodies.particles.x[particle], bodies.rigid);
  if (holder.place < names.size()) hold(particle, holder.body, bodies);
  return holder.place;
}

void check_attached(const DeformableBody& description, const std::vector<int>& held) {
  for (std::size_t i = 0; i < description.attach.size(); ++i)
    if (held[i] == 0)
      throw Error(
          ExitStatus::usage,
          fmt::format(
              "deformable.{}.attach: no particle lies inside of `{}`; move one of the two, or make the "
              "tetrahedra finer",
              description.name, description.attach[i]));
}

void add_soft_bindings(const Scene& scene, Bodies& bodies) {
  for (std::size_t d = 0; d < scene.deformable.size(); ++d) {
    const DeformableBody& description = scene.deformable[d];
    if (!description.attach_springs || description.attach.empty()) continue;
    std::vector<int> held(description.attach.size() + 1, 0);
    const int first = bodies.deformable[d].first_particle;
    for (int p = first; p < first + bodies.deformable[d].particle_count; ++p) {
      if (is_held(bodies.particles, as_index(p))) continue;
      const Holder holder = find_holder(description.attach, bodies.particles.x[as_index(p)], bodies.rigid);
      ++held[holder.place];
      if (holder.place < description.attach.size())
        add_soft_binding(as_index(p), holder.body, *description.attach_springs, bodies);
    }
    check_attached(description, held);
  }
}

}  // namespace duet::scene
