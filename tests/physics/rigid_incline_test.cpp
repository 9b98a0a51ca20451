// A box on an incline sticks or slides as Coulomb's law says, at every size, and does not tumble.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::rigid_incline_test {
namespace {

constexpr double gravity = 9.8;  // m/s^2
constexpr double degree = std::numbers::pi / 180;

const Vec3 cube(1, 1, 1);
// Bound (m) for what must not move: ten times what the contact solver's tolerance of 1e-6 m/s adds up to in a
// second.
constexpr double rest_tolerance = 1e-5;
constexpr double turn_tolerance = 1e-4;  // rad; the smallest cube, 0.1 m, tilted by that height

enum class Incline { tilted_gravity, tilted_box };

// Displacement of a block after a second.
struct Slide {
  double distance = 0;  // m, down the slope
  double aside = 0;     // m, across the slope
  double off = 0;       // m, away from or into the slope
  double turned = 0;    // rad
};

// Returns where a block of the given size (m; y is normal to the slope) is one second after it was released
// on the slope of the given angle (rad).
Slide slide(double friction, double angle, const Vec3& size, Incline incline = Incline::tilted_gravity) {
  scene::Scene scene;
  const Quat tilt =
      incline == Incline::tilted_box ? Quat(Eigen::AngleAxisd(-angle, Vec3::UnitZ())) : Quat::Identity();
  if (incline == Incline::tilted_box) {
    auto& slope = test::add_box(scene, "slope", tilt * Vec3(5, -1, 0), Vec3(20, 2, 8), 1);
    slope.is_static = true;
    slope.mass.reset();
    slope.friction = friction;
    slope.placement.orientation = tilt;
  } else {
    scene.ground = scene::Ground{.height = 0, .friction = friction, .restitution = 0, .look = {}};
    scene.gravity = gravity * Vec3(std::sin(angle), -std::cos(angle), 0);
  }
  auto& box = test::add_box(scene, "box", tilt * Vec3(0, size.y() / 2, 0), size, 1);
  box.placement.orientation = tilt;
  box.friction = friction;
  scene.fps = 1;
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  const Pose& pose = simulation.world().bodies.rigid.state[incline == Incline::tilted_box ? 1 : 0].pose;
  const Vec3 moved = tilt.conjugate() * pose.position - Vec3(0, size.y() / 2, 0);
  return {moved.x(), std::abs(moved.z()), std::abs(moved.y()), pose.orientation.angularDistance(tilt)};
}

// Returns g (sin a - mu cos a) t^2 / 2 (m) after t = 1 s, or 0 where the block sticks.
double theory(double friction, double angle) {
  return 0.5 * gravity * std::max(0.0, std::sin(angle) - friction * std::cos(angle));
}

class InclineTest : public testing::TestWithParam<double> {};

// Distances are within 0.5 % of theory, and blocks that stick do not creep. Friction below its cone, or above
// it, shows at one of the angles.
TEST_P(InclineTest, SlidesOrSticksAtEveryAngle) {
  const double size = GetParam();
  double error = 0, crept = 0, off = 0, aside = 0, turned = 0;
  for (const double friction : {0.0, 0.1, 0.3, 0.5, 0.8})
    for (int angle = 5; angle <= 40; angle += 5) {
      const double expected = theory(friction, angle * degree);
      const Slide found = slide(friction, angle * degree, Vec3::Constant(size));
      if (expected > 0)
        error = std::max(error, std::abs(found.distance / expected - 1));
      else
        crept = std::max(crept, std::abs(found.distance));
      off = std::max(off, found.off);
      aside = std::max(aside, found.aside);
      turned = std::max(turned, found.turned);
      if (expected > 0 && std::abs(found.distance / expected - 1) > 0.005)
        ADD_FAILURE() << "friction " << friction << ", " << angle << " degrees: slid " << found.distance
                      << " m, theory " << expected << " m";
    }
  test::expect_below(error, 0.005, "distance_error");
  test::expect_below(crept, rest_tolerance, "creep_where_it_sticks_m");
  test::expect_below(aside, rest_tolerance, "aside_m");
  test::expect_below(off, rest_tolerance, "height_error_m");
  test::expect_below(turned, turn_tolerance, "turned_rad");
}

INSTANTIATE_TEST_SUITE_P(Sizes, InclineTest, testing::Values(0.1, 1, 10),
                         [](const auto& size) { return fmt::format("cube_of_{:.0f}_cm", 100 * size.param); });

// A block sticks for mu > tan(angle) and slides for mu < tan(angle), to 0.01.
TEST(InclineThreshold, LiesAtTheTangentOfTheAngle) {
  for (const double angle : {5.0, 20.0, 40.0}) {
    const double threshold = std::tan(angle * degree);
    const Slide sticks = slide(threshold + 0.01, angle * degree, cube),
                slides = slide(threshold - 0.01, angle * degree, cube);
    const double expected = theory(threshold - 0.01, angle * degree);  // 4 to 5 cm
    test::expect_below(std::abs(sticks.distance), rest_tolerance,
                       fmt::format("creep_at_{}_degrees_m", angle));
    test::expect_below(std::abs(slides.distance / expected - 1), 0.005,
                       fmt::format("slide_error_at_{}_degrees", angle));
  }
}

// The incline is a static box, so that samples of either box meet the level set of the other. The result must
// be that of a level ground under tilted gravity.
TEST(InclineBox, IsTheSameAsTiltedGravity) {
  for (const double friction : {0.1, 0.8}) {
    const double angle = 30 * degree;
    const Slide tilted_box = slide(friction, angle, cube, Incline::tilted_box),
                tilted_gravity = slide(friction, angle, cube);
    test::expect_below(std::abs(tilted_box.distance - tilted_gravity.distance), 1e-3,
                       fmt::format("difference_at_friction_{}_m", friction));
    test::expect_below(tilted_box.turned, turn_tolerance, "turned_rad");
  }
}

// Without friction no force acts along a level slab. The slab's own samples pass below the edges of the box
// on its way, where the level set of the box has the normals of two faces; a tilted normal would brake the
// box.
TEST(InclineBox, KeepsItsSpeedOnALevelSlab) {
  constexpr double speed = 2;
  scene::Scene scene;
  auto& slab = test::add_box(scene, "slab", Vec3(5, -1, 0), Vec3(20, 2, 8), 1);
  slab.is_static = true;
  slab.mass.reset();
  auto& box = test::add_box(scene, "box", Vec3(0, 0.5, 0), cube, 1);
  box.friction = 0;
  box.placement.velocity = Vec3(speed, 0, 0);
  Simulation simulation(scene, test::plan(scene));
  while (simulation.frame() < 2 * scene.fps) simulation.advance_frame();
  const RigidState& end = simulation.world().bodies.rigid.state[1];
  test::expect_below((end.velocity - Vec3(speed, 0, 0)).norm(), rest_tolerance, "speed_error_m_s");
  test::expect_below((end.pose.position - Vec3(2 * speed, 0.5, 0)).norm(), rest_tolerance, "place_error_m");
}

// A block that sticks stands while its weight acts inside its base, tan(angle) < width / height. A block that
// slides stands while the moment of friction is less than what its base can bear, mu < width / height. Both
// cases are tested on either side of the limit, 0.5.
TEST(InclineToppling, BlockStandsWhereTheoryLetsIt) {
  const Vec3 block(1, 2, 1);
  const struct {
    const char* name;
    double friction, degrees;
    bool stands;
  } cases[] = {{"sticks_at_25_degrees", 1, 25, true},
               {"sticks_at_28_degrees", 1, 28, false},
               {"slides_with_friction_0.45", 0.45, 35, true},
               {"slides_with_friction_0.55", 0.55, 35, false}};
  for (const auto& c : cases) {
    const Slide found = slide(c.friction, c.degrees * degree, block);
    if (c.stands)
      test::expect_below(found.turned, turn_tolerance, fmt::format("turned_rad_{}", c.name));
    else
      test::expect_above(found.turned, 0.02, fmt::format("turned_rad_{}", c.name));
  }
}

}  // namespace
}  // namespace duet::rigid_incline_test
