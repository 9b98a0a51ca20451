// Both orders of step V and both integrations keep what other stages of a step rely on: pins, prescribed
// motions, joints, attachments and incompressibility. The reader refuses constraints before the solve with
// implicit integration (tests/broken/constraints_first_implicit.toml).
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"

#include "sim/step/step.h"

namespace duet::velocity_orders_test {
namespace {

using scene::Integration;
using scene::VelocityConstraints;

// A combination of integration and order of step V.
struct Solve {
  const char* name;
  Integration integration = Integration::semi_implicit;
  VelocityConstraints constraints = VelocityConstraints::after_solve;
};
// The combinations that the reader accepts.
constexpr Solve solves[] = {
    {"semi_implicit_after"},
    {"semi_implicit_before", Integration::semi_implicit, VelocityConstraints::before_solve},
    {"implicit_after", Integration::implicit}};

// Returns the scene with the settings of `solve`.
scene::Scene with(const Solve& solve, scene::Scene scene) {
  scene.solver.integration = solve.integration;
  scene.solver.velocity_constraints = solve.constraints;
  return scene;
}

// Returns the name of a measured value, with that of the solve.
std::string named(const Solve& solve, const std::string& what) { return what + "_" + solve.name; }

// Adds a kinematic box that moves from `start` to `end` within a second.
scene::RigidBody& add_hand(scene::Scene& scene, const Vec3& start, const Vec3& end) {
  scene::RigidBody& hand = test::add_box(scene, "hand", start, Vec3(0.3, 0.1, 0.3), 1);
  hand.mass.reset();
  hand.is_kinematic = true;
  hand.motion.keyframes = {{0, start, {}, false, {}}, {1, end, {}, false, {}}};
  return hand;
}

// Returns a soft box of 0.2 m and 8 kg whose top hangs from a kinematic body. That body starts at rest and
// moves by 1 m in 1 s.
scene::Scene box_on_a_hand() {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  add_hand(scene, Vec3(0, 0.2, 0), Vec3(1, 0.2, 0));
  scene::DeformableBody& box = test::add_soft_box(scene, "box", Vec3::Zero(), Vec3(0.2, 0.2, 0.2), 2, 1e5);
  box.pins = {{.from = Vec3(0, 0.1, -0.1), .to = Vec3(0, 0.1, 0.1), .radius = 0.1, .body = "hand"}};
  return scene;
}

// Pinned particles keep place and zero velocity to the last bit.
TEST(VelocityOrders, PinsKeepTheirPlacesToTheBit) {
  for (const Solve& solve : solves) {
    scene::Scene scene = with(solve, box_on_a_hand());
    scene.deformable[0].pins[0].body.clear();
    Simulation simulation(scene, test::plan(scene));
    const Particles& particles = simulation.world().bodies.particles;
    const std::vector<Vec3> start = particles.x;
    for (int frame = 0; frame < 6; ++frame) simulation.advance_frame();
    std::size_t held = 0;
    for (std::size_t p = 0; p < start.size(); ++p) {
      if (!is_held(particles, p)) continue;
      ++held;
      EXPECT_EQ(particles.x[p], start[p]) << solve.name;
      EXPECT_EQ(particles.v[p], Vec3::Zero()) << solve.name;
    }
    EXPECT_EQ(held, 12U) << "the nine of the top and three below";
  }
}

// Particles that kept the velocity of frame 0 while their kinematic body moved on once tore at the box, with
// 358 J and a stretch of 2.82. A hanging bar of the box's height holds (rho g)^2 A L^3 / (6 E) = 0.051 J, and
// the box, which three particles below its top hold as well, less. Damping acts at other velocities in the
// two orders, so that their energies differ by its fraction of the forces, 1 % as the box begins to fall; the
// bound is 3 %.
TEST(VelocityOrders, PinsFollowAMovingBody) {
  double elastic[std::size(solves)] = {};
  for (std::size_t i = 0; i < std::size(solves); ++i) {
    const scene::Scene scene = with(solves[i], box_on_a_hand());
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    double largest = 0, stretch = 0, off = 0;
    for (int frame = 0; frame < 24; ++frame) {
      simulation.advance_frame();
      largest = std::max(largest, simulation.stats().elastic);
      stretch = std::max(stretch, simulation.stats().max_stretch);
      const RigidState& hand = bodies.rigid.state[0];
      for (const PrescribedParticle& carried : bodies.carried) {
        const Vec3 arm = hand.pose.to_world(carried.arm) - hand.pose.position;
        off = std::max(off,
                       (bodies.particles.v[as_index(carried.particle)] - point_velocity(hand, arm)).norm());
      }
    }
    elastic[i] = largest;
    test::expect_below(largest, 0.051, named(solves[i], "elastic_energy"));
    test::expect_below(stretch, 1.02, named(solves[i], "stretch"));
    test::expect_below(off, 1e-13, named(solves[i], "velocity_off_the_hand"));
  }
  EXPECT_NEAR(elastic[1], elastic[0], 0.03 * elastic[0]);
}

// After a step a kinematic body has the exact velocity of time n+1, to the last bits of its formula, and a
// body on it has followed by friction: a coefficient of 0.8 can give four times the 2 m/s^2 that the plate
// needs.
TEST(VelocityOrders, PrescribedMotionsEndExactlyAndLeadAlong) {
  for (const Solve& solve : solves) {
    scene::Scene scene = test::free_space();
    scene.gravity = Vec3(0, -9.8, 0);
    scene::RigidBody& plate = test::add_box(scene, "plate", Vec3(0, -0.1, 0), Vec3(3, 0.2, 1), 1);
    plate.mass.reset();
    plate.is_kinematic = true;
    plate.friction = 0.8;
    plate.motion.sinusoid = {
        {Vec3(0.5, 0, 0), {}, 1 / EIGEN_PI, 0, 0, {}}};  // 0.5 m at 2 rad/s: 1 m/s, 2 m/s^2
    scene::DeformableBody& box =
        test::add_soft_box(scene, "box", Vec3(0, 0.2, 0), Vec3(0.4, 0.4, 0.4), 2, 1e5);
    box.placement.velocity = Vec3(1, 0, 0);
    const scene::Scene ordered = with(solve, scene);
    Simulation simulation(ordered, test::plan(ordered));
    const Bodies& bodies = simulation.world().bodies;
    double off = 0, slip = 0;
    for (int frame = 1; frame <= 24; ++frame) {
      simulation.advance_frame();
      const double time = frame / ordered.fps;
      off = std::max(off, std::abs(bodies.rigid.state[0].velocity.x() - std::cos(2 * time)));
      Vec3 momentum = Vec3::Zero();
      double mass = 0;
      for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
        momentum += bodies.particles.mass[p] * bodies.particles.v[p];
        mass += bodies.particles.mass[p];
      }
      if (frame > 6) slip = std::max(slip, std::abs((momentum / mass).x() - std::cos(2 * time)));
    }
    test::expect_below(off, 1e-13, named(solve, "velocity_off_the_motion"));
    test::expect_below(slip, 0.05, named(solve, "box_off_the_plate"));
  }
}

// Returns two jointed bones in flesh that swings, one of which hangs from a peg.
scene::Scene arm_in_flesh() {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  test::add_chain(scene, 2, scene::JointType::hinge, true);
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", Vec3(1.1, 0, 0), Vec3(1.6, 0.3, 0.3), 1, 1e5);
  flesh.shape.cells = Vec3i(8, 2, 2);
  flesh.attach = {"link0", "link1"};
  return scene;
}

// The joints come last in a step, or are part of the projection of what comes after them, so they are
// satisfied to rounding.
TEST(VelocityOrders, JointsHoldInFlesh) {
  for (const Solve& solve : solves) {
    const scene::Scene scene = with(solve, arm_in_flesh());
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const auto at = [&](int body, const Pose& frame) {
      const RigidState& state = bodies.rigid.state[as_index(body)];
      return point_velocity(state, state.pose.orientation * frame.position);
    };
    double apart = 0, gap = 0;
    for (int frame = 0; frame < 8; ++frame) {
      simulation.advance_frame();
      gap = std::max(gap, JointSolver::drift(bodies.articulation, bodies.rigid).gap);
      for (const Joint& joint : bodies.articulation.joints)
        apart = std::max(apart,
                         (at(joint.parent, joint.parent_frame) - at(joint.child, joint.child_frame)).norm());
    }
    EXPECT_LT(bodies.rigid.state[1].velocity.y(), -0.5) << "it swings";
    test::expect_below(apart, 1e-9, named(solve, "velocity_of_the_gap"));
    test::expect_below(gap, 1e-9, named(solve, "gap"));
  }
}

// Embedded particles move with their bones to rounding. Zero-length springs give flesh and bone opposite
// impulses, so momentum is kept to rounding.
TEST(VelocityOrders, AttachmentsMoveWithTheirBonesAndKeepMomentum) {
  for (const Solve& solve : solves)
    for (const bool by_springs : {false, true}) {
      scene::Scene scene = test::free_space();
      scene::RigidBody& bone = test::add_box(scene, "bone", Vec3::Zero(), Vec3(0.6, 0.3, 0.3), 200);
      bone.placement.velocity = Vec3(3, -1, 2);
      bone.placement.angular_velocity = Vec3(0, 2, 1);
      scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3::Zero(), Vec3(1, 1, 1), 4, 1e5);
      flesh.attach = {"bone"};
      if (by_springs) flesh.attach_springs = scene::AttachSprings{1e4, 1};
      const scene::Scene ordered = with(solve, scene);
      Simulation simulation(ordered, test::plan(ordered));
      const Bodies& bodies = simulation.world().bodies;
      ASSERT_FALSE(bodies.bound.empty());
      const Momentum start = momentum(bodies);
      double off = 0;
      for (int frame = 0; frame < 6; ++frame) {
        simulation.advance_frame();
        for (const EmbeddedParticle& bound : bodies.bound)
          off = std::max(
              off, (bodies.particles.v[bound.particle] - point_velocity(bodies.rigid.state[0], bound.offset))
                       .norm());
      }
      test::expect_below(off, 1e-12,
                         named(solve, by_springs ? "anchors_off_the_bone" : "flesh_off_the_bone"));
      test::expect_below((momentum(bodies).linear - start.linear).norm() / start.linear.norm(), 1e-10,
                         named(solve, by_springs ? "momentum_with_springs" : "momentum"));
    }
}

