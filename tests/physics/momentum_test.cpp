// Two-way coupling: one body gains the momentum that the other loses, in every stage and over a whole run.
#include <functional>
#include <memory>

#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/contact/response/turned_impulses.h"
#include "sim/step/step.h"

namespace duet::momentum_test {
namespace {

using test::add_ball;
using test::add_box;
using test::add_soft_box;
using test::free_space;

// Returns a spinning ball that hits a deformable box off its center, with friction.
scene::Scene ball_hits_soft_box() {
  scene::Scene scene = free_space();
  add_soft_box(scene, "soft", Vec3(0, 0, 0), Vec3(2, 2, 2), 4);
  auto& ball = add_ball(scene, "ball", Vec3(0.4, 0.3, 2.3), 1, 6000);
  ball.placement.velocity = Vec3(1, 0, -17);
  ball.placement.angular_velocity = Vec3(0, 3, 1);
  ball.friction = 0.4;
  return scene;
}

// Returns a spinning ball that hits a spinning rigid box off its center.
scene::Scene ball_hits_rigid_box() {
  scene::Scene scene = free_space();
  add_box(scene, "box", Vec3(0, 0, 0), Vec3(2, 2, 2), 6000).placement.angular_velocity = Vec3(0.3, 0.2, -0.1);
  auto& ball = add_ball(scene, "ball", Vec3(0.4, 0.3, 2.3), 1, 6000);
  ball.placement.velocity = Vec3(1, 0, -17);
  ball.placement.angular_velocity = Vec3(0, 3, 1);
  return scene;
}

// Returns a rigid box between two soft ones that close in on it, all in contact, two of them spinning.
scene::Scene sandwich() {
  scene::Scene scene = free_space();
  add_soft_box(scene, "left", Vec3(-2.02, 0.3, 0), Vec3(2, 2, 2), 3).placement.velocity = Vec3(4, 0, 0);
  add_box(scene, "box", Vec3(0, 0, 0), Vec3(2, 2, 2), 600).placement.angular_velocity = Vec3(0, 0.5, 0);
  auto& right = add_soft_box(scene, "right", Vec3(2.02, -0.3, 0.2), Vec3(2, 2, 2), 3);
  right.placement.velocity = Vec3(-4, 0.5, 0);
  right.placement.angular_velocity = Vec3(0.5, 0, 0);
  return scene;
}

// Sums of the magnitudes of all momenta and moments of momentum in a scene, the scale of relative errors.
struct Scale {
  double linear = 0, angular = 0;
};

// Returns the scale of the bodies as they are now.
Scale scale_of(const Bodies& bodies) {
  Scale scale;
  const auto add = [&](const Vec3& x, const Vec3& p) {
    scale.linear += p.norm();
    scale.angular += x.norm() * p.norm();
  };
  for (std::size_t i = 0; i < bodies.particles.size(); ++i)
    add(bodies.particles.x[i], bodies.particles.mass[i] * bodies.particles.v[i]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    add(bodies.rigid.state[i].pose.position,
        bodies.rigid.properties[i].mass * bodies.rigid.state[i].velocity);
  return scale;
}

// Compares momenta before and after stages.
class Ledger {
 public:
  explicit Ledger(World& world) : world_(world), scale_(scale_of(world.bodies)) {}

  // Runs a stage that changes velocities, and checks that it keeps both momenta, about the positions at which
  // it acts. Where impacts are delayed, the delays are a part of the positions. Impulses of step III that V.4
  // lets act at the beginning of the step have another moment there, which the motion of the step gives back.
  void stage(const char* name, const std::function<void()>& run, bool has_delays = false,
             bool acts_at_start = false) {
    const Momentum before = momentum(world_.bodies);
    run();
    Momentum after = momentum(world_.bodies);
    const RigidBodies& rigid = world_.bodies.rigid;
    for (std::size_t i = 0; has_delays && i < rigid.size(); ++i)
      after.angular += rigid.state[i].delay.cross(rigid.properties[i].mass * rigid.state[i].velocity);
    if (acts_at_start)
      after = after - moved_by_turning(world_.context.contact.first_frames, world_.bodies,
                                       world_.context.contact.contacts);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-10 * scale_.linear) << name;
    EXPECT_LT((after.angular - before.angular).norm(), 1e-10 * scale_.angular) << name;
  }

 private:
  World& world_;
  Scale scale_;
};

// Checks the stages of 120 steps. The bound of 1e-10 is rounding.
void expect_stages_keep_momentum(const scene::Scene& scene) {
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  StepContext& context = world.context;
  Ledger ledger(world);
  const Vec3 first_velocity = world.bodies.rigid.state.back().velocity;
  for (int i = 0; i < 120; ++i) {
    context.time = 0;
    context.dt = choose_time_step(world, 0);
    begin_step(world, context);
    ledger.stage("I", [&] { run_stages(world, Stage::advance_velocity, Stage::air_drag_halfway); });
    // Step II replaces v~^{n+1/2} by v^^{n+1/2}; they differ by impulses alone.
    ledger.stage(
        "II", [&] { run_stages(world, Stage::contact_candidates, Stage::re_evolution); }, true);
    ledger.stage("III", [&] { run_stages(world, Stage::contact_graph, Stage::turn_of_joints); });
    const Vec3 linear = momentum(world.bodies).linear;
    run_stages(world, Stage::advance_position, Stage::push_out);
    EXPECT_LT((momentum(world.bodies).linear - linear).norm(), 1e-10 * scale_of(world.bodies).linear) << "IV";
    run_stages(world, Stage::back_to_collided, Stage::self_collision);
    {
      // V.2 and V.3 act at x^{n+1/2}: their forces have no moment there, but do at x^{n+1}.
      const std::vector<Vec3> before = world.bodies.particles.v;
      run_stages(world, Stage::repulsion_pairs_at_end, Stage::contact_in_solve_at_end);
      Vec3 moment = Vec3::Zero(), sum = Vec3::Zero();
      for (std::size_t p = 0; p < before.size(); ++p) {
        const Vec3 change = world.bodies.particles.mass[p] * (world.bodies.particles.v[p] - before[p]);
        sum += change;
        moment += (0.5 * (context.states.x_n[p] + world.bodies.particles.x[p])).cross(change);
      }
      EXPECT_LT(sum.norm(), 1e-10 * scale_of(world.bodies).linear) << "V.2";
      EXPECT_LT(moment.norm(), 1e-10 * scale_of(world.bodies).angular) << "V.2";
    }
    ledger.stage(
        "V.4", [&] { run_stages(world, Stage::contacts_at_end, Stage::contact_at_end); }, false, true);
    end_step(world);
  }
  EXPECT_GT((world.bodies.rigid.state.back().velocity - first_velocity).norm(), 0.1) << "nothing was tested";
}

// Each stage that changes velocities acts with equal and opposite impulses at one place. A stage that lets
// the two sides differ, or act at different points, changes the linear or the angular momentum.
TEST(Momentum, EveryStageKeepsItWhenABallHitsASoftBox) { expect_stages_keep_momentum(ball_hits_soft_box()); }
TEST(Momentum, EveryStageKeepsItWhenABallHitsARigidBox) {
  expect_stages_keep_momentum(ball_hits_rigid_box());
}
TEST(Momentum, EveryStageKeepsItInASandwich) { expect_stages_keep_momentum(sandwich()); }

// Two bodies that forces press onto each other: a ball of triangles rolls on a slab. The vertex that bears
// the load until the next one lands acts on both bodies alike, where it was at the beginning of the step.
TEST(Momentum, IsKeptWhereVerticesOfAMeshRelieveEachOther) {
  scene::Scene scene = free_space();
  scene::RigidBody& slab = add_box(scene, "slab", Vec3(0, -0.5, 0), Vec3(6, 1, 6), 4000);
  slab.friction = 1;
  const auto mesh = std::make_shared<TriangleMesh>(test::ball_mesh(0.3, 24, 12));
  scene::RigidBody& ball = test::add_mesh(scene, "ball", mesh, 1, 100);
  ball.placement.position = Vec3(-0.5, 0.3, 0);
  ball.placement.orientation = Quat(Eigen::AngleAxisd(double{EIGEN_PI} / 2, Vec3::UnitX()));
  ball.placement.velocity = Vec3(1, 0, 0);
  ball.placement.angular_velocity = Vec3(0, 0, -1 / 0.3);
  ball.friction = 1;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  StepContext& context = world.context;
  Ledger ledger(world);
  int relieved = 0;
  for (int i = 0; i < 60; ++i) {
    simulation.add_force("slab", Vec3(0, 1000, 0));
    simulation.add_force("ball", Vec3(0, -1000, 0));
    context.time = 0;
    context.dt = 0.01;
    begin_step(world, context);
    run_stages(world, Stage::advance_velocity, Stage::contact_in_solve_at_end);
    ledger.stage(
        "V.4", [&] { run_stages(world, Stage::contacts_at_end, Stage::contact_at_end); }, false, true);
    for (const ContactFrame& frame : context.contact.first_frames) relieved += !frame.relieved.isZero(0);
    end_step(world);
    world.applied.clear();
  }
  EXPECT_GT(relieved, 5) << "nothing was tested";
}

// Checks that a run keeps linear momentum to rounding, gains no energy, and that the ball really hits.
void expect_run_keeps_linear_momentum(const scene::Scene& scene) {
  Simulation simulation(scene, test::plan(scene));
  const FrameStats start = simulation.stats();
  const double scale = scale_of(simulation.world().bodies).linear;
  const Vec3 ball_velocity = simulation.world().bodies.rigid.state.back().velocity;
  for (int frame = 0; frame < 12; ++frame) {
    simulation.advance_frame();
    EXPECT_LT((simulation.stats().momentum - start.momentum).norm(), 1e-10 * scale);
    // The bound is 2 % of the side: contact keeps bodies apart at the end of every frame.
    EXPECT_LT(simulation.stats().max_penetration, 0.02 * 2);
  }
  EXPECT_GT((simulation.world().bodies.rigid.state.back().velocity - ball_velocity).norm(), 5) << "no impact";
  EXPECT_LE(simulation.stats().kinetic + simulation.stats().elastic, start.kinetic + start.elastic);
}

// A whole run must keep the momentum that each stage keeps.
TEST(Momentum, RunKeepsItWhenABallHitsASoftBox) { expect_run_keeps_linear_momentum(ball_hits_soft_box()); }
TEST(Momentum, RunKeepsItWhenABallHitsARigidBox) { expect_run_keeps_linear_momentum(ball_hits_rigid_box()); }

// Returns the change of angular momentum in a step of dt / 2^halvings. Without `keep_spin`, moving positions
// with v^{n+1/2} leaves a defect of second order in the step.
double angular_defect_per_step(int halvings) {
  scene::Scene scene = free_space();
  auto& soft = add_soft_box(scene, "soft", Vec3(0.5, 0, 0), Vec3(2, 1, 1), 3);
  soft.placement.angular_velocity = Vec3(1, 2, 3);
  scene.solver.keep_spin = false;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  // The box first takes some steps so that it is stretched and rings. At rest the forces vanish, and with
  // them the defect.
  const double dt = choose_time_step(world, 0);
  for (int i = 0; i < 40; ++i) step(world, 0, dt);
  const Vec3 before = momentum(world.bodies).angular;
  step(world, 0, dt / (1 << halvings));
  return (momentum(world.bodies).angular - before).norm();
}

// Halving the step must reduce the defect of a step as theory says; a first-order error in the positions
// would not fall as fast.
TEST(Momentum, AngularDefectOfMovingIsOfSecondOrder) {
  const double coarse = angular_defect_per_step(1), fine = angular_defect_per_step(2);
  RecordProperty("defect", std::to_string(coarse));
  EXPECT_GT(coarse, 0);
  // The defect of a step falls at least fourfold with half of the step. A factor of 3.5 leaves room for terms
  // of higher order.
  EXPECT_LT(fine, coarse / 3.5);
}

}  // namespace
}  // namespace duet::momentum_test
