// Particles that pins hold in their place or that follow a kinematic body (prescribed particles).
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::moving_pins_test {
namespace {

using scene::Integration;
using scene::VelocityConstraints;

// Combinations of integration and order of step V.
struct Solve {
  Integration integration = Integration::semi_implicit;
  VelocityConstraints constraints = VelocityConstraints::after_solve;
};
// The combinations that the reader accepts.
constexpr Solve solves[] = {
    {}, {Integration::implicit}, {Integration::semi_implicit, VelocityConstraints::before_solve}};

// Returns a soft box of 0.2 m whose top hangs from a kinematic body. That body keeps its place for 0.1 s,
// then moves along and turns.
scene::Scene box_on_a_hand(const Solve& solve) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene::RigidBody& hand = test::add_box(scene, "hand", Vec3(0, 0.2, 0), Vec3(0.3, 0.1, 0.3), 1);
  hand.mass.reset();
  hand.is_kinematic = true;
  hand.motion.keyframes = {{0.1, Vec3(0, 0.2, 0), {}, false, {}}, {0.6, Vec3(0.4, 0.5, 0), {}, false, {}}};
  hand.motion.spin = {{Vec3::UnitY(), 0.5, 0.1, {}, 0.2}};
  scene::DeformableBody& box = test::add_soft_box(scene, "box", Vec3::Zero(), Vec3(0.2, 0.2, 0.2), 2, 1e5);
  box.pins = {{.from = Vec3(0, 0.1, -0.1), .to = Vec3(0, 0.1, 0.1), .radius = 0.1, .body = "hand"}};
  scene.solver.integration = solve.integration;
  scene.solver.velocity_constraints = solve.constraints;
  return scene;
}

// x = q arm + p and v = v_body + w x arm, to rounding, for all solves. Particles that keep an older velocity
// of their body drift off it.
TEST(MovingPins, ParticlesFollowTheirBodyToRounding) {
  for (const Solve& solve : solves) {
    const scene::Scene scene = box_on_a_hand(solve);
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    ASSERT_EQ(bodies.carried.size(), 12U) << "the nine of the top and three below";
    for (int frame = 0; frame < 24; ++frame) {
      simulation.advance_frame();
      for (const PrescribedParticle& carried : bodies.carried) {
        const auto p = static_cast<std::size_t>(carried.particle);
        const RigidState& hand = bodies.rigid.state[0];
        const Vec3 place = hand.pose.to_world(carried.arm);
        EXPECT_LT((bodies.particles.x[p] - place).norm(), 1e-14);
        EXPECT_LT((bodies.particles.v[p] - point_velocity(hand, place - hand.pose.position)).norm(), 1e-13);
      }
    }
    EXPECT_GT(bodies.rigid.state[0].pose.position.x(), 0.39);
    EXPECT_EQ(simulation.stats().inverted, 0);
  }
}

// When the solve does not converge and bodies move on as a whole (the rigid fallback), held particles must
// still keep their place. One Newton iteration at a high stiffness provokes that.
TEST(MovingPins, NothingElseMovesThem) {
  scene::Scene scene = box_on_a_hand({Integration::implicit});
  scene.materials[0].youngs_modulus = 1e8;
  scene.solver.newton_iterations = 1;
  scene.deformable[0].placement.angular_velocity = Vec3(20, 0, 0);
  scene.deformable[0].pins[0].body.clear();
  Simulation simulation(scene, test::plan(scene));
  const Particles& particles = simulation.world().bodies.particles;
  const std::vector<Vec3> start = particles.x;
  bool gave_up = false;
  for (int frame = 0; frame < 6; ++frame) {
    simulation.advance_frame();
    gave_up = gave_up || !simulation.world().context.solve.converged;
  }
  EXPECT_TRUE(gave_up);
  for (std::size_t p = 0; p < start.size(); ++p)
    if (is_held(particles, p)) {
      EXPECT_EQ(particles.x[p], start[p]);
      EXPECT_EQ(particles.v[p], Vec3::Zero());
    }
}

// A body that is led at the constant velocity with which all of it begins is not deformed.
TEST(MovingPins, ABodyThatIsLedAlongKeepsItsShape) {
  for (const Solve& solve : solves) {
    scene::Scene scene = box_on_a_hand(solve);
    scene.gravity.setZero();
    scene.rigid[0].motion = {};
    scene.rigid[0].motion.keyframes = {{-1, Vec3(-2, 0.2, 0), {}, false, {}},
                                       {2, Vec3(4, 0.2, 0), {}, false, {}}};
    scene.rigid[0].motion.interpolation = Interpolation::linear;
    scene.deformable[0].placement.velocity = Vec3(2, 0, 0);
    scene.solver.cg_tolerance = 1e-10;  // m/s, by which velocities may differ
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
    EXPECT_LT(simulation.stats().elastic, 1e-12) << "besides 16 J that it has";
    EXPECT_NEAR(simulation.stats().momentum.x(), 2 * 8, 1e-9);
  }
}

}  // namespace
}  // namespace duet::moving_pins_test