// In either order v^{n+1} has no divergence at x^{n+1}, except for the tolerance of the pressure solve: a
// hundredth of the 2/s at which the pins stop the box. Volumes stay within the tolerance of a step, 1e-4.
TEST(VelocityOrders, IncompressibleBodiesEndWithoutDivergence) {
  for (const Solve& solve : solves) {
    scene::Scene scene = test::free_space();
    scene.gravity = Vec3(0, -9.8, 0);
    scene::DeformableBody& box = test::add_soft_box(scene, "box", Vec3::Zero(), Vec3(0.4, 0.4, 0.4), 3, 1e5);
    box.incompressible = true;
    box.pins = {{.from = Vec3(-0.2, 0.2, 0), .to = Vec3(0.2, 0.2, 0), .radius = 0.21, .body = {}}};
    box.placement.angular_velocity = Vec3(0, 0, 2);
    const scene::Scene ordered = with(solve, scene);
    Simulation simulation(ordered, test::plan(ordered));
    Bodies& bodies = simulation.world().bodies;
    double rate = 0, error = 0;
    std::vector<double> divergence;
    for (int frame = 0; frame < 12; ++frame) {
      simulation.advance_frame();
      bodies.nodal_volumes.divergence_at(bodies.particles.x, bodies.particles.v, divergence);
      for (std::size_t i = 0; i < divergence.size(); ++i)
        rate = std::max(rate, std::abs(divergence[i]) / bodies.nodal_volumes.rest_volume(i));
      error = std::max(error, simulation.stats().volume_error);
    }
    test::expect_below(rate, 2e-2, named(solve, "divergence_per_s"));
    test::expect_below(error, 1e-4, named(solve, "volume_error"));
  }
}

