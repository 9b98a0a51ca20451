// Cloth, ropes and particles between plates that leave less room than they are thick. The statistics report
// it, and no body is thrown.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_soft_pinched_test {
namespace {

// Kinds of thin bodies.
enum class Thin { cloth, rope, particle };

// A thin body between two plates.
struct Press {
  Thin thin = Thin::cloth;
  double size = 1;       // 1 for half a meter
  double least = 0.004;  // sizes, smallest gap between the plates; the thickness is 0.005
  double friction = 0.8;
  double youngs_modulus = 1e6;  // Pa
  bool both_move = true;        // false: the lower plate is static
};

// Returns the time that a wave takes through the body, over that through a meter at 1e6 Pa.
double pace(const Press& press) { return press.size * std::sqrt(1e6 / press.youngs_modulus); }

// Adds the plate on the side `side` (-1 or 1). Moving plates close within 0.1 s times pace(), hold for as
// long, and open within as long again.
void add_plate(scene::Scene& scene, const Press& press, double side) {
  const double size = press.size, open = 0.02;
  scene::RigidBody& plate =
      test::add_box(scene, side > 0 ? "upper" : "lower", Vec3::Zero(), size * Vec3(0.3, 0.1, 0.3), 1);
  plate.mass.reset();
  plate.friction = press.friction;
  const bool moves = side > 0 || press.both_move;
  const double closed = press.least / 2;
  const auto at = [&](double gap) { return Vec3(0, side * size * (0.05 + gap), 0); };
  if (!moves) {
    plate.is_static = true;
    plate.placement.position = at(closed);
    return;
  }
  plate.is_kinematic = true;
  const std::pair<double, double> keys[] = {{0, open / 2}, {0.1, closed}, {0.2, closed}, {0.3, open / 2}};
  for (const auto& [time, gap] : keys) {
    scene::Keyframe& key = plate.motion.keyframes.emplace_back();
    key.time = time * pace(press);
    key.position = at(gap);
  }
}

// Returns the thin body between the plates.
scene::Scene scene_of(const Press& press) {
  scene::Scene scene = test::free_space();
  const double size = press.size, thickness = 0.005 * size;
  scene.fps = 24 / pace(press);
  scene.solver.max_time_step = 1 / scene.fps;
  for (const double side : {-1.0, 1.0}) add_plate(scene, press, side);
  scene::Material& material = test::add_material(scene, "thin");
  material.density = 300;
  material.youngs_modulus = press.youngs_modulus;
  material.damping = 0.01;
  // On a static lower plate the body lies from the start.
  const Vec3 middle(0, press.both_move ? 0 : size * (0.0025 - press.least / 2), 0);
  if (press.thin == Thin::cloth) {
    test::add_panel(scene, "thin", middle, size * Vec2(0.5, 0.5), 8, thickness);
  } else if (press.thin == Thin::rope) {
    test::add_rope(scene, "thin", {Vec3(-0.25 * size, 0, 0), Vec3(0.25 * size, 0, 0)}, 10, thickness)
        .placement.position = middle;
  } else {
    scene::DeformableBody& body = scene.deformable.emplace_back();
    body.name = "thin";
    body.material = "thin";
    body.shape.kind = scene::DeformableKind::particle;
    body.shape.radius = thickness / 2;
    body.placement.position = middle;
  }
  return scene;
}

// Checks that a pinched body stays in place, gains little energy, is reported with the right bodies,
// thickness, room and time, and takes at most three times the substeps of a scene with enough room.
void expect_stays(const Press& press) {
  SCOPED_TRACE(fmt::format("thin {}, size {}, gap {}, friction {}, {} Pa, both {}",
                           static_cast<int>(press.thin), press.size, press.least, press.friction,
                           press.youngs_modulus, press.both_move));
  Press open = press;
  open.least = 0.008;
  const scene::Scene scene = scene_of(press), open_scene = scene_of(open);
  Simulation simulation(scene, test::plan(scene)), wide(open_scene, test::plan(open_scene));
  const std::vector<Vec3> start = simulation.world().bodies.particles.x;
  double energy = 0, room = 1e9;
  bool is_said = false;
  for (int frame = 1; frame <= 8; ++frame) {
    simulation.advance_frame();
    wide.advance_frame();
    const FrameStats stats = simulation.stats();
    ASSERT_LE(stats.substeps, 3 * wide.stats().substeps + 3) << frame;
    EXPECT_TRUE(wide.stats().pinched.empty());
    energy = std::max(energy, stats.kinetic + stats.elastic);
    for (const PinchStats& pinch : stats.pinched) {
      is_said = true;
      room = std::min(room, pinch.room);
      EXPECT_EQ(pinch.body, "thin");
      EXPECT_EQ(pinch.first + pinch.second, "lowerupper");
      EXPECT_NEAR(pinch.thickness, 0.005 * press.size, 1e-12);
      EXPECT_GT(pinch.time, press.both_move ? 0.04 * pace(press) : -1);
      EXPECT_LT(pinch.time, 0.3 * pace(press));
    }
  }
  EXPECT_TRUE(is_said);
  EXPECT_NEAR(room / press.size, press.least, 1e-6);
  const double scale = press.size * press.size * press.size;
  test::expect_below(energy / scale, 1, "most energy over size^3, J/m^3");
  double off = 0;
  for (std::size_t p = 0; p < start.size(); ++p)
    off = std::max(off, (simulation.world().bodies.particles.x[p] - start[p]).norm());
  test::expect_below(off / press.size, press.both_move ? 0.001 : 0.003, "moved, sizes");
}

// The gap ranges from just below the thickness to plates that overlap. Contact that insists on the whole
// thickness from both plates cannot be satisfied, and throws the cloth.
TEST(EverydaySoftPinched, ClothStaysWhereItIs) {
  test::Cases cases(2);  // 3 of 5
  for (const double least : {0.0049, 0.004, 0.002, 0.0, -0.01})
    if (cases.takes()) expect_stays({.least = least});
}

// Displacement and energy are bounded relative to the size.
TEST(EverydaySoftPinched, OfAnySizeStiffnessAndFriction) {
  test::Cases cases(2);  // 3 of 6
  const auto look_at = [&](const Press& press) {
    if (cases.takes()) expect_stays(press);
  };
  for (const double size : {0.05, 20.0}) look_at({.size = size});
  for (const double youngs_modulus : {1e4, 1e8}) look_at({.least = 0.002, .youngs_modulus = youngs_modulus});
  for (const double friction : {0.0, 0.2}) look_at({.friction = friction});
}

// Contact with rods and particles has the same promise as contact with cloth.
TEST(EverydaySoftPinched, SoDoRopesAndParticles) {
  for (const Thin thin : {Thin::rope, Thin::particle})
    for (const double least : {0.004, 0.001}) expect_stays({.thin = thin, .least = least});
}

// A static lower plate on which the body lies makes the body pinched from the side of the moving plate alone.
TEST(EverydaySoftPinched, AndOnePlateMayBeStatic) {
  test::Cases cases(2);  // 1 of 2
  for (const double least : {0.0, 0.004})
    if (cases.takes()) expect_stays({.least = least, .both_move = false});
}

// Returns a cloth that falls along a static jaw, while another one of the given shape closes to half of the
// thickness, holds it, and opens again.
scene::Scene falling_cloth(const scene::Shape& jaw, double reach, double longest_step) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.fps = 24;
  scene.solver.max_time_step = longest_step;
  constexpr double thickness = 0.01;  // m
  scene::RigidBody& fixed = test::add_box(scene, "fixed", Vec3(-0.107, 0.25, 0), Vec3(0.2, 0.3, 0.8), 1);
  fixed.mass.reset();
  fixed.is_static = true;
  scene::RigidBody& moving = test::add_box(scene, "moving", Vec3::Zero(), Vec3::Ones(), 1);
  moving.shape = jaw;
  moving.mass.reset();
  moving.is_kinematic = true;
  const std::pair<double, double> keys[] = {
      {0, 0.02}, {0.15, -0.007 + thickness / 2}, {0.5, -0.007 + thickness / 2}, {0.6, 0.1}};
  for (const auto& [time, surface] : keys) {
    scene::Keyframe& key = moving.motion.keyframes.emplace_back();
    key.time = time;
    key.position = Vec3(surface + reach, 0.25, 0);
  }
  scene::Material& material = test::add_material(scene, "cloth");
  material.density = 300;
  material.youngs_modulus = 1e5;
  scene::DeformableBody& cloth = test::add_panel(scene, "cloth", Vec3::Zero(), Vec2(0.6, 0.6), 8, thickness);
  cloth.placement.orientation = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  return scene;
}

