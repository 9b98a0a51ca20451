// Islands are independent. A body far away changes no bit of a stack, rigid or soft, as long as both scenes
// take the same steps, and a heavy body stays on a light one whatever else is in the scene.
#include <cstring>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/simulation/simulation.h"
#include "sim/step/world.h"

namespace duet::everyday_islands_test {
namespace {

// Kinds of bodies that are added 20 m away from the stack.
enum class Far {
  nothing,
  soft_box,
  ball,
  falling_box,
  jointed_boxes,
  sheet,
  hinged_box,  // to the world
  rope,
  particle,
  kinematic_box
};

// Joins `child` and `parent` at `position` (m).
void join(scene::Scene& scene, scene::JointType type, const std::string& parent, const std::string& child,
          const Vec3& position) {
  scene::Joint& joint = scene.joints.emplace_back();
  joint.name = "joint";
  joint.type = type;
  joint.parent = parent;
  joint.child = child;
  joint.world.position = position;
}

// Adds the body 20 m away from the stack.
void add_far(scene::Scene& scene, Far kind) {
  const Vec3 place(20, 0.5, 0);
  switch (kind) {
    case Far::nothing:
      return;
    case Far::soft_box:
      test::add_soft_box(scene, "far", place, Vec3(1, 1, 1), 2, 3e5);
      return;
    case Far::ball:
      test::add_ball(scene, "far", place, 0.5, 3);
      return;
    case Far::sheet:
      test::add_material(scene, "cloth").youngs_modulus = 1e4;
      test::add_panel(scene, "far", place, Vec2(1, 1), 3, 0.01);
      return;
    case Far::falling_box:
      test::add_box(scene, "far", place + Vec3(0, 0.3, 0), Vec3(1, 1, 1), 5);
      return;
    case Far::jointed_boxes: {
      test::add_box(scene, "far", place, Vec3(1, 1, 1), 5);
      test::add_box(scene, "farther", place + Vec3(2, 0, 0), Vec3(1, 1, 1), 5);
      join(scene, scene::JointType::point, "far", "farther", place + Vec3(1, 0, 0));
      return;
    }
    case Far::hinged_box:
      test::add_box(scene, "far", place + Vec3(0, 1, 0), Vec3(0.3, 0.3, 0.3), 5);
      join(scene, scene::JointType::hinge, "ground", "far", place + Vec3(0, 1.2, 0));
      return;
    case Far::rope:
      test::add_material(scene, "hemp").youngs_modulus = 1e6;
      test::add_rope(scene, "far", {place, place + Vec3(1, 0.2, 0)}, 5, 0.01);
      return;
    case Far::particle: {
      scene::DeformableBody& body = scene.deformable.emplace_back();
      body.name = "far";
      body.shape.kind = scene::DeformableKind::particle;
      body.shape.radius = 0.05;
      body.placement.position = place;
      body.mass = 0.1;
      body.material = test::add_material(scene, "dust").name;
      return;
    }
    case Far::kinematic_box: {
      scene::RigidBody& box = test::add_box(scene, "far", place + Vec3(0, 1, 0), Vec3(0.3, 0.3, 0.3), 5);
      box.is_kinematic = true;
      box.placement.velocity = Vec3(0.1, 0, 0);
      return;
    }
  }
}

// Returns a box of 10 kg that stands, 10 cm off the middle, on one whose mass is smaller by `ratio`.
scene::Scene uneven_stack(double ratio) {
  scene::Scene scene = test::on_ground(0.5);
  test::add_box(scene, "light", Vec3(0, 0.25, 0), Vec3(0.5, 0.5, 0.5), 10 / ratio);
  test::add_box(scene, "heavy", Vec3(0.1, 0.75, 0), Vec3(0.5, 0.5, 0.5), 10);
  return scene;
}

// Returns a tower of six boxes that get heavier upwards.
scene::Scene tower() {
  scene::Scene scene = test::on_ground(0.5);
  for (int i = 0; i < 6; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0.02 * (i % 3), 0.2 + 0.4 * i + 0.02, 0),
                  Vec3(0.4, 0.4, 0.4), 1 + i);
  return scene;
}

// Returns a soft column on a plate of a hundredth of its mass. This scene has contact inside its velocity
// solves.
scene::Scene column() {
  scene::Scene scene = test::on_ground(0.5);
  test::add_box(scene, "plate", Vec3(0, 0.1, 0), Vec3(1.3, 0.2, 1.3), 10);
  test::add_soft_box(scene, "column", Vec3(0, 0.7, 0), Vec3(1, 1, 1), 3, 2e6);
  return scene;
}

// Returns a light box on a soft cube.
scene::Scene load_on_soft() {
  scene::Scene scene = test::on_ground(0.5);
  test::add_soft_box(scene, "cube", Vec3(0, 0.25, 0), Vec3(0.5, 0.5, 0.5), 3, 1e5);
  test::add_box(scene, "load", Vec3(0.03, 0.56, 0), Vec3(0.2, 0.1, 0.2), 10);
  return scene;
}

scene::Scene implicitly(scene::Scene scene) {
  scene.solver.integration = scene::Integration::implicit;
  return scene;
}

// The state of a scene's bodies.
struct State {
  std::vector<RigidState> rigid;
  std::vector<Vec3> x, v;  // of particles
};

// Returns the state of the stack's bodies after `frames` frames.
State run(scene::Scene scene, Far kind, double longest_step, int frames) {
  const std::size_t rigid = scene.rigid.size(), deformable = scene.deformable.size();
  add_far(scene, kind);
  scene.solver.max_time_step = longest_step;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  const Bodies& bodies = simulation.world().bodies;
  const auto end_of = [](const DeformableBody& body) { return body.first_particle + body.particle_count; };
  const int particles = deformable > 0 ? end_of(bodies.deformable[deformable - 1]) : 0;
  const auto of_stack = [](const auto& values, auto count) {
    return std::vector(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  };
  return {of_stack(bodies.rigid.state, rigid), of_stack(bodies.particles.x, particles),
          of_stack(bodies.particles.v, particles)};
}

// Returns whether the kind of body is deformable.
bool is_soft(Far kind) {
  return kind == Far::soft_box || kind == Far::sheet || kind == Far::rope || kind == Far::particle;
}

// Checks that two states are almost the same.
void expect_near(const State& a, const State& b) {
  double most = 0;  // m
  for (std::size_t i = 0; i < a.rigid.size(); ++i)
    most = std::max(most, (a.rigid[i].pose.position - b.rigid[i].pose.position).norm());
  for (std::size_t p = 0; p < a.x.size(); ++p) most = std::max(most, (a.x[p] - b.x[p]).norm());
  test::expect_below(most, 2e-5, "difference, m");
}

// Checks that two states are the same to the last bit.
void expect_equal(const State& a, const State& b) {
  for (std::size_t i = 0; i < a.rigid.size(); ++i) {
    EXPECT_EQ(a.rigid[i].pose.position, b.rigid[i].pose.position) << "rigid body " << i;
    EXPECT_EQ(a.rigid[i].angular_momentum, b.rigid[i].angular_momentum) << "rigid body " << i;
  }
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.v, b.v);
}

// All runs have steps of 1 ms. A solve whose norm, preconditioner or number of iterations depends on all
// bodies of the scene, instead of on those of an island, changes bits. One search finds the implicit step of
// all deformable bodies, so that these differ within its tolerance.
TEST(EverydayIslands, AFarBodyChangesNoBitOfAStack) {
  test::Cases cases(4);  // 16 of 63
  for (const scene::Scene& scene : {uneven_stack(100), tower(), column(), load_on_soft(),
                                    implicitly(column()), implicitly(load_on_soft()), implicitly(tower())}) {
    const State alone = run(scene, Far::nothing, 1e-3, 6);
    for (const Far kind : {Far::soft_box, Far::ball, Far::falling_box, Far::jointed_boxes, Far::sheet,
                           Far::hinged_box, Far::rope, Far::particle, Far::kinematic_box}) {
      if (!cases.takes()) continue;
      SCOPED_TRACE(testing::Message()
                   << "scene with `" << scene.rigid.back().name << "`, integration "
                   << static_cast<int>(scene.solver.integration) << ", far body " << static_cast<int>(kind));
      const State beside = run(scene, kind, 1e-3, 6);
      const bool is_implicit = scene.solver.integration == scene::Integration::implicit;
      if (is_implicit && is_soft(kind) && !scene.deformable.empty())
        expect_near(alone, beside);
      else
        expect_equal(alone, beside);
    }
  }
}

// The step is the one that the rule chooses, and the soft box shortens it. At mass ratios of 100 and 1e4 the
// boxes must not move by a millimeter within two seconds.
TEST(EverydayIslands, AHeavyBoxStaysOnALightOneBesideAFarSoftBox) {
  for (const double ratio : {100.0, 1e4})
    for (const Far kind : {Far::nothing, Far::soft_box}) {
      const scene::Scene scene = uneven_stack(ratio);
      const std::vector<RigidState> state = run(scene, kind, 1.0 / 48, 48).rigid;
      for (std::size_t i = 0; i < state.size(); ++i)
        EXPECT_LT((state[i].pose.position - scene.rigid[i].placement.position).norm(), 1e-3)
            << ratio << ", " << static_cast<int>(kind);
    }
}

}  // namespace
}  // namespace duet::everyday_islands_test
