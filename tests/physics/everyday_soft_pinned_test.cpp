// Deformable bodies that are pinned, or prescribed by a kinematic body, are obstacles to rigid bodies like
// any kinematic body.
#include <algorithm>
#include <cmath>

#include "tests/support/energy.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_soft_pinned_test {
namespace {

constexpr double gravity = 9.8;  // m/s^2

// A held deformable body and a body that falls on it.
struct Case {
  bool is_cloth = true;
  bool is_ball = true;
  double size = 1;           // m
  double drop = 0.3;         // sizes
  bool carried = false;      // prescribed by a kinematic body that rises and moves sideways
  double spacing = 1.0 / 6;  // of the mesh, in sizes
};

// Returns a sheet or a block of the given size whose particles are all held, with its top at y = 0, and a
// rigid body a fifth as large above it, beside all particles.
scene::Scene scene_of(const Case& c) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -gravity, 0);
  const double thickness = 0.01 * c.size;
  const int cells = static_cast<int>(std::lround(1 / c.spacing));
  scene::DeformableBody* held = nullptr;
  if (c.is_cloth) {
    test::add_material(scene, "cloth");
    held =
        &test::add_panel(scene, "held", Vec3(0, -thickness / 2, 0), Vec2(c.size, c.size), cells, thickness);
  } else {
    held = &test::add_soft_box(scene, "held", Vec3(0, -c.size / 2, 0), Vec3::Constant(c.size), cells);
  }
  held->pins = {{.from = Vec3::Zero(), .to = {}, .radius = 2 * c.size, .body = c.carried ? "carrier" : ""}};
  if (c.carried) {
    scene::RigidBody& carrier = test::add_ball(scene, "carrier", Vec3(0, -3 * c.size, 0), 0.1 * c.size, 1);
    carrier.mass.reset();
    carrier.is_kinematic = true;
    for (const auto& [time, place] : {std::pair(0.0, Vec3(0, -3, 0)), std::pair(2.0, Vec3(0.3, -2.5, 0))}) {
      scene::Keyframe& key = carrier.motion.keyframes.emplace_back();
      key.time = time * std::sqrt(c.size);
      key.position = c.size * place;
    }
  }
  const Vec3 place = c.size * Vec3(0.045, 0.1 + c.drop, 0.031);
  const double mass = 500 * std::pow(0.2 * c.size, 3);
  scene::RigidBody& body = c.is_ball
                               ? test::add_ball(scene, "body", place, 0.1 * c.size, mass)
                               : test::add_box(scene, "body", place, Vec3::Constant(0.2 * c.size), mass);
  body.friction = 1;
  return scene;
}

// Checks that the rigid body rests on the held one after two seconds, and that held particles follow their
// prescribed motion to rounding. The heights' bound of 1e-4 sizes is a measurement with a margin.
void expect_rests(const Case& c) {
  SCOPED_TRACE(fmt::format("cloth {}, ball {}, size {}, carried {}, spacing {}", c.is_cloth, c.is_ball,
                           c.size, c.carried, c.spacing));
  scene::Scene scene = scene_of(c);
  scene.fps = 24 / std::sqrt(c.size);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const std::size_t body = c.carried ? 1 : 0;
  const Vec3 top = bodies.particles.x[0];
  double deepest = 0;
  for (int frame = 0; frame < 48; ++frame) {
    simulation.advance_frame();
    deepest = std::max(deepest, simulation.stats().max_penetration);
  }
  const Vec3 moved = bodies.particles.x[0] - top;
  const Vec3 led = c.carried ? Vec3(0.3, 0.5, 0) : Vec3(Vec3::Zero());
  EXPECT_LT((moved - c.size * led).norm(), 1e-9 * c.size);
  const RigidState& state = bodies.rigid.state[body];
  test::expect_below(std::abs(state.pose.position.y() - moved.y() - 0.1 * c.size) / c.size, 1e-4,
                     "height, sizes");
  // A ball that the carrier has set rolling crosses lines of the mesh, which costs a larger bound.
  const double rolls = c.carried && c.is_ball ? 5e-3 : 1e-3;
  test::expect_below(std::abs(state.velocity.y()) / std::sqrt(gravity * c.size), rolls, "speed");
  test::expect_below(deepest / c.size, 2e-3, "penetration, sizes");
}

// Two faces without free particles must carry a body as well as many do.
TEST(EverydaySoftPinned, PinnedFacesCarryBodies) {
  test::Cases cases(3);  // 3 of 8
  for (const bool is_cloth : {true, false})
    for (const bool is_ball : {true, false})
      for (const double spacing : {1.0, 1.0 / 6})
        if (cases.takes()) expect_rests({is_cloth, is_ball, 1, 0.3, false, spacing});
}

// A body on particles that a kinematic body moves is lifted and led along as on that body itself.
TEST(EverydaySoftPinned, SoDoCarriedOnes) {
  test::Cases cases(3);  // 2 of 4
  for (const bool is_cloth : {true, false})
    for (const bool is_ball : {true, false})
      if (cases.takes()) expect_rests({.is_cloth = is_cloth, .is_ball = is_ball, .carried = true});
}

