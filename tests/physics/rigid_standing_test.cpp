// Structures that are built to stand do so: ten seconds of the scenes of scenes/hard (outside of long tests
// three), compared with their start.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::rigid_standing_test {
namespace {

// The largest errors at the ends of frames.
struct Drift {
  double moved = 0;        // m, displacement of a body's center from the start
  double turned = 0;       // rad
  double penetration = 0;  // m
};

// Simulates a scene of scenes/hard for the given time.
Drift drift_of(const char* file, double seconds) {
  const scene::Scene scene = scene::read(test::source_folder() + "/scenes/hard/" + file).scene;
  Simulation simulation(scene, test::plan(scene));
  const std::vector<RigidState> start = simulation.world().bodies.rigid.state;
  Drift drift;
  while (simulation.stats().time < seconds) {
    simulation.advance_frame();
    const std::vector<RigidState>& now = simulation.world().bodies.rigid.state;
    for (std::size_t i = 0; i < now.size(); ++i) {
      drift.moved = std::max(drift.moved, (now[i].pose.position - start[i].pose.position).norm());
      drift.turned =
          std::max(drift.turned, now[i].pose.orientation.angularDistance(start[i].pose.orientation));
    }
    drift.penetration = std::max(drift.penetration, simulation.stats().max_penetration);
  }
  return drift;
}

// A scene of scenes/hard.
struct Structure {
  const char* file;
  double size;       // m, of one of its bodies
  double thickness;  // m, smallest thickness of its bodies
};

// The scenes, with the sizes that errors are relative to.
const Structure structures[] = {
    {"tower", 1, 1}, {"pyramid", 1, 1}, {"card_house", 1, 0.03}, {"arch", 0.7, 0.57}};

class Standing : public testing::TestWithParam<Structure> {};

// Drift and rotation stay below 0.1 % of the bodies' size a second, and penetration below 1 % of their
// thickness. A solver that leaves a residual in every step lets structures creep and fall within seconds.
TEST_P(Standing, TenSecondsWithoutDrift) {
  const Structure& structure = GetParam();
  const double seconds = test::runs_in_full() ? 10 : 3, bound = 1e-3 * seconds;
  const Drift drift = drift_of((std::string(structure.file) + ".toml").c_str(), seconds);
  test::expect_below(drift.moved / structure.size, bound, "drift_over_size");
  test::expect_below(drift.turned, bound, "turned_rad");
  test::expect_below(drift.penetration / structure.thickness, 0.01, "penetration_over_thickness");
}

INSTANTIATE_TEST_SUITE_P(Hard, Standing, testing::ValuesIn(structures),
                         [](const auto& structure) { return structure.param.file; });

// Every heavy box falls by 25 cm on a light one, with a mass ratio of 10 to 1000, and rests on it. Bounds are
// 1 % of the size.
TEST(HeavyOnLight, SettlesWithoutSinkingIn) {
  const scene::Scene scene = scene::read(test::source_folder() + "/scenes/hard/heavy_on_light.toml").scene;
  Simulation simulation(scene, test::plan(scene));
  const std::vector<RigidState>& state = simulation.world().bodies.rigid.state;
  double penetration = 0;
  while (simulation.stats().frame < scene.frames) {
    simulation.advance_frame();
    penetration = std::max(penetration, simulation.stats().max_penetration);
  }
  test::expect_below(penetration, 0.01, "penetration_over_size");
  for (std::size_t i = 0; i < scene.rigid.size(); ++i) {
    const std::string& name = scene.rigid[i].name;
    const Vec3 rest(scene.rigid[i].placement.position.x(), i % 2 == 0 ? 0.5 : 1.5, 0);
    test::expect_below((state[i].pose.position - rest).norm(), 0.01, name + "_off_its_place_m");
    test::expect_below(state[i].velocity.norm(), 1e-3, name + "_speed_m_s");
  }
}

// Returns a stack of light and heavy boxes in turn, with densities of up to 300 to 1.
scene::Scene heavy_on_light(double friction, const Vec3& velocity) {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8, 0);
  double top = 0;
  for (const auto& [height, density] :
       {std::pair(0.3, 100.0), {0.4, 20000.0}, {0.3, 100.0}, {0.4, 30000.0}}) {
    scene::RigidBody& box = test::add_box(scene, fmt::format("box at {}", top), Vec3(0, top + height / 2, 0),
                                          Vec3(0.5, height, 0.5), density * 0.25 * height);
    box.friction = friction;
    box.placement.velocity = velocity;
    top += height;
  }
  return scene;
}

// Returns the largest displacement (m) of a box relative to the lowest one.
double max_apart(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  const RigidBodies& rigid = simulation.world().bodies.rigid;
  const auto at = [&](std::size_t i) { return rigid.state[i].pose.position; };
  std::vector<std::size_t> boxes;
  for (std::size_t i = 0; i < rigid.size(); ++i)
    if (rigid.properties[i].is_dynamic()) boxes.push_back(i);
  std::vector<Vec3> place;
  for (const std::size_t i : boxes) place.push_back(at(i) - at(boxes[0]));
  double most = 0;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    for (std::size_t k = 0; k < boxes.size(); ++k)
      most = std::max(most, (at(boxes[k]) - at(boxes[0]) - place[k]).norm());
  }
  return most;
}

// A stack on a lift stands as on the ground. When shock propagation did not pass through light boxes that
// move, the stack fell apart.
TEST(HeavyOnLight, RidesALift) {
  scene::Scene scene = heavy_on_light(0.5, Vec3::Zero());
  scene::RigidBody& lift = test::add_box(scene, "lift", Vec3(0, -0.1, 0), Vec3(3, 0.2, 3), 1);
  lift.mass.reset();
  lift.is_kinematic = true;
  for (const auto& [time, place] : {std::pair(0.0, Vec3(0, -0.1, 0)), {3.0, Vec3(0, 5.9, 1.5)}}) {
    scene::Keyframe& key = lift.motion.keyframes.emplace_back();
    key.time = time;
    key.position = place;
  }
  test::expect_below(max_apart(scene, 50), 1e-5, "most_apart_m");
}

// All boxes slide with the same friction at all of their faces, so that they are braked alike and stay
// together.
TEST(HeavyOnLight, SlidesAsOne) {
  scene::Scene scene = heavy_on_light(0.1, Vec3(1, 0, 0));
  scene.ground = scene::Ground{.friction = 0.1, .restitution = 0, .look = {}};
  test::expect_below(max_apart(scene, 16), 0.05, "most_apart_m");
}

}  // namespace
}  // namespace duet::rigid_standing_test
