// Steering of a running simulation: targets, applied forces, and bodies that are let go.
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/step/world.h"

namespace duet::test::steering_test {
namespace {

const RigidState& state_of(const Simulation& simulation, std::string_view name) {
  const RigidBodies& rigid = simulation.world().bodies.rigid;
  return rigid.state[index_of_name(rigid.name, std::string(name))];
}

void advance(Simulation& simulation, int frames) {
  for (int i = 0; i < frames; ++i) simulation.advance_frame();
}

// Returns a kinematic ball that turns, at (0, 1, 0), in a scene with a body that can meet it.
scene::Scene with_kinematic_ball() {
  scene::Scene scene = free_space();
  scene::RigidBody& ball = add_ball(scene, "driven", Vec3(0, 1, 0), 0.1, 1);
  ball.mass.reset();
  ball.is_kinematic = true;
  ball.motion.spin.push_back({});
  add_box(scene, "box", Vec3(5, 0, 0), Vec3::Ones(), 2);
  return scene;
}

// The impulse of a force is F t, to rounding, and it acts in one frame only.
TEST(Steering, ForcesGiveTheirImpulse) {
  scene::Scene scene = free_space();
  add_box(scene, "box", Vec3::Zero(), Vec3::Ones(), 2);
  add_soft_box(scene, "soft", Vec3(5, 0, 0), Vec3::Ones(), 2);
  Simulation simulation(scene, plan(scene));
  const Vec3 force(3, -4, 5);  // N
  simulation.add_force("box", 0.5 * force);
  simulation.add_force("box", 0.5 * force);
  simulation.add_force("soft", force);
  advance(simulation, 1);
  const Vec3 expected = 2 * force / scene.fps;
  EXPECT_LT((simulation.stats().momentum - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT((state_of(simulation, "box").velocity - force / 2 / scene.fps).norm(), 1e-12);
  // The box has moved by a t^2/2, as the trapezoidal rule takes it.
  EXPECT_LT((state_of(simulation, "box").pose.position - force / 4 / scene.fps / scene.fps).norm(), 1e-12);
  advance(simulation, 1);
  EXPECT_LT((simulation.stats().momentum - expected).norm(), 1e-12 * expected.norm());
}

TEST(Steering, ForcesAtAPointTurnTheBody) {
  scene::Scene scene = free_space();
  add_box(scene, "box", Vec3::Zero(), Vec3::Ones(), 6);  // moment of inertia 1 kg m^2
  Simulation simulation(scene, plan(scene));
  simulation.add_force("box", Vec3(0, 2, 0), Vec3(0, 0, 1), Vec3(0.5, 0, 0));
  advance(simulation, 1);
  EXPECT_LT((simulation.stats().angular_momentum - Vec3(0, 0, 2) / scene.fps).norm(), 1e-4);
}

// A force on one particle of a free body moves the whole with F t, too.
TEST(Steering, ForcesAtAParticleMoveTheWholeBody) {
  scene::Scene scene = free_space();
  add_soft_box(scene, "soft", Vec3::Zero(), Vec3::Ones(), 2);
  Simulation simulation(scene, plan(scene));
  simulation.add_force("soft", Vec3(0, 7, 0), Vec3::Zero(), Vec3(0.5, 0.5, 0.5));
  advance(simulation, 1);
  EXPECT_LT((simulation.stats().momentum - Vec3(0, 7, 0) / scene.fps).norm(), 1e-9);
  EXPECT_GT(simulation.stats().elastic, 0);
}

// A box on the ground is pushed with less than friction holds, and then with more.
TEST(Steering, ForcesActAgainstContact) {
  scene::Scene scene = on_ground(0.5, 0.9);
  add_box(scene, "box", Vec3(0, 0.5, 0), Vec3::Ones(), 10).friction = 0.5;
  Simulation simulation(scene, plan(scene));
  for (int i = 0; i < 24; ++i) {
    simulation.add_force("box", Vec3(0.4 * 98, 0, 0));
    advance(simulation, 1);
  }
  EXPECT_LT(state_of(simulation, "box").pose.position.norm() - 0.5, 1e-3);
  EXPECT_NEAR(state_of(simulation, "box").pose.position.y(), 0.5, 1e-3);  // does not bounce
  for (int i = 0; i < 24; ++i) {
    simulation.add_force("box", Vec3(0.6 * 98, 0, 0), Vec3::Zero(), Vec3(0, 0, 0));
    advance(simulation, 1);
  }
  EXPECT_NEAR(state_of(simulation, "box").velocity.x(), 0.1 * 9.8, 0.05);
}

// A great force does not drive a fast body through a thin wall before it is seen.
TEST(Steering, GreatForcesShortenTheStep) {
  scene::Scene scene = free_space();
  scene::RigidBody& wall = add_box(scene, "wall", Vec3(0.4, 0, 0), Vec3(0.05, 4, 4), 1);
  wall.mass.reset();
  wall.is_static = true;
  add_ball(scene, "ball", Vec3::Zero(), 0.1, 1);
  Simulation simulation(scene, plan(scene));
  for (int i = 0; i < 4; ++i) {
    simulation.add_force("ball", Vec3(5000, 0, 0));
    advance(simulation, 1);
    ASSERT_LT(state_of(simulation, "ball").pose.position.x(), 0.4) << i;
  }
}

// A force along a hanging chain does the work that its energy gains.
TEST(Steering, ForcesOnJointedBodiesDoTheirWork) {
  scene::Scene scene = free_space();
  add_chain(scene, 3, scene::JointType::point, true);
  Simulation simulation(scene, plan(scene));
  double work = 0;
  for (int i = 0; i < 24; ++i) {
    const Vec3 before = state_of(simulation, "link2").pose.position, force(0, 20, 5);
    simulation.add_force("link2", force);
    advance(simulation, 1);
    work += force.dot(state_of(simulation, "link2").pose.position - before);
  }
  EXPECT_NEAR(simulation.stats().kinetic, work, 0.01 * work);
}

TEST(Steering, KinematicBodiesGoToTheirTargets) {
  const scene::Scene scene = with_kinematic_ball();
  Simulation simulation(scene, plan(scene));
  Pose target;
  target.position = Vec3(0.1, 1.2, 0.3);
  target.orientation = exponential(Vec3(0.2, 0.4, -0.3));
  simulation.set_target("driven", target);
  advance(simulation, 1);
  const RigidState& state = state_of(simulation, "driven");
  EXPECT_LT((state.pose.position - target.position).norm(), 1e-12);
  EXPECT_LT(state.pose.orientation.angularDistance(target.orientation), 1e-7);
  EXPECT_LT((state.velocity - Vec3(0.1, 0.2, 0.3) * scene.fps).norm(), 1e-9);
  // Without another target it stays.
  advance(simulation, 2);
  EXPECT_LT((state_of(simulation, "driven").pose.position - target.position).norm(), 1e-12);
  EXPECT_EQ(state_of(simulation, "driven").velocity, Vec3::Zero());
}

TEST(Steering, JointsGoToTheirTargets) {
  scene::Scene scene = free_space();
  add_chain(scene, 1, scene::JointType::hinge, true);
  scene.joints[0].has_control = true;
  scene.joints[0].control.gain = 2000;
  Simulation simulation(scene, plan(scene));
  simulation.set_target("peg-link0", Vec3(0.5, 0, 0));
  advance(simulation, 24);
  const Vec3 at = state_of(simulation, "link0").pose.position;
  EXPECT_NEAR(std::atan2(at.y(), at.x()), 0.5, 1e-3);
}

TEST(Steering, ReleasedJointsFallApart) {
  scene::Scene scene = free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  add_chain(scene, 2, scene::JointType::point, true);
  Simulation simulation(scene, plan(scene));
  advance(simulation, 6);
  const RigidState before = state_of(simulation, "link0");
  simulation.release("peg-link0");
  EXPECT_EQ(state_of(simulation, "link0").pose.position, before.pose.position);
  EXPECT_EQ(state_of(simulation, "link0").velocity, before.velocity);
  const Vec3 momentum = simulation.stats().momentum;
  advance(simulation, 12);
  // Nothing holds the links any more: 20 kg fall freely.
  EXPECT_LT((simulation.stats().momentum - momentum - Vec3(0, -9.8 * 20 * 12 / scene.fps, 0)).norm(), 1e-9);
  EXPECT_EQ(simulation.frame(), 18);
}

TEST(Steering, ReleasedBodiesFall) {
  scene::Scene scene = with_kinematic_ball();
  scene.gravity = Vec3(0, -9.8, 0);
  Simulation simulation(scene, plan(scene));
  Pose target;
  target.position = Vec3(0.5, 1, 0);
  simulation.set_target("driven", target);
  advance(simulation, 1);
  simulation.release("driven", 1000);
  advance(simulation, 12);
  const double t = 12 / scene.fps;
  // It goes on with the velocity of its motion, 0.5 m in a frame.
  EXPECT_LT((state_of(simulation, "driven").pose.position -
             Vec3(0.5 + 0.5 * scene.fps * t, 1 - 0.5 * 9.8 * t * t, 0))
                .norm(),
            1e-3);
}

TEST(Steering, ReleasedPinsLetGo) {
  scene::Scene scene = free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene::DeformableBody& soft = add_soft_box(scene, "soft", Vec3::Zero(), Vec3::Ones(), 2);
  scene::Pin& edge = soft.pins.emplace_back();
  edge.from = Vec3(-0.5, 0.5, -0.5);
  edge.to = Vec3(0.5, 0.5, -0.5);
  Simulation simulation(scene, plan(scene));
  advance(simulation, 2);
  const std::vector<Vec3> before = simulation.world().bodies.particles.x;
  const Vec3 momentum = simulation.stats().momentum;
  simulation.release("soft");
  EXPECT_EQ(simulation.world().bodies.particles.x, before);
  advance(simulation, 12);
  const double mass = simulation.world().bodies.deformable[0].mass;
  const Vec3 gained = simulation.stats().momentum - momentum;
  EXPECT_LT((gained - Vec3(0, -9.8 * mass * 12 / scene.fps, 0)).norm(), 1e-9 * gained.norm());
}

// What was left out on purpose stays out, and effects that are no longer called for are left out.
TEST(Steering, ReleaseKeepsEffectsThatWereLeftOut) {
  scene::Scene scene = on_ground();
  add_chain(scene, 2, scene::JointType::point, true);
  for (scene::RigidBody& body : scene.rigid) body.placement.position.y() += 2;
  for (scene::Joint& joint : scene.joints) joint.world.position->y() += 2;
  EffectSet effects = plan(scene);
  effects.reset(index(Effect::push_out));
  Simulation simulation(scene, effects);
  simulation.release("peg-link0");
  EXPECT_FALSE(simulation.world().has(Effect::push_out));
  EXPECT_TRUE(simulation.world().has(Effect::articulation));
  simulation.release("link0-link1");
  EXPECT_FALSE(simulation.world().has(Effect::articulation));
  advance(simulation, 6);
  EXPECT_LT(simulation.stats().momentum.y(), 0);
}

// Stages of applied forces are entered only while forces act, and nothing else differs.
TEST(Steering, CostsNothingWithoutForces) {
  scene::Scene scene = on_ground();
  add_box(scene, "box", Vec3(0, 1, 0), Vec3::Ones(), 10);
  Simulation simulation(scene, plan(scene));
  const auto calls = [&] {
    std::int64_t sum = 0;
    for (const StageStats& stage : simulation.stats().stages)
      if (stage.name.ends_with("applied forces")) sum += stage.calls;
    return sum;
  };
  advance(simulation, 1);
  EXPECT_EQ(calls(), 0);
  simulation.add_force("box", Vec3::UnitX());
  advance(simulation, 1);
  EXPECT_EQ(calls(), 2 * simulation.stats().substeps);
  advance(simulation, 1);
  EXPECT_EQ(calls(), 0);
}

// Returns the message of the error that `work` throws.
template <class Work>
std::string message_of(Work&& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    return error.what();
  }
  return "no error";
}

TEST(Steering, ErrorsNameTheRemedy) {
  scene::Scene scene = with_kinematic_ball();
  add_chain(scene, 1, scene::JointType::hinge, true);
  add_soft_box(scene, "soft", Vec3(9, 0, 0), Vec3::Ones(), 1);
  Simulation simulation(scene, plan(scene));
  const std::uint64_t hash = simulation.stats().hash;
  const auto starts = [&](auto&& work, const std::string& text) { EXPECT_EQ(message_of(work), text); };
  starts([&] { simulation.add_force("boxx", Vec3::UnitX()); },
         "there is no body `boxx` (did you mean `box`?)");
  starts([&] { simulation.add_force("driven", Vec3::UnitX()); },
         "`driven` takes no force: it is not dynamic");
  starts([&] { simulation.add_force("soft", Vec3::UnitX(), Vec3::UnitX()); },
         "`soft` takes no moment: it is deformable (add forces at points instead)");
  starts([&] { simulation.add_force("box", Vec3(0, std::nan(""), 0)); },
         "the force on `box` is (0, nan, 0): give finite numbers");
  starts([&] { simulation.set_target("peg-link0", Vec3::UnitX()); },
         "joint `peg-link0` has no target: give it `control` in the scene");
  starts([&] { simulation.set_target("box", Pose()); },
         "`box` has no target: it is not kinematic (give it a `motion` in the scene)");
  starts([&] { simulation.release("box"); },
         "nothing holds `box`: it is dynamic already (a joint is released by its own name)");
  starts([&] { simulation.release("soft"); }, "nothing holds `soft`: it has no pins and no `attach`");
  starts([&] { simulation.release("driven"); },
         "`driven` has no mass: give a density above 0 kg/m^3 to release it");
  starts([&] { simulation.release("peg-link0", 3); },
         "a density has no effect when `peg-link0` is released: only static and kinematic bodies take it");
  EXPECT_FALSE(simulation.world().applied.any);
  EXPECT_EQ(simulation.stats().hash, hash);
}

}  // namespace
}  // namespace duet::test::steering_test
