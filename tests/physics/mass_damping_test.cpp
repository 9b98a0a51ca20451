// Mass-proportional damping brakes the mass of the flesh, and not that of the bones inside it.
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/deformable/spin.h"
#include "sim/step/step.h"

namespace duet::mass_damping_test {
namespace {

constexpr double rate = 2, flesh_mass = 1000;  // 1/s; kg

// How the flesh holds to its bone.
enum class Binding { none, hard, soft };

// Returns a cube of 1 m of stiff flesh in free space that flies and turns, with a bone of `bone_mass` (kg)
// across its middle.
scene::Scene flying(Binding binding, double bone_mass) {
  scene::Scene scene = test::free_space();
  scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3::Zero(), Vec3(1, 1, 1), 4, 1e6);
  scene.materials[0].damping = 0.02;
  scene.materials[0].mass_damping = rate;
  flesh.placement.velocity = Vec3(3, -1, 2);
  flesh.placement.angular_velocity = Vec3(0.1, 0.3, 0);
  if (binding == Binding::none) return scene;
  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3::Zero(), Vec3(0.6, 0.6, 0.6), bone_mass);
  bone.placement.velocity = flesh.placement.velocity;
  bone.placement.angular_velocity = flesh.placement.angular_velocity;
  flesh.attach = {"bone"};
  if (binding == Binding::soft) flesh.attach_springs = scene::AttachSprings{1e5, 1};
  return scene;
}

// Momentum of all bodies, with the angular momentum about their center of mass.
Momentum momentum_about_center(const Bodies& bodies) {
  double mass = 0;
  Vec3 center = Vec3::Zero();
  const auto add = [&](double m, const Vec3& x) {
    mass += m;
    center += m * x;
  };
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    add(bodies.particles.mass[p], bodies.particles.x[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    add(bodies.rigid.properties[i].mass, bodies.rigid.state[i].pose.position);
  Momentum total = momentum(bodies);
  total.angular -= (center / mass).cross(total.linear);
  return total;
}

// Returns the fraction of the moment of inertia about the y axis through the center that the flesh has.
double share_of_flesh(const Bodies& bodies) {
  double flesh = 0, all = 0;
  const auto squared = [](const Vec3& x) { return x.x() * x.x() + x.z() * x.z(); };
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p) flesh += particles.mass[p] * squared(particles.x[p]);
  all = flesh;
  for (const EmbeddedParticle& bound : bodies.bound)
    flesh += bound.mass * squared(particles.x[bound.particle]);
  for (const RigidProperties& bone : bodies.rigid.properties) all += bone.inertia.y();
  return flesh / all;
}

// Checks the speed and the spin after half a second against exp(-rate t f), where f is the fraction of mass
// or inertia that the flesh has, to `most` of those at the start.
void expect_braked(const scene::Scene& scene, double mass_share, double most, const std::string& what) {
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const double inertia_share = share_of_flesh(bodies);
  const Momentum start = momentum_about_center(bodies);
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  const Momentum end = momentum_about_center(bodies);
  const auto off = [](const Vec3& now, const Vec3& then, double share) {
    return (now - std::exp(-rate * 0.5 * share) * then).norm() / then.norm();
  };
  test::expect_below(off(end.linear, start.linear, mass_share), most, what + ", momentum off");
  test::expect_below(off(end.angular, start.angular, inertia_share), most, what + ", spin off");
}

// Flesh brakes itself alone: v = v_0 exp(-rate t m_flesh / (m_flesh + m_bone)). Implicit steps are of first
// order in the damping, with an error of about rate dt / 8.
TEST(MassDamping, BrakesFleshAndNotItsBone) {
  for (const bool implicit : {false, true})
    for (const Binding binding : {Binding::none, Binding::hard, Binding::soft})
      for (const double bone_mass : {200.0, 5000.0}) {
        if (binding == Binding::none && bone_mass > 200) continue;
        scene::Scene scene = flying(binding, bone_mass);
        if (implicit) scene.solver.integration = scene::Integration::implicit;
        expect_braked(scene, binding == Binding::none ? 1 : flesh_mass / (flesh_mass + bone_mass),
                      implicit ? 1e-2 : 1e-4,
                      fmt::format("{}, {}, {} kg", implicit ? "implicit" : "semi-implicit",
                                  binding == Binding::none   ? "no bone"
                                  : binding == Binding::hard ? "hard"
                                                             : "soft",
                                  bone_mass));
      }
}

// The same holds if constraints come before the solve, and for flesh whose contact is inside its solve
// because it is strongly damped.
TEST(MassDamping, BrakesFleshInEverySolve) {
  scene::Scene scene = flying(Binding::hard, 1000);
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  expect_braked(scene, 0.5, 1e-3, "constraints before the solve");
  scene = flying(Binding::hard, 1000);
  scene.materials[0].damping = 3;
  expect_braked(scene, 0.5, 1e-3, "strongly damped");
}

}  // namespace
}  // namespace duet::mass_damping_test