// Between jaws of other shapes than plates some of a face's corners touch one jaw alone. When these kept the
// whole distance from it, the face turned about them, and the cloth stored 8e4 J.
TEST(EverydaySoftPinched, JawsOfAnyShapeHoldFallingCloth) {
  using scene::ShapeKind;
  const scene::Shape cylinder{.kind = ShapeKind::cylinder, .radius = 0.1, .length = 0.8},
      ball{.kind = ShapeKind::sphere, .radius = 0.15},
      ring{.kind = ShapeKind::torus, .radius = 0.12, .tube = 0.04};
  test::Cases cases(2);  // 3 of 6
  for (const double longest_step : {1.0 / 24, 1e-3})
    for (const auto& [shape, reach] :
         {std::pair(cylinder, 0.1), std::pair(ball, 0.15), std::pair(ring, 0.16)}) {
      if (!cases.takes()) continue;
      const scene::Scene scene = falling_cloth(shape, reach, longest_step);
      Simulation simulation(scene, test::plan(scene));
      double gain = 0,
             start = simulation.stats().kinetic + simulation.stats().elastic + simulation.stats().potential;
      int substeps = 0;
      for (int frame = 1; frame <= 15; ++frame) {
        simulation.advance_frame();
        const FrameStats stats = simulation.stats();
        gain = std::max(gain, stats.kinetic + stats.elastic + stats.potential - start);
        substeps = std::max(substeps, stats.substeps);
      }
      const std::string name = fmt::format("{}_steps_{:.2g}", static_cast<int>(shape.kind), longest_step);
      test::expect_below(gain, 1e-3, "gain_J_" + name);
      test::expect_below(substeps, 60, "substeps_" + name);
    }
}

}  // namespace
}  // namespace duet::everyday_soft_pinched_test
