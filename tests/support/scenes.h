// Small scenes built in code, so that a test reads in a few lines.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "sim/scene/plan.h"
#include "sim/scene/scene.h"
#include "sim/simulation/simulation.h"

namespace duet::test {

// An empty scene without gravity and ground.
scene::Scene free_space();

scene::Scene on_ground(double friction = 0.5, double restitution = 0);

scene::RigidBody& add_box(scene::Scene& scene, std::string_view name, const Vec3& position, const Vec3& size,
                          double mass);

scene::RigidBody& add_mesh(scene::Scene& scene, std::string_view name, std::shared_ptr<TriangleMesh> mesh,
                           double scale, double mass);

scene::RigidBody& add_ball(scene::Scene& scene, std::string_view name, const Vec3& position, double radius,
                           double mass);

scene::DeformableBody& add_soft_box(scene::Scene& scene, std::string_view name, const Vec3& position,
                                    const Vec3& size, int cells, double youngs_modulus = 2e6);

EffectSet plan(const scene::Scene& scene);

}  // namespace duet::test
