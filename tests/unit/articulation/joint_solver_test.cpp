#include "sim/articulation/joint_solver.h"

#include <random>

#include "tests/support/articulated.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/step/world.h"

namespace duet::joint_solver_test {
namespace {

// Returns a chain that contains all kinds of joints, with a static body at one end.
scene::Scene mixed() {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 7, scene::JointType::point, true);
  const scene::JointType types[] = {scene::JointType::point,     scene::JointType::hinge,
                                    scene::JointType::universal, scene::JointType::prismatic,
                                    scene::JointType::weld,      scene::JointType::prismatic_twist,
                                    scene::JointType::hinge};
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    scene.joints[i].type = types[i];
    scene.joints[i].world.axis = Vec3(1, 0.2 * static_cast<double>(i), -0.3);
  }
  return scene;
}

// Velocities (m/s) and angular velocities (rad/s) of all bodies.
struct Twists {
  std::vector<Vec3> linear, angular;
};

// Returns random twists, with zero for the first body.
Twists random_twists(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vec3(number(random), number(random), number(random)); };
  Twists twists;
  for (std::size_t i = 0; i < count; ++i) {
    twists.linear.push_back(i == 0 ? Vec3(Vec3::Zero()) : vector());  // body 0 is static
    twists.angular.push_back(i == 0 ? Vec3(Vec3::Zero()) : vector());
  }
  return twists;
}

// Returns the inner product a . M b of two twists, where M is the mass matrix of the dynamic bodies.
double inner(const RigidBodies& rigid, const Twists& a, const Twists& b) {
  double sum = 0;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    sum += rigid.properties[i].mass * a.linear[i].dot(b.linear[i]);
    sum += a.angular[i].dot(rigid.state[i].inverse_inertia.inverse() * b.angular[i]);
  }
  return sum;
}

// The joints project twists orthogonally in the inner product of the mass matrix M: P P a = P a, Pa . M b = a
// . M P b, and the projection adds no energy. The bounds are rounding over a chain of seven bodies. A row or
// an inertia that the solver and the rows disagree about makes P oblique.
TEST(JointSolver, ProjectsOrthogonally) {
  const scene::Scene scene = mixed();
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  RigidBodies& rigid = world.bodies.rigid;
  JointSolver& joints = world.context.joints.solver;
  joints.update(world.bodies.articulation, rigid);
  joints.prepare_projection(rigid);
  const auto projected = [&](Twists v) {
    joints.project(rigid, v.linear, v.angular);
    return v;
  };
  const Twists a = random_twists(rigid.size(), 1), b = random_twists(rigid.size(), 2);
  const Twists Pa = projected(a), PPa = projected(Pa), Pb = projected(b);
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    EXPECT_LT((PPa.linear[i] - Pa.linear[i]).norm(), 1e-12);
    EXPECT_LT((PPa.angular[i] - Pa.angular[i]).norm(), 1e-12);
  }
  EXPECT_NEAR(inner(rigid, Pa, b), inner(rigid, a, Pb), 1e-11);
  EXPECT_LE(inner(rigid, Pa, Pa), inner(rigid, a, a));
}

// The rows of every joint are the time derivatives of its errors, by central differences with h = 1e-6 s:
// truncation is of order h^2 and rounding of order 1e-16 / h = 1e-10, below the bound of 1e-8. So the
// directions that each joint leaves free are those that its type names.
TEST(JointSolver, RowsAreTheDerivativesOfTheErrors) {
  const scene::Scene scene = mixed();
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const Twists v = random_twists(bodies.rigid.size(), 3);
  constexpr double h = 1e-6;
  for (const Joint& joint : bodies.articulation.joints) {
    const auto parent = static_cast<std::size_t>(joint.parent), child = static_cast<std::size_t>(joint.child);
    std::vector<JointRow> rows = rows_of(joint);
    Quat reference;
    update_rows(joint, bodies.rigid.state[parent].pose, bodies.rigid.state[child].pose, rows.data(),
                rows.size(), reference);
    const auto moved = [&](std::size_t body, double by) {
      Pose pose = bodies.rigid.state[body].pose;
      pose.position += by * v.linear[body];
      pose.orientation = exponential(by * v.angular[body]) * pose.orientation;
      return pose;
    };
    for (const JointRow& row : rows) {
      const auto error = [&](double by) {
        return structure_error(joint, row, JointFrames(joint, moved(parent, by), moved(child, by)),
                               reference);
      };
      const double rate = row.linear.dot(v.linear[child] - v.linear[parent]) +
                          row.child_moment.dot(v.angular[child]) - row.parent_moment.dot(v.angular[parent]);
      EXPECT_NEAR(rate, (error(h) - error(-h)) / (2 * h), 1e-8) << joint.name;
    }
  }
}

}  // namespace
}  // namespace duet::joint_solver_test
