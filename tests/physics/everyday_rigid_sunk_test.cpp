// Static round bodies that are sunk in the ground or in a static box, as speed bumps, half logs and hills
// are: what lands on them moves as if there were only the round body, as long as it stays above the ground.
#include <algorithm>

#include "tests/support/everyday.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_sunk_test {
namespace {

using scene::ShapeKind;

constexpr double radius = 0.5;  // m, of the sunk body

// A shape and the way it stands.
struct Posed {
  std::string name;
  scene::Shape shape;
  Quat orientation = Quat::Identity();
};

const Quat lying(Eigen::AngleAxisd(double{EIGEN_PI} / 2, Vec3::UnitX()));

// Returns shapes that reach 0.5 m above their center.
std::vector<Posed> sunk_shapes() {
  return {{"lying cylinder", {.kind = ShapeKind::cylinder, .radius = radius, .length = 1}, lying},
          {"lying capsule", {.kind = ShapeKind::capsule, .radius = radius, .length = 1}, lying},
          {"upright torus", {.kind = ShapeKind::torus, .radius = 0.4, .tube = 0.1}, lying},
          {"ball", {.kind = ShapeKind::sphere, .radius = radius}},
          {"upright cylinder", {.kind = ShapeKind::cylinder, .radius = 0.2, .length = 2 * radius}}};
}

// Returns shapes that reach 0.1 m below their center.
std::vector<Posed> landing_shapes() {
  return {{"plate", {.kind = ShapeKind::box, .size = Vec3(0.9, 0.2, 0.3)}},
          {"ball", {.kind = ShapeKind::sphere, .radius = 0.1}},
          {"upright cylinder", {.kind = ShapeKind::cylinder, .radius = 0.3, .length = 0.2}},
          {"lying capsule", {.kind = ShapeKind::capsule, .radius = 0.1, .length = 0.5}, lying},
          {"lying cylinder", {.kind = ShapeKind::cylinder, .radius = 0.1, .length = 0.5}, lying}};
}

enum class Floor { none, ground, box };

// Returns the places (m) of a body that falls by 0.1 m onto the sunk one, whose center is at y = 0, for half
// a second.
std::vector<Vec3> places(const Posed& sunk, const Posed& landing, Floor floor, double height) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  scene::RigidBody body;
  body.name = "sunk";
  body.shape = sunk.shape;
  body.placement.orientation = sunk.orientation;
  body.is_static = true;
  scene.rigid.push_back(body);
  if (floor == Floor::ground)
    scene.ground = scene::Ground{.height = height, .friction = 0.5, .restitution = 0, .look = {}};
  if (floor == Floor::box) {
    scene::RigidBody& box = test::add_box(scene, "floor", Vec3(0, height - 1, 0), Vec3(4, 2, 4), 1);
    box.mass.reset();
    box.is_static = true;
  }
  body.name = "landing";
  body.shape = landing.shape;
  body.placement.orientation = landing.orientation;
  body.placement.position = Vec3(0.01, radius + 0.2, 0);
  body.is_static = false;
  body.density = 1000;
  scene.rigid.push_back(body);
  Simulation simulation(scene, test::plan(scene));
  std::vector<Vec3> result;
  for (int frame = 0; frame < 12; ++frame) {
    simulation.advance_frame();
    const RigidBodies& rigid = simulation.world().bodies.rigid;
    const auto found = std::find(rigid.name.begin(), rigid.name.end(), "landing");
    result.push_back(rigid.state[static_cast<std::size_t>(found - rigid.name.begin())].pose.position);
  }
  return result;
}

// Bodies fell into lying cylinders and capsules whose axis was below the ground, by up to 0.3 m. The bound is
// a thousandth of a millimeter, for steps that end at other times if there is ground within reach.
TEST(EverydayRigidSunk, BodiesLandOnThemAsWithoutTheGround) {
  double farthest = 0;
  for (const Posed& sunk : sunk_shapes())
    for (const Posed& landing : landing_shapes()) {
      const std::vector<Vec3> alone = places(sunk, landing, Floor::none, 0);
      for (const Floor floor : {Floor::ground, Floor::box})
        for (const double height : {-0.2, 0.0, 0.2}) {  // m, of the floor, above the axis
          SCOPED_TRACE(fmt::format("{} on a {} with the {} at {} m", landing.name, sunk.name,
                                   floor == Floor::box ? "box" : "ground", height));
          const std::vector<Vec3> found = places(sunk, landing, floor, height);
          double off = 0;
          for (std::size_t i = 0; i < alone.size(); ++i)
            if (alone[i].y() > height + 0.35) off = std::max(off, (found[i] - alone[i]).norm());
          EXPECT_LT(off, 1e-6);
          farthest = std::max(farthest, off);
        }
    }
  test::expect_below(farthest, 1e-6, "distance, m, of the paths with and without ground");
}

}  // namespace
}  // namespace duet::everyday_rigid_sunk_test
