// Figure 8 of Shinar et al. 2008: a rigid box, a deformable one and a single particle slide down a slope as
// Coulomb's law says, x = v t + (g sin A - mu g cos A) t^2 / 2.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::friction_test {
namespace {

constexpr double gravity = 9.8, friction = 0.2;

// Distances (m) down the slope of the ball that is prescribed by the exact solution, the rigid box, the soft
// box and the particle.
struct Travel {
  double exact = 0, box = 0, soft = 0, particle = 0;
};

// A scene in motion that measures distances from its start.
class Slide {
 public:
  explicit Slide(const scene::Scene& scene) : simulation_(scene, test::plan(scene)), start_(places()) {}
  // Advances and returns the distances along `downhill`, the unit vector down the slope.
  Travel after(int frames, const Vec3& downhill) {
    for (int i = 0; i < frames; ++i) simulation_.advance_frame();
    const std::array<Vec3, 4> now = places();
    const auto along = [&](std::size_t i) { return (now[i] - start_[i]).dot(downhill); };
    return {along(0), along(1), along(2), along(3)};
  }

 private:
  std::array<Vec3, 4> places() const {
    const Bodies& bodies = simulation_.world().bodies;
    return {bodies.rigid.state[1].pose.position, bodies.rigid.state[2].pose.position,
            test::center_of(bodies, 0), test::center_of(bodies, 1)};
  }
  mutable Simulation simulation_;
  std::array<Vec3, 4> start_;
};

// Returns the unit vector down a slope of the given angle.
Vec3 downhill(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return Vec3(-std::cos(a), -std::sin(a), 0);
}

// Returns the distance (m) after `t` (s) from the speed `v` (m/s) on. It ends where friction has stopped the
// body.
double theory(double degrees, double v, double t) {
  const double a = degrees * std::numbers::pi / 180;
  const double acceleration = gravity * (std::sin(a) - friction * std::cos(a));
  if (acceleration < 0) t = std::min(t, -v / acceleration);
  return v * t + acceleration * t * t / 2;
}

// Checks |measured - expected| / scale < bound.
void expect_near(double measured, double expected, double scale, double bound, const std::string& what) {
  test::expect_below(std::abs(measured - expected) / scale, bound, what);
}

// Returns a scene of the folder scenes/. Outside of long tests the soft box has 2 x 2 x 2 cells instead of
// 4 x 4 x 4, for which Coulomb's law is the same.
scene::Scene figure(const std::string& name) {
  scene::Scene scene = scene::read(test::source_folder() + "/scenes/" + name + ".toml").scene;
  if (!test::runs_in_full()) scene.deformable[0].shape.cells = Vec3i(2, 2, 2);
  return scene;
}

// Returns the scene with all lengths of bodies times `factor`. The stiffness of the material grows with them,
// so that the weight compresses it as much, and steps grow with the size as far as they may.
scene::Scene resized(scene::Scene scene, double factor) {
  const Vec3 origin = Vec3::Zero();
  scene.rigid[0].shape.size *= factor;
  scene.rigid[2].shape.size *= factor;
  scene.deformable[0].shape.size *= factor;
  scene.deformable[1].shape.radius *= factor;
  for (scene::Keyframe& keyframe : scene.rigid[1].motion.keyframes) *keyframe.position += 2 * Vec3::UnitY();
  for (scene::RigidBody& body : scene.rigid)
    body.placement.position = origin + factor * (body.placement.position - origin);
  for (scene::DeformableBody& body : scene.deformable)
    body.placement.position = origin + factor * (body.placement.position - origin);
  scene.materials[0].youngs_modulus *= factor;
  return scene;
}

// One second of the figure at its step. The soft box starts without its weight on the ground and shakes at
// first. The half centimeter per second that it gains then is 0.1 % of the distance after 4 s, which the
// bound is relative to.
TEST(Friction, BodiesSlideAsCoulombSays) {
  Slide slide(figure("friction"));
  const Travel travel = slide.after(24, downhill(20));
  const double expected = theory(20, 0, 1);
  expect_near(travel.exact, expected, expected, 1e-7, "drawn solution");
  expect_near(travel.box, expected, expected, 1e-6, "rigid box");
  expect_near(travel.particle, expected, expected, 1e-8, "particle");
  expect_near(travel.soft, expected, theory(20, 0, 4), 0.001, "deformable box, over the way of 4 s");
}

// The law has no length scale: bodies a tenth and ten times as large slide alike. Absolute tolerances of
// speed or length in contact would show here.
TEST(Friction, SizeDoesNotMatter) {
  for (const double factor : {0.1, 10.0}) {
    Slide slide(resized(figure("friction"), factor));
    const int frames = (factor < 1 ? 3 : 12) * (test::runs_in_full() ? 2 : 1);
    const Travel travel = slide.after(frames, downhill(20));
    const double t = frames / 24.0, expected = theory(20, 0, t);
    const std::string size = "size x" + std::to_string(factor) + ", ";
    expect_near(travel.box, expected, expected, 1e-5, size + "rigid box");
    expect_near(travel.particle, expected, expected, 1e-8, size + "particle");
    expect_near(travel.soft, expected, theory(20, 0, 4), 0.002, size + "deformable box, over the way of 4 s");
  }
}

// At 10 degrees friction exceeds gravity: from 1 m/s all bodies stop after 4.38 s and 2.19 m.
TEST(Friction, SlowsBodiesDownAsCoulombSays) {
  Slide slide(figure("study/friction_stop"));
  const Travel travel = slide.after(24, downhill(10));
  const double expected = theory(10, 1, 1);
  expect_near(travel.exact, expected, expected, 1e-7, "drawn solution");
  expect_near(travel.box, expected, expected, 1e-5, "rigid box");
  expect_near(travel.particle, expected, expected, 1e-8, "particle");
  expect_near(travel.soft, expected, theory(10, 1, 4), 0.005, "deformable box, over the way of 4 s");
}

}  // namespace
}  // namespace duet::friction_test
