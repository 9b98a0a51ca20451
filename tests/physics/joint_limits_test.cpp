// Bodies with jointed limbs that fall on the ground: limits and friction of joints do no positive work,
// whatever the kinds of joints, the limits, the friction and the step.
#include <array>
#include <utility>

#include "tests/support/articulated.h"
#include "tests/support/energy.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/random_scenes.h"
#include <fmt/format.h>

namespace duet::joint_limits_test {
namespace {

using test::Draw;

constexpr double density = 1000;  // kg/m^3
constexpr int frames = 60;

// Adds a box that moves with `velocity` (m/s).
void add_part(scene::Scene& scene, const std::string& name, const Vec3& position, const Vec3& size,
              const Vec3& velocity, double restitution) {
  scene::RigidBody body;
  body.name = name;
  body.shape = {.kind = scene::ShapeKind::box, .size = size};
  body.placement.position = position;
  body.placement.velocity = velocity;
  body.density = density;
  body.friction = 0.6;
  body.restitution = restitution;
  scene.rigid.push_back(body);
}

scene::Scene on_ground() {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8, 0);
  scene.ground = scene::Ground{.friction = 0.6, .restitution = 0, .look = {}};
  return scene;
}

// Returns a cube with two to five limbs of one or two pieces, on hinges, point joints and universal joints.
scene::Scene limbs(std::uint64_t seed) {
  Draw draw(seed);
  scene::Scene scene = on_ground();
  constexpr std::array steps{0.0, 0.0, 0.005, 0.002};  // s, 0: the rule's
  constexpr std::array torques{0.0, 0.05, 0.5, 5.0};   // N m
  const double longest = steps[as_index(draw.below(4))], friction = torques[as_index(draw.below(4))];
  if (longest > 0) scene.solver.max_time_step = longest;
  const double restitution = 0.2 * draw.below(3), height = draw(1.1, 1.6);
  const Vec3 velocity(draw(-1.5, 1.5), 0, draw(-1.5, 1.5));
  add_part(scene, "trunk", height * Vec3::UnitY(), Vec3::Constant(0.3), velocity, restitution);
  const int count = 2 + draw.below(4), first = draw.below(6);
  for (int i = 0; i < count; ++i) {
    const int axis = (first + i) % 3;
    const Vec3 along = ((first + i) % 6 < 3 ? 1 : -1) * Vec3::Unit(axis);
    std::string parent = "trunk";
    const int pieces = 1 + draw.below(2);
    for (int k = 0; k < pieces; ++k) {
      const double from = 0.15 + 0.37 * k;  // m, end of the parent
      const std::string name = fmt::format("limb{}_{}", i, k);
      Vec3 size = Vec3::Constant(0.1);
      size[axis] = 0.3;
      add_part(scene, name, height * Vec3::UnitY() + (from + 0.22) * along, size, velocity, restitution);
      const int kind = draw.below(4);
      const auto type = kind < 2    ? scene::JointType::hinge
                        : kind == 2 ? scene::JointType::point
                                    : scene::JointType::universal;
      const Vec3 turn = Vec3::Unit((axis + 1 + draw.below(2)) % 3);
      scene::Joint& joint =
          test::add_joint(scene, type, parent, name, height * Vec3::UnitY() + (from + 0.035) * along,
                          type == scene::JointType::hinge ? turn : along);
      joint.friction = friction;
      if (type == scene::JointType::hinge) joint.angle = {.least = -draw(5, 90), .most = draw(5, 140)};
      if (type == scene::JointType::point) joint.swing = draw(20, 60);
      parent = name;
    }
  }
  return scene;
}

// Returns a trunk with two arms and two legs on point joints, with limits of swing and friction.
scene::Scene figure(double swing, double friction) {
  scene::Scene scene;
  scene.ground = scene::Ground{};
  const Vec3 velocity(0.15, 0, 0.5);
  const double restitution = 0.3;
  add_part(scene, "trunk", Vec3(0, 1.2, 0), Vec3(0.3, 0.5, 0.2), velocity, restitution);
  for (const double side : {1.0, -1.0}) {
    const std::string arm = side > 0 ? "left_arm" : "right_arm", leg = side > 0 ? "left_leg" : "right_leg";
    add_part(scene, arm, Vec3(0.32 * side, 1.4, 0), Vec3(0.3, 0.08, 0.08), velocity, restitution);
    add_part(scene, leg, Vec3(0.1 * side, 0.7, 0), Vec3(0.12, 0.45, 0.12), velocity, restitution);
    test::add_joint(scene, scene::JointType::point, "trunk", arm, Vec3(0.16 * side, 1.4, 0), Vec3::UnitY());
    test::add_joint(scene, scene::JointType::point, "trunk", leg, Vec3(0.1 * side, 0.94, 0), Vec3::UnitY());
  }
  for (scene::Joint& joint : scene.joints) {
    joint.swing = swing;
    joint.friction = friction;
  }
  return scene;
}

// Before joint solves went over to steps that never add energy, the run with 60 degrees and 0.5 N m ended
// with steps that had become too short.
TEST(JointLimits, FiguresWithSwingAndFrictionGainNoEnergy) {
  double most = 0;
  for (const auto& [swing, friction] : {std::pair{60.0, 0.5}, {30.0, 0.0}})
    most = std::max(most, test::gain_of(figure(swing, friction), frames));
  test::expect_below(most, 1e-3, "most_gain");
}

// Before limits that act in step III acted in V.4, seed 3 gained 2.5 % of the energy of its motion.
TEST(JointLimits, RandomLimbsGainNoEnergy) {
  double most = 0;
  const int count = test::runs_in_full() ? 200 : 6;
  for (int seed = 1; seed <= count; ++seed) {
    const double gain = test::gain_of(limbs(static_cast<std::uint64_t>(seed)), frames);
    EXPECT_LT(gain, 1e-3) << seed;
    most = std::max(most, gain);
  }
  test::expect_below(most, 1e-3, "most_gain");
}

}  // namespace
}  // namespace duet::joint_limits_test
