#include "sim/contact/response/island_solver.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

#include "sim/contact/response/contact_solver.h"
#include "sim/contact/response/warm_start.h"

namespace duet::island_solver_test {
namespace {

using test::ContactScene;

constexpr double dt = 1.0 / 64, g = 9.8;

// Returns boxes with the given masses (kg) on the ground, the first one lowest. Each is `lean` (m) farther
// along x than the one below, and all have `velocity` and the speed that gravity adds in one step.
ContactScene column(const std::vector<double>& masses, double lean, const Vec3& velocity = Vec3::Zero()) {
  scene::Scene scene = test::on_ground(0.5);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const double n = static_cast<double>(i);
    scene::RigidBody& box = test::add_box(scene, "box", Vec3(lean * n, 0.5 + n, 0), Vec3(1, 1, 1), masses[i]);
    box.friction = 0.5;
    box.placement.velocity = velocity - Vec3(0, g * dt, 0);
  }
  return {scene, dt};
}

// Solves the contacts as one island. Returns the largest change of a relative velocity that an update would
// still make, m/s.
double solve(ContactScene& scene, double tolerance) {
  find_speculative_targets(dt, OrientationUpdate::exact, scene.graph, scene.bodies, scene.contacts);
  warm_start({}, dt, scene.graph, scene.bodies, scene.contacts);
  return IslandSolver().solve(scene.bodies, scene.graph.pairs, tolerance, scene.contacts);
}

// Returns the impulse with which the upper body of a pair presses down, N s.
double pressure(const ContactScene& scene, const ContactPair& pair) {
  double sum = 0;
  for (int i = pair.begin; i < pair.end; ++i) sum += std::abs(scene.contacts.points[as_index(i)].impulse.y());
  return sum;
}

// Columns come to rest for mass ratios of up to 1e4 in either order, also when they lean out almost to
// tipping, and each pair carries the weight above it.
TEST(IslandSolver, BringsColumnsToRestWhateverTheirMasses) {
  for (const std::vector<double>& masses : {std::vector<double>{1},
                                            {1, 1, 1, 1, 1, 1, 1, 1, 1, 1},
                                            {1, 1e4, 1, 1e4, 1},
                                            {1, 10, 100, 1e3, 1e4},
                                            {1e4, 100, 1}})
    for (const double lean : {0.0, 0.09}) {
      ContactScene scene = column(masses, lean);
      EXPECT_LT(solve(scene, 1e-9), 1e-9) << masses.size() << " " << lean;
      for (std::size_t i = 0; i < masses.size(); ++i) {
        // The error is that of updates of single points, and a lever arm of a few tenths of a meter turns it
        // into these speeds.
        EXPECT_LT(scene.state(i).velocity.norm(), 1e-7) << i << " of " << masses.size() << " " << lean;
        EXPECT_LT(scene.state(i).angular_velocity.norm(), 1e-7)
            << i << " of " << masses.size() << " " << lean;
      }
      // Every pair carries what is above it.
      for (const ContactPair& pair : scene.contacts.pairs) {
        const auto upper = as_index(std::max(pair.host, pair.guest_rigid) == static_cast<int>(masses.size())
                                        ? 0
                                        : std::max(pair.host, pair.guest_rigid));
        const double weight =
            std::accumulate(masses.begin() + static_cast<std::ptrdiff_t>(upper), masses.end(), 0.0);
        if (!pair.active) continue;
        EXPECT_NEAR(pressure(scene, pair) / (weight * g * dt), 1, 1e-7) << upper << " of " << masses.size();
      }
    }
}

// Friction can take 0.5 g dt in a step, and stops slower boxes. Faster ones slide, which is left to sweeps,
// in no worse state than before.
TEST(IslandSolver, HoldsByFrictionWhatFrictionCanHold) {
  for (const double speed : {0.02, 0.07, 0.2, 1.0}) {
    ContactScene scene = column({2}, 0, Vec3(speed, 0, 0));
    ContactScene same = column({2}, 0, Vec3(speed, 0, 0));
    const double before = solve(same, std::numeric_limits<double>::infinity()), left = solve(scene, 1e-9);
    EXPECT_LT(left, speed > 0.5 * g * dt ? before : 1e-9) << speed;
    if (speed < 0.5 * g * dt) {
      EXPECT_NEAR(scene.state(0).velocity.x(), 0, 1e-8) << speed;
    }
  }
}

// With friction, on a column that leans and slides slowly, the solution is that of 20000 sweeps.
TEST(IslandSolver, AgreesWithSweeps) {
  const auto result = [](bool whole) {
    ContactScene scene = column({1, 3, 2}, 0.15, Vec3(0.03, 0, 0.01));
    find_speculative_targets(dt, OrientationUpdate::exact, scene.graph, scene.bodies, scene.contacts);
    warm_start({}, dt, scene.graph, scene.bodies, scene.contacts);
    if (whole) {
      EXPECT_LT(IslandSolver().solve(scene.bodies, scene.graph.pairs, 1e-12, scene.contacts), 1e-12);
    } else {
      ContactSolveScratch scratch;
      solve_contact(scene.bodies, scene.graph,
                    {.iterations = 20000, .tolerance = 1e-13, .whole_islands = false}, scene.contacts,
                    scratch);
    }
    return scene.bodies.rigid.state;
  };
  const std::vector<RigidState> swept = result(false), solved = result(true);
  for (std::size_t i = 0; i < swept.size(); ++i) {
    EXPECT_LT((swept[i].velocity - solved[i].velocity).norm(), 1e-9) << i;
    EXPECT_LT((swept[i].angular_velocity - solved[i].angular_velocity).norm(), 1e-9) << i;
  }
}

}  // namespace
}  // namespace duet::island_solver_test