// In either order no stage of the ledger has a defect, with pins, joints and drag together.
TEST(VelocityOrders, TheLedgerIsBalancedWithPinsJointsAndDrag) {
  for (const VelocityConstraints order :
       {VelocityConstraints::after_solve, VelocityConstraints::before_solve}) {
    scene::Scene scene = arm_in_flesh();
    scene.materials[0].mass_damping = 2;
    scene.deformable[0].pins = {
        {.from = Vec3(1.9, -0.15, 0), .to = Vec3(1.9, 0.15, 0), .radius = 0.16, .body = {}}};
    scene.solver.velocity_constraints = order;
    scene.solver.cg_tolerance = 1e-13;  // the impulse on pins is that of forces at the solution of the solve
    Simulation simulation(scene, test::plan(scene));
    simulation.keep_ledger();
    double linear = 0, angular = 0;
    for (int frame = 0; frame < 6; ++frame) {
      simulation.advance_frame();
      for (const LedgerStats& stage : simulation.stats().ledger) {
        linear = std::max(linear, stage.momentum_defect);
        // Moving positions, and joints that give at x^{n+1} what they gave at x^n, leave opposite moments.
        if (stage.name != name(Stage::advance_position) && stage.name != name(Stage::post_stabilization) &&
            stage.name != "step")
          angular = std::max(angular, stage.angular_momentum_defect);
      }
    }
    // 20 kg of bones and 144 kg of flesh fall for 0.25 s, with momenta of some 100 kg m/s, so the bounds are
    // rounding.
    const char* solve = order == VelocityConstraints::after_solve ? "after" : "before";
    test::expect_below(linear, 1e-8, std::string("linear_defect_") + solve);
    test::expect_below(angular, 1e-8, std::string("angular_defect_") + solve);
  }
}

}  // namespace
}  // namespace duet::velocity_orders_test
