// Small scenes that are built in code, so that a test reads in a few lines. Lengths are in m, masses in kg.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sim/scene/plan.h"
#include "sim/scene/scene.h"
#include "sim/simulation/simulation.h"
#include "sim/state/bodies.h"

namespace duet::test {

// Returns an empty scene without gravity and without ground.
scene::Scene free_space();

// Returns a scene with gravity and a ground at y = 0 with the given coefficients.
scene::Scene on_ground(double friction = 0.5, double restitution = 0);

// Adds a box with the edges `size`, centered at `position`. References that these functions return are valid
// until the next body is added.
scene::RigidBody& add_box(scene::Scene& scene, std::string_view name, const Vec3& position, const Vec3& size,
                          double mass);

// Adds a mesh at the origin, its lengths multiplied by `scale`.
scene::RigidBody& add_mesh(scene::Scene& scene, std::string_view name, std::shared_ptr<TriangleMesh> mesh,
                           double scale, double mass);

// Adds a ball centered at `position`.
scene::RigidBody& add_ball(scene::Scene& scene, std::string_view name, const Vec3& position, double radius,
                           double mass);

// Adds a deformable box of `cells` x `cells` x `cells` lattice cells, with a material of its own.
// `youngs_modulus` is in Pa.
scene::DeformableBody& add_soft_box(scene::Scene& scene, std::string_view name, const Vec3& position,
                                    const Vec3& size, int cells, double youngs_modulus = 2e6);

// Returns the center of mass (m) of deformable body `index`.
Vec3 center_of(const Bodies& bodies, std::size_t index);

// Returns the index of `name` in `names`. Throws std::out_of_range with the name if it is not there, so that
// a test with a misspelled name fails.
std::size_t index_of_name(const std::vector<std::string>& names, const std::string& name);

// Returns the effects that the scene needs.
EffectSet plan(const scene::Scene& scene);

}  // namespace duet::test
