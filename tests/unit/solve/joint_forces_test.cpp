// Control, friction and limits of joints inside a velocity solve, on random velocities: their impulses are
// the gradient of a potential, stay within their bounds, and have the blocks and the sums of a joint's row.
#include "sim/solve/joint_forces.h"

#include <algorithm>

#include "tests/support/articulated.h"
#include "tests/support/random_state.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet::joint_forces_test {
namespace {

using test::random_velocity;

// A column of three boxes on the ground: a slide with a bounded control, a hinge with friction, and a slide
// at its limit.
scene::Scene driven_column() {
  scene::Scene scene = test::on_ground(0.3);
  for (int i = 0; i < 3; ++i)
    test::add_box(scene, std::string(1, static_cast<char>('a' + i)), Vec3(0, 0.5 + i, 0), Vec3(0.4, 0.3, 0.2),
                  1 + 2 * i);
  scene::Joint& slide =
      test::add_joint(scene, scene::JointType::prismatic, "ground", "a", Vec3(0.1, 0.4, 0), Vec3::UnitY());
  slide.has_control = true;
  slide.control.gain = 400;
  slide.control.torque_limit = 200;
  slide.control.target.travel = 0.2;
  test::add_joint(scene, scene::JointType::hinge, "a", "b", Vec3(0, 1, 0.1), Vec3::UnitZ()).friction = 40;
  test::add_joint(scene, scene::JointType::prismatic, "b", "c", Vec3(0, 2, 0), Vec3::UnitX()).travel.most = 0;
  return scene;
}

class DriveInSolve : public ::testing::Test {
 protected:
  static constexpr double dt = 0.01;  // s
  DriveInSolve() : scene_(driven_column()), simulation_(scene_, test::plan(scene_)) {
    for (int i = 0; i < 3; ++i) step(world(), i * 1e-3, 1e-3);
    islands_.begin(bodies());
    islands_.finish();
    joints().plan_control(bodies().articulation, bodies().rigid, 0.003, dt, world().last_step.control_angle);
    joints().drive_rows(bodies().articulation, bodies().rigid, RateAt::whole_step, dt, dt, rows_);
    std::vector<double> impulses(20, 0.1);
    forces_.build(bodies().rigid, rows_, islands_, std::vector<double>(islands_.size(), 5), impulses, 1);
  }
  World& world() { return simulation_.world(); }
  Bodies& bodies() { return world().bodies; }
  JointSolver& joints() { return world().context.joints.solver; }
  GeneralizedVelocity zero() { return test::no_velocity(bodies()); }
  double inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) {
    return VelocitySystem(bodies(), dt, ImplicitForces::damping, nullptr, force_, inertia_).inner(u, v);
  }
  double potential(const GeneralizedVelocity& at, double share, const GeneralizedVelocity& direction) {
    GeneralizedVelocity there = at;
    VelocitySystem::axpy(share, direction, there);
    return forces_.evaluate(there);
  }

  scene::Scene scene_;
  Simulation simulation_;
  Islands islands_;
  std::vector<DriveRow> rows_;
  JointForces forces_;
  std::vector<Vec3> force_;
  std::vector<Mat3> inertia_;
};

// The bounds of control and friction are those of force and torque times the time of the solve.
TEST_F(DriveInSolve, RowsHaveTheBoundsOfTheirJoints) {
  ASSERT_EQ(rows_.size(), 3u);
  EXPECT_EQ(rows_[0].geometry.role, RowRole::control);
  EXPECT_DOUBLE_EQ(rows_[0].bounds.most, 200 * dt);
  EXPECT_GT(rows_[0].target, 0);
  EXPECT_EQ(rows_[1].geometry.role, RowRole::friction);
  EXPECT_DOUBLE_EQ(rows_[1].bounds.least, -40 * dt);
  EXPECT_EQ(rows_[2].geometry.role, RowRole::limit);
  EXPECT_EQ(rows_[2].bounds.least, 0);
}

// The derivative of the potential along d is -d . impulses, by central differences, and the differentials are
// the derivative of the impulses. Speeds of up to 1 m/s take the rows to their bounds, lower ones do not.
TEST_F(DriveInSolve, ImpulsesAreTheGradientOfTheirPotential) {
  int bounded = 0, free = 0;
  for (unsigned seed = 1; seed < 40; ++seed) {
    GeneralizedVelocity v = random_velocity(bodies(), seed), d = random_velocity(bodies(), seed + 50);
    if (seed % 2 == 0)
      for (std::vector<Vec3>* part : {&v.linear, &v.angular})
        for (Vec3& value : *part) value *= 1e-3;
    constexpr double share = 1e-6;
    const double slope = (potential(v, share, d) - potential(v, -share, d)) / (2 * share);
    GeneralizedVelocity before = zero(), after = zero(), differentials = zero();
    potential(v, -share, d);
    forces_.add_velocities(1, before);
    potential(v, share, d);
    forces_.add_velocities(1, after);
    potential(v, 0, d);
    GeneralizedVelocity impulses = zero();
    forces_.add_velocities(1, impulses);
    const double expected = -inner(d, impulses);
    EXPECT_NEAR(slope, expected, 1e-5 * std::max(1.0, std::abs(expected)));
    forces_.add_differentials(d, differentials);
    VelocitySystem::axpy(-1, before, after);
    const double curvature = inner(d, differentials), by_difference = -inner(d, after) / (2 * share);
    EXPECT_NEAR(curvature, by_difference, 1e-5 * std::max(1.0, curvature));
    (curvature > 0 ? free : bounded) += 1;
    std::vector<Mat6> blocks(bodies().rigid.size(), Mat6::Zero());
    forces_.add_blocks(blocks);
    for (const Mat6& block : blocks) EXPECT_GE(block.diagonal().minCoeff(), 0);
  }
  EXPECT_GT(free, 0);
  EXPECT_GT(bounded, 0);
}

// The joint solve that follows starts from the impulses of the solve: if the velocities have them already,
// and nothing else has changed these, it finds the same ones.
TEST_F(DriveInSolve, JointsStartFromTheImpulsesOfASolve) {
  joints().begin_impulses(bodies().articulation, dt);
  joints().stabilize_and_control(bodies().articulation, bodies().rigid);
  const std::vector<double> found = joints().impulses();
  EXPECT_GT(found[rows_[0].row], 0);
  joints().drive_rows(bodies().articulation, bodies().rigid, RateAt::end, dt, dt, rows_);
  forces_.build(bodies().rigid, rows_, islands_, std::vector<double>(islands_.size(), 5), found, 1);
  joints().begin_impulses(bodies().articulation, dt);
  forces_.hand_to(joints());
  joints().stabilize_and_control(bodies().articulation, bodies().rigid);
  for (const DriveRow& row : rows_) {
    EXPECT_NEAR(joints().impulses()[row.row], found[row.row], 1e-9);
    EXPECT_GE(found[row.row], row.bounds.least);
    EXPECT_LE(found[row.row], row.bounds.most);
  }
}

}  // namespace
}  // namespace duet::joint_forces_test
