// Halving the step halves the error, where there is one: bodies that land flat, slide and begin to roll,
// against closed forms.
#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::everyday_rigid_convergence_test {
namespace {

using test::Support;

constexpr double gravity = 9.8;  // m/s^2
// Time steps (s), all of which the rule for the step allows.
constexpr std::array steps{1.0 / 160, 1.0 / 320, 1.0 / 640, 1.0 / 1280};
// Time steps (s) for errors that hardly depend on the step.
constexpr std::array longer_and_shorter{1.0 / 48, 1.0 / 160, 1.0 / 640};

// Advances by `seconds`, with a shorter last step.
void simulate(Simulation& simulation, double seconds) {
  World& world = simulation.world();
  for (double time = 0; time < seconds * (1 - 1e-9);) {
    const double dt = std::min(choose_time_step(world, time), seconds - time);
    step(world, time, dt);
    time += dt;
  }
}

// Returns the slope of the straight line through log error over log step, by least squares.
double order_of(const std::array<double, steps.size()>& errors) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double a = std::log(steps[i]), b = std::log(errors[i]);
    x += a, y += b, xx += a * a, xy += a * b;
  }
  const double n = steps.size();
  return (n * xy - x * y) / (n * xx - x * x);
}

// How a body lands.
struct Landing {
  double drop = 1;  // m
  double restitution = 0, friction = 0;
};

constexpr double sideways = 4;  // m/s, initial speed along x

// Returns the position minus the closed form (m), 0.3 of the duration of the fall after the landing.
Vec3 error_of_landing(const test::EverydayShape& shape, const Landing& how, double longest_step) {
  scene::Scene scene;
  test::add_support(scene, Support::static_box, 1);
  test::add_shape(scene, shape, 1, how.drop).placement.velocity = Vec3(sideways, 0, 0);
  for (scene::RigidBody& body : scene.rigid) {
    body.restitution = how.restitution;
    body.friction = how.friction;
  }
  scene.gravity = Vec3(0, -gravity, 0);
  scene.solver.max_time_step = longest_step;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const RigidState& state = bodies.rigid.state[test::index_of_shape(bodies)];
  const double fall = std::sqrt(2 * how.drop / gravity), impact = gravity * fall, after = 0.3 * fall;
  simulate(simulation, fall + after);
  const double v = sideways - how.friction * (1 + how.restitution) * impact;  // m/s, after the impact
  Vec3 expected(sideways * fall + v * after, shape.height, 0);
  if (how.restitution == 0)
    expected.x() -= 0.5 * how.friction * gravity * after * after;
  else
    expected.y() += how.restitution * impact * after - 0.5 * gravity * after * after;
  return state.pose.position - expected;
}

// Returns whether the shape lands on a face of some height. The others roll, or tip by their sideways speed.
bool lands_on_a_face(const test::EverydayShape& shape) {
  return shape.name != "ball" && shape.name != "slab" && !shape.name.starts_with("lying");
}

// The time of an impact is resolved to a step only, so the error is of first order and depends on where in a
// step the body lands. Of four such places, the same for all lengths of steps, the worst counts.
TEST(EverydayRigidConvergence, OfRebounds) {
  constexpr double fall = 0.45;  // s, a whole number of all steps
  constexpr int times = 4;
  test::Cases cases(5);
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat()) {
    if (!lands_on_a_face(shape)) continue;
    for (const double restitution : {0.5, 1.0}) {
      if (!cases.takes()) continue;
      std::array<double, steps.size()> errors{};
      for (std::size_t i = 0; i < steps.size(); ++i)
        for (int k = 0; k < times; ++k) {
          const double seconds = fall + (k + 0.5) / times * steps[i];
          const Landing how{
              .drop = 0.5 * gravity * seconds * seconds, .restitution = restitution, .friction = 0.1};
          errors[i] = std::max(errors[i], error_of_landing(shape, how, steps[i]).norm());
          // The body rebounds at most one step early or late, with the change of velocity of the impact.
          EXPECT_LT(errors[i], std::hypot(1, how.friction) * (1 + restitution) * gravity * seconds * steps[i])
              << shape.name;
        }
      test::expect_above(order_of(errors), 0.9, fmt::format("order_{}_{}", shape.name, restitution));
    }
  }
}

// Without a rebound the time of landing within a step leaves no error, so steps of any length end at the same
// place. The bound is what sweeps leave, which end at 1e-9 of the speed.
TEST(EverydayRigidConvergence, IsAtItsEndWhereNothingRebounds) {
  test::Cases cases(5);
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat()) {
    if (!lands_on_a_face(shape)) continue;
    for (const double friction : {0.0, 0.1, 0.3}) {
      if (!cases.takes()) continue;
      double worst = 0;
      for (const double step : longer_and_shorter)
        for (const double drop : {0.8, 0.93, 1.1})
          worst = std::max(worst, error_of_landing(shape, {.drop = drop, .friction = friction}, step).norm());
      test::expect_below(worst, 2e-8, fmt::format("error_{}_{}", shape.name, friction));
    }
  }
}

// Friction turns sliding into rolling within some step, which leaves an error of second order: mu g dt^2 / 2,
// plus 2e-6 m for the tolerance of the contact solve.
TEST(EverydayRigidConvergence, OfSlidingThatTurnsIntoRolling) {
  constexpr double friction = 0.2, seconds = 2;
  for (const test::EverydayShape& shape : test::shapes_that_roll())
    for (const double step : longer_and_shorter) {
      scene::Scene scene;
      test::add_support(scene, Support::static_box, 1);
      test::add_shape(scene, shape, 1, 0).placement.velocity = Vec3(sideways, 0, 0);
      for (scene::RigidBody& body : scene.rigid) body.friction = friction;
      scene.gravity = Vec3(0, -gravity, 0);
      scene.solver.max_time_step = step;
      Simulation simulation(scene, test::plan(scene));
      const Bodies& bodies = simulation.world().bodies;
      const std::size_t body = test::index_of_shape(bodies);
      const RigidProperties& properties = bodies.rigid.properties[body];
      simulate(simulation, seconds);
      const double ratio = properties.inertia.y() / (properties.mass * shape.height * shape.height);
      const double rolling = sideways / (1 + ratio), slides = (sideways - rolling) / (friction * gravity);
      const double way = (sideways + rolling) / 2 * slides + rolling * (seconds - slides);
      const double bound = 0.5 * friction * gravity * step * step + 2e-6;
      EXPECT_LT(std::abs(bodies.rigid.state[body].pose.position.x() - way), bound)
          << shape.name << ", step " << step;
    }
}

}  // namespace
}  // namespace duet::everyday_rigid_convergence_test
