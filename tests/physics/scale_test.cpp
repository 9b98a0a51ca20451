// Scenes of any size move alike. All lengths are multiplied by s and all times by sqrt(s), so that gravity
// stays, and Young's moduli by s, so that densities stay.
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::scale_test {
namespace {

constexpr double fps = 24;
constexpr int frames = 12;

void fall(scene::Scene& scene) {
  scene::RigidBody& box = test::add_box(scene, "box", Vec3(0, 0.5, 0), Vec3(0.4, 0.2, 0.3), 24);
  box.placement.orientation = Quat(0.9, 0.3, 0.1, 0.2).normalized();
  box.placement.velocity = Vec3(1, 0, 0.5);
}

void roll(scene::Scene& scene) {
  scene::RigidBody& ball = test::add_ball(scene, "ball", Vec3(0, 0.2, 0), 0.2, 30);
  ball.placement.velocity = Vec3(1, 0, 0);
  ball.placement.angular_velocity = Vec3(0, 1, -2);
  ball.rolling_friction = 5e-3;
  ball.spinning_friction = 5e-3;
}

void stack(scene::Scene& scene) {
  for (int i = 0; i < 3; ++i)
    test::add_box(scene, "box " + std::to_string(i), Vec3(0.03 * i, 0.1 + 0.21 * i, 0), Vec3(0.3, 0.2, 0.25),
                  15);
}

void press(scene::Scene& scene) {
  test::add_soft_box(scene, "soft", Vec3(0, 0.2, 0), Vec3(0.4, 0.4, 0.4), 3, 1e5);
  test::add_box(scene, "box", Vec3(0.05, 0.52, 0), Vec3(0.3, 0.2, 0.3), 10);
}

void drape(scene::Scene& scene) {
  test::add_ball(scene, "ball", Vec3(0.02, 0.2, 0.01), 0.2, 30).is_static = true;
  scene.rigid.back().mass.reset();
  test::add_material(scene, "cotton");
  test::add_panel(scene, "cloth", Vec3(0, 0.42, 0), Vec2(0.5, 0.5), 8, 2e-3);
}

void swing(scene::Scene& scene) {
  scene.ground.reset();
  test::add_chain(scene, 4, scene::JointType::point, true);
}

// A scene of size 1, and what it shows.
struct Kind {
  std::string name;
  std::function<void(scene::Scene&)> build;
  double bound;  // greatest difference of positions, m, and of orientations
};

// Multiplies all lengths of the scene by s, and times, stiffness and masses as said above.
void scale(scene::Scene& scene, double s) {
  const double time = std::sqrt(s);
  scene.fps = fps / time;
  scene.solver.max_time_step *= time;
  scene.solver.cg_tolerance *= time;
  const auto place = [&](scene::Placement& placement) {
    placement.position *= s;
    placement.velocity *= time;
    placement.angular_velocity /= time;
  };
  for (scene::RigidBody& body : scene.rigid) {
    place(body.placement);
    body.shape.size *= s;
    body.shape.radius *= s;
    body.rolling_friction *= s;
    body.spinning_friction *= s;
    if (body.mass) *body.mass *= s * s * s;
    if (body.sample_spacing) *body.sample_spacing *= s;
  }
  for (scene::DeformableBody& body : scene.deformable) {
    place(body.placement);
    body.shape.size *= s;
    body.shape.panel_size *= s;
    if (body.thickness) *body.thickness *= s;
  }
  for (scene::Material& material : scene.materials) {
    material.youngs_modulus *= s;
    material.damping *= time;
    material.mass_damping /= time;
  }
  for (scene::Joint& joint : scene.joints)
    if (joint.world.position) *joint.world.position *= s;
}

// Returns the positions of all bodies and particles after each of `frames`, over the scale.
std::vector<Vec3> motion(const Kind& kind, double s) {
  scene::Scene scene = test::on_ground(0.4, 0.2);
  kind.build(scene);
  scale(scene, s);
  Simulation simulation(scene, test::plan(scene));
  std::vector<Vec3> result;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    const Bodies& bodies = simulation.world().bodies;
    for (const RigidState& state : bodies.rigid.state) {
      result.push_back(state.pose.position / s);
      result.push_back(state.pose.orientation.vec());
    }
    for (const Vec3& x : bodies.particles.x) result.push_back(x / s);
  }
  return result;
}

// The bounds are tolerances of the solvers: relative to the bodies they are the same below a size of 5 cm
// (ContactPoint::precision) and finer above it. Bodies that roll or swing differ by rounding. The box falls
// on a corner and rocks down in ten impacts, and the folds of the cloth move: both amplify differences by a
// factor of a thousand within the half second.
TEST(Scale, ScenesOfAnySizeMoveAlike) {
  const std::vector<Kind> kinds{{"falling box", fall, 2e-5},      {"rolling ball", roll, 1e-12},
                                {"stack", stack, 1e-4},           {"rigid on soft", press, 1e-4},
                                {"cloth on a ball", drape, 1e-2}, {"chain", swing, 1e-9}};
  for (const Kind& kind : kinds) {
    const std::vector<Vec3> as_is = motion(kind, 1);
    for (const double s : {1e-3, 1e3}) {
      const std::vector<Vec3> scaled = motion(kind, s);
      ASSERT_EQ(scaled.size(), as_is.size());
      double worst = 0;
      for (std::size_t i = 0; i < as_is.size(); ++i) worst = std::max(worst, (scaled[i] - as_is[i]).norm());
      test::expect_below(worst, kind.bound, kind.name + (s < 1 ? " small" : " large"));
    }
  }
}

}  // namespace
}  // namespace duet::scale_test
