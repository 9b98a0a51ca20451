// The factorized matrix of a velocity solve undoes its operator, with damping, elasticity, contact, drives
// and bones.
#include "sim/solve/velocity_factor.h"

#include <algorithm>

#include "tests/support/random_state.h"
#include <gtest/gtest.h>

#include "sim/articulation/joint_solver.h"

namespace duet::velocity_factor_test {
namespace {

constexpr double dt = 5e-3;  // s

// A world in contact after a few steps, and its system of velocities.
class System {
 public:
  explicit System(const scene::Scene& scene) : simulation_(scene, test::plan(scene)) {
    for (int i = 0; i < 3; ++i) step(simulation_.world(), 0, 1e-3);  // so that contacts carry weight
    islands_.begin(bodies());
    islands_.finish();
    std::vector<Vec3> force(bodies().particles.size(), Vec3::Zero());
    bodies().forces.add_elastic_forces(bodies().particles.x, force);
    bodies().forces.linearize();
    blocks_.find(bodies(), dt);
  }
  Bodies& bodies() { return simulation_.world().bodies; }
  // Builds the contacts of the last step, with sliding friction, and returns how many rows they have.
  std::size_t build_contacts() {
    StepContext& context = simulation_.world().context;
    VelocitySystem(bodies(), dt, ImplicitForces::damping, nullptr, force_, inertia_);
    contacts_.build(bodies(), context.contact.contacts, context.contact.graph, islands_, 1, blocks_.own());
    contacts_.evaluate(test::random_velocity(bodies(), 3));
    contacts_.set_bounds();
    contacts_.evaluate(test::random_velocity(bodies(), 4));
    std::vector<ResponseRow> rows;
    contacts_.append_rows(rows);
    return rows.size();
  }
  // Returns the largest error of the velocities that the factor finds for the operator's image of random
  // ones, relative to the largest of these.
  double error(ImplicitForces forces) {
    VelocitySystem system(bodies(), dt, forces, nullptr, force_, inertia_);
    VelocityFactor factor;
    EXPECT_TRUE(factor.factorize(bodies(), dt, forces, inertia_, &islands_, &contacts_, nullptr));
    double worst = 0;
    for (unsigned seed = 10; seed < 13; ++seed) {
      GeneralizedVelocity v = test::random_velocity(bodies(), seed), image, found;
      for (std::size_t p = 0; p < v.particle.size(); ++p)
        if (is_held(bodies().particles, p)) v.particle[p].setZero();
      follow_twists(bodies().bound, v.linear, v.angular, v.particle);
      system.apply(v, image);
      contacts_.add_differentials(v, image);
      factor.apply(bodies(), inertia_, image, found);
      follow_twists(bodies().bound, found.linear, found.angular, found.particle);
      VelocitySystem::axpy(-1, v, found);
      for (const std::vector<Vec3>* values : {&found.particle, &found.linear, &found.angular})
        for (const Vec3& value : *values) worst = std::max(worst, value.cwiseAbs().maxCoeff());
    }
    return worst;
  }

 private:
  Simulation simulation_;
  Islands islands_;
  VelocityBlocks blocks_;
  ContactForces contacts_;
  std::vector<Vec3> force_;
  std::vector<Mat3> inertia_;
};

// Stiff contacts and rounding leave nine digits.
constexpr double digits = 1e-9;

TEST(VelocityFactor, UndoesTheSystemOfAStack) {
  System stack(test::small_stack());
  EXPECT_LT(stack.error(ImplicitForces::damping), digits);
  EXPECT_LT(stack.error(ImplicitForces::damping_and_elasticity), digits);
  ASSERT_GT(stack.build_contacts(), 20U);
  EXPECT_LT(stack.error(ImplicitForces::damping), digits);
  EXPECT_LT(stack.error(ImplicitForces::damping_and_elasticity), digits);
}

// Bones carry particles of the flesh: forces on these move the bones.
TEST(VelocityFactor, UndoesTheSystemOfBonesInFlesh) {
  scene::Scene scene = test::on_ground(0.4);
  test::add_soft_box(scene, "flesh", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 4);
  test::add_box(scene, "bone", Vec3(0, 0.5, 0), Vec3(0.6, 0.3, 0.3), 300);
  scene.deformable.back().attach = {"bone"};
  System system(scene);
  ASSERT_FALSE(system.bodies().bound.empty());
  EXPECT_LT(system.error(ImplicitForces::damping_and_elasticity), digits);
}

}  // namespace
}  // namespace duet::velocity_factor_test
