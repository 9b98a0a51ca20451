// A stack of soft and rigid boxes in contact, to test operators on random vectors.
#pragma once

#include <random>

#include "tests/support/scenes.h"

#include "sim/contact/response/contact_projection.h"
#include "sim/step/step.h"

namespace duet::test {

// Returns a stack on the ground: soft, rigid, soft, rigid from below. Neighbors overlap by a millimeter, so
// that all touch.
inline scene::Scene small_stack() {
  scene::Scene scene = on_ground(0.4);
  add_soft_box(scene, "soft1", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  add_box(scene, "box2", Vec3(0.05, 1.499, 0), Vec3(1, 1, 1), 700).friction = 0.4;
  add_soft_box(scene, "soft3", Vec3(0, 2.498, 0.03), Vec3(1, 1, 1), 2);
  add_box(scene, "box4", Vec3(0, 3.497, 0), Vec3(1, 1, 1), 900).friction = 0.4;
  return scene;
}

// Returns velocities with components in [-1, 1] (m/s, rad/s); those of static and kinematic bodies are zero.
inline GeneralizedVelocity random_velocity(const Bodies& bodies, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] {
    Vec3 v;
    for (int axis = 2; axis >= 0; --axis) v[axis] = uniform(random);
    return v;
  };
  GeneralizedVelocity v;
  for (std::size_t i = 0; i < bodies.particles.size(); ++i) v.particle.push_back(vector());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const bool moves = bodies.rigid.properties[i].is_dynamic();
    v.linear.push_back(moves ? vector() : Vec3::Zero());
    v.angular.push_back(moves ? vector() : Vec3::Zero());
  }
  return v;
}

// Returns velocities that are all zero.
inline GeneralizedVelocity no_velocity(const Bodies& bodies) {
  return {std::vector<Vec3>(bodies.particles.size(), Vec3::Zero()),
          std::vector<Vec3>(bodies.rigid.size(), Vec3::Zero()),
          std::vector<Vec3>(bodies.rigid.size(), Vec3::Zero())};
}

}  // namespace duet::test