// Bounds are relative to the size.
TEST(EverydaySoftPinned, OfAnySize) {
  test::Cases cases(3);  // 2 of 4: small cloth and a large block
  for (const double size : {0.01, 100.0})
    for (const bool is_cloth : {true, false})
      if (cases.takes()) expect_rests({.is_cloth = is_cloth, .size = size});
}

// No force moves a held or a static body, so there is no contact between them, even if they overlap.
TEST(EverydaySoftPinned, HeldPartsDoNotTouchWhatNoForceMoves) {
  scene::Scene scene = scene_of({});
  scene.rigid.clear();
  scene::RigidBody& box = test::add_box(scene, "box", Vec3::Zero(), Vec3(0.5, 0.5, 0.5), 1);
  box.is_static = true;
  box.mass.reset();
  Simulation simulation(scene, test::plan(scene));
  EXPECT_TRUE(simulation.initial_overlaps().empty());
  EXPECT_EQ(simulation.stats().max_penetration, 0);
  simulation.advance_frame();
  EXPECT_EQ(simulation.stats().contacts, 0);
}

// A flag that is pinned in or at its pole overlaps it there, and falls as one that is pinned beside it does.
// Contact in the faces between held and free particles cannot open the overlap; if it tried to, a flag at the
// surface would gain 742 J, and up to 1e5 J if it is thick, where gravity gives some joules.
TEST(EverydaySoftPinned, FlagsOverlapTheirPolesWhereTheyArePinned) {
  constexpr double radius = 0.04;  // m
  test::Cases cases(5);
  for (const double depth : {0.0, 0.001, radius})
    for (const double thickness : {0.001, 0.004, 0.012})
      for (const bool is_cylinder : {true, false})
        for (const scene::Accuracy accuracy :
             {scene::Accuracy::draft, scene::Accuracy::standard, scene::Accuracy::fine})
          for (const bool implicit : {false, true}) {
            if (!cases.takes()) continue;
            scene::Scene scene = test::free_space();
            scene.gravity = Vec3(0, -gravity, 0);
            scene.solver = scene::preset(accuracy);
            if (implicit) scene.solver.integration = scene::Integration::implicit;
            scene::Material& material = test::add_material(scene, "cloth");
            material.density = 300;
            material.youngs_modulus = 3e5;
            scene::DeformableBody& flag =
                test::add_panel(scene, "flag", Vec3::Zero(), Vec2(1.2, 0.8), 8, thickness);
            flag.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
            flag.pins = {{.from = Vec3(-0.6, 0, -0.4), .to = Vec3(-0.6, 0, 0.4), .radius = 0.01, .body = {}}};
            scene::RigidBody& pole = test::add_box(scene, "pole", Vec3(-0.6 - radius + depth, 0, 0),
                                                   Vec3(2 * radius, 3, 2 * radius), 1);
            if (is_cylinder) pole.shape = {.kind = scene::ShapeKind::cylinder, .radius = radius, .length = 3};
            pole.is_static = true;
            pole.mass.reset();
            const std::string what = fmt::format("flag of {} m, {} m in a {}, {}{}", thickness, depth,
                                                 is_cylinder ? "cylinder" : "box",
                                                 accuracy == scene::Accuracy::draft      ? "draft"
                                                 : accuracy == scene::Accuracy::standard ? "standard"
                                                                                         : "fine",
                                                 implicit ? ", implicit" : "");
            test::expect_below(test::gain_of(scene, 10), 1e-3, "gain of " + what);
          }
}

// A cloth that is pinned inside of a pole stays in it beside the pin, so the note on the overlap names the
// pin. Without one, or with one beside the pole, it does not.
TEST(EverydaySoftPinned, NotesOnOverlapsNamePinsInside) {
  for (const double pinned_at : {-0.5, 0.5}) {
    scene::Scene scene = test::free_space();
    test::add_material(scene, "cloth").youngs_modulus = 1e4;
    test::add_panel(scene, "flag", Vec3::Zero(), Vec2(1, 1), 8, 0.01).pins = {
        {.from = Vec3(pinned_at, 0, 0), .to = {}, .radius = 1e-3, .body = {}}};
    scene::RigidBody& pole = test::add_box(scene, "pole", Vec3(-0.5, 0, 0), Vec3(0.1, 2, 0.1), 1);
    pole.is_static = true;
    pole.mass.reset();
    Simulation simulation(scene, test::plan(scene));
    ASSERT_EQ(simulation.initial_overlaps().size(), 1U);
    EXPECT_EQ(simulation.initial_overlaps().front().is_pinned_inside, pinned_at < 0);
  }
}

// Impulses on pinned particles come from outside, and the ledger must book them as such: no stage has a
// defect.
TEST(EverydaySoftPinned, TheLedgerCountsWhatTheyGive) {
  const scene::Scene scene = scene_of({.drop = 0.01});
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  for (int frame = 0; frame < 6; ++frame) {
    simulation.advance_frame();
    for (const LedgerStats& stage : simulation.stats().ledger)
      EXPECT_LT(stage.momentum_defect, 1e-9) << stage.name;
  }
}

}  // namespace
}  // namespace duet::everyday_soft_pinned_test
