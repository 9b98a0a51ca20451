// The fully implicit form of the solve of I.1 and V.2 (paper section 3, after Baraff, Witkin 1998): Newton's
// method for V = v + dt M^-1 F(x^n + dt V, V), with dt half of the step. Where no contact interferes both
// stages find the same V, and the step is the implicit midpoint rule.
#include <cmath>

#include "sim/base/parallel.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

constexpr std::size_t grain = 2048;

// The conjugate gradients leave this share of the imbalance to the next iteration.
constexpr double forcing_share = 0.05;
// A correction is cut short where the imbalance along it has turned against it by more than this share of
// what it was.
constexpr double slope_share = 0.5;
constexpr double least_cut = 0.1;  // of one cut
constexpr int most_cuts = 10;
// The potential may not rise by more than damping can account for (the slope) and this share of itself: a
// correction that leads over a ridge of the energy is cut short, too.
constexpr double potential_slack = 1e-3;

// Viscosity over stiffness in units of the step, which brakes deformation alone: a mode that is much faster
// than the step shrinks by (1/2 - c) / (1/2 + c) a step, while the midpoint rule by itself would have it ring
// forever, and grow where a step turns a body far.
constexpr double numerical_damping = 0.25;

// A constraint may push what touches but not pull it: those that do are dropped, and the rest solved for
// again, so many times at most.
constexpr int most_releases = 8;

// context.unconstrained = v + dt M^-1 F - V and context.imbalance = P of it, m/s, with all forces at x^n + dt
// V, where the particles are then and the elements' state of deformation. context.force is left with the
// elastic forces and gravity.
void evaluate_imbalance(World& world, StepContext& context, const VelocitySystem& system, double dt) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const GeneralizedVelocity &V = context.solution, &v = context.right_side;
  GeneralizedVelocity& imbalance = context.imbalance;
  context.damping_force.assign(particles.size(), Vec3::Zero());
  parallel_for(particles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      particles.x[p] = context.x_n[p] + dt * V.particle[p];
      context.force[p] = particles.mass[p] * world.gravity;
    }
  });
  world.clock.time(Stage::elastic_forces,
                   [&] { bodies.forces.add_elastic_forces(particles.x, context.force); });
  bodies.forces.add_damping_forces(V.particle, context.damping_force);
  imbalance = V;  // its size
  parallel_for(particles.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      imbalance.particle[p] = v.particle[p] - V.particle[p] +
                              dt * particles.inverse_mass[p] * (context.force[p] + context.damping_force[p]);
  });
  for (std::size_t i = 0; i < V.linear.size(); ++i) {
    imbalance.linear[i] = v.linear[i] - V.linear[i];
    imbalance.angular[i] = v.angular[i] - V.angular[i];
  }
  for (const BoundParticle& bound : bodies.bound)
    context.damping_force[bound.particle] += context.force[bound.particle];
  add_force_twists(bodies.rigid, bodies.bound, context.damping_force, dt, imbalance.linear,
                   imbalance.angular);
  follow_twists(bodies.bound, imbalance.linear, imbalance.angular, imbalance.particle);
  context.unconstrained = imbalance;
  system.project(imbalance);
}

// Moves V along the correction: all the way, or to where the imbalance along it vanishes by the secant rule.
// That is the least of the energy which backward Euler minimizes along this line, as the imbalance is its
// negative gradient.
double search_line(World& world, StepContext& context, const VelocitySystem& system, double dt,
                   double start) {
  const double slope = system.inner(context.correction, context.imbalance);
  const double bound = start + slope + potential_slack * std::abs(start);
  double at = 0, next = 1, reached = start;
  for (int cut = 0; cut < most_cuts; ++cut) {
    VelocitySystem::axpy(next - at, context.correction, context.solution);
    at = next;
    evaluate_imbalance(world, context, system, dt);
    const double now = system.inner(context.correction, context.imbalance);
    reached = incremental_potential(world, context, dt);
    if (now >= -slope_share * slope && reached <= bound) break;
    const double secant = now < 0 ? slope / (slope - now) : 0;
    next = at * (secant > least_cut ? secant : least_cut);  // also where it is no number
  }
  return reached;
}

// Newton's method under the constraints as they are. Whether it has converged.
bool find_balance(World& world, StepContext& context, VelocitySystem& system, double dt) {
  const StepSettings& settings = world.settings;
  evaluate_imbalance(world, context, system, dt);
  double energy = incremental_potential(world, context, dt);
  for (int iteration = 0;; ++iteration) {
    const double imbalance = system.norm(context.imbalance);
    if (imbalance <= settings.cg_tolerance) return true;
    if (iteration >= settings.newton_iterations || !std::isfinite(imbalance)) return false;
    world.clock.time(Stage::damping_solve, [&] {
      world.bodies.forces.linearize();
      context.correction = context.imbalance;
      const CgResult result =
          conjugate_gradient(system, context.imbalance, forcing_share * imbalance, settings.cg_iterations,
                             context.correction, context.residual, context.direction, context.image);
      world.counters.cg_iterations += result.iterations;
    });
    energy = search_line(world, context, system, dt, energy);
    ++world.counters.newton_iterations;
  }
}

}  // namespace

double incremental_potential(World& world, const StepContext& context, double dt) {
  Particles& particles = world.bodies.particles;
  const double motion = parallel_reduce(
      particles.size(), grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t p = begin; p < end; ++p) {
          const Vec3& V = context.solution.particle[p];
          const Vec3 change = V - context.right_side.particle[p] - dt * world.gravity;
          sum += 0.5 * particles.mass[p] * change.squaredNorm();
          particles.x[p] = context.x_n[p] + dt * V;
        }
        return sum;
      },
      [](double a, double b) { return a + b; });
  double of_bones = 0;
  const RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size() && !world.bodies.bound.empty(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    const Vec3 change = context.solution.linear[i] - context.right_side.linear[i];
    const Vec3 turn = rigid.state[i].pose.orientation.conjugate() *
                      (context.solution.angular[i] - context.right_side.angular[i]);
    of_bones += 0.5 * (rigid.properties[i].mass * change.squaredNorm() +
                       turn.dot(rigid.properties[i].inertia.cwiseProduct(turn)));
  }
  return motion + of_bones + world.bodies.forces.energy(particles.x);
}

bool solve_velocity_implicitly(World& world, StepContext& context, double dt, ContactProjection* projection) {
  VelocitySystem system(world.bodies, dt, true, projection, context.damping_force, context.inertia);
  world.bodies.forces.set_added_damping(numerical_damping * 2 * dt);
  bool balanced = find_balance(world, context, system, dt);
  for (int release = 0; projection && release < most_releases; ++release) {
    if (!projection->release(context.unconstrained, world.settings.cg_tolerance)) break;
    balanced = find_balance(world, context, system, dt);
  }
  return balanced;
}

}  // namespace duet
