// The rule for the time step, and the check that every step ends with.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Elements that a blow has almost crushed are not followed below this part of the step at rest: their stress
// is bounded (neo_hookean.h) and the implicit damping holds them.
constexpr double least_elastic_share = 1.0 / 8;

// 2/omega_max is the stability limit of the scheme for undamped elasticity (its amplification matrix is that
// of leapfrog).
double elastic_limit(const World& world) {
  if (!world.has(Effect::deformable_elasticity)) return std::numeric_limits<double>::infinity();
  const FiniteElements& elements = world.bodies.elements;
  const double now = 2 / std::sqrt(elements.max_squared_frequency());
  const double at_rest = 2 / std::sqrt(elements.rest_squared_frequency());
  return std::clamp(now, least_elastic_share * at_rest, at_rest);
}

// What the travel of rigid bodies is a fraction of, m: the smallest dynamic body, which is what a fast one
// could miss; without any, the smallest kinematic one.
double travel_scale(const RigidBodies& rigid) {
  double dynamic = std::numeric_limits<double>::infinity(), kinematic = dynamic;
  for (const RigidProperties& properties : rigid.properties) {
    if (!properties.moves()) continue;
    double& smallest = properties.is_dynamic() ? dynamic : kinematic;
    smallest = std::min(smallest, properties.shape.smallest_size());
  }
  return std::isfinite(dynamic) ? dynamic : kinematic;
}

double rigid_limit(const World& world, double time) {
  const RigidBodies& rigid = world.bodies.rigid;
  const StepSettings& settings = world.settings;
  const double size = travel_scale(rigid);
  double limit = std::numeric_limits<double>::infinity();
  const auto bound = [&](std::size_t body, double speed, double spin, double phase) {
    const double travel = speed + rigid.properties[body].shape.bounding_radius() * spin;
    if (travel > 0) limit = std::min(limit, settings.max_travel * size / travel);
    if (spin > 0 || phase > 0) limit = std::min(limit, settings.max_rotation / std::max(spin, phase));
  };
  for (std::size_t i = 0; i < rigid.size(); ++i)
    if (rigid.properties[i].is_dynamic())
      bound(i, rigid.state[i].velocity.norm(), rigid.state[i].angular_velocity.norm(), 0);
  for (const KinematicBody& kinematic : rigid.kinematic) {
    const MotionBounds bounds = motion_bounds(kinematic.motion, time, time + settings.max_time_step);
    bound(kinematic.body, bounds.speed, bounds.spin, bounds.phase);
  }
  return limit;
}

[[noreturn]] void fail(const char* stage, const std::string& body, const std::string& element,
                       const Vec3& position, double value) {
  SimulationFault fault;
  fault.stage = stage;
  fault.body = body;
  fault.element = element;
  fault.position = position;
  fault.value = value;
  fault.bound = std::numeric_limits<double>::max();
  fault.cause = "the state stopped being finite: a time step too large for the material or the contact";
  fault.remedy = "lower solver.cfl or solver.max_travel";
  throw SimulationError(fault);
}

}  // namespace

double choose_time_step(const World& world, double time) {
  return std::min(
      {world.settings.cfl * elastic_limit(world), rigid_limit(world, time), world.settings.max_time_step});
}

void check_finite(const World& world, const char* stage) {
  const Bodies& bodies = world.bodies;
  for (const DeformableBody& body : bodies.deformable)
    for (int i = 0; i < body.particle_count; ++i) {
      const auto p = static_cast<std::size_t>(body.first_particle + i);
      const double sum = bodies.particles.x[p].sum() + bodies.particles.v[p].sum();
      if (!std::isfinite(sum))
        fail(stage, body.name, fmt::format("particle {}", i), world.context.x_n[p], sum);
    }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidState& state = bodies.rigid.state[i];
    const double sum = state.pose.position.sum() + state.pose.orientation.coeffs().sum() +
                       state.velocity.sum() + state.angular_momentum.sum();
    if (!std::isfinite(sum))
      fail(stage, bodies.rigid.name[i], {}, world.context.rigid_n[i].pose.position, sum);
  }
}

}  // namespace duet
