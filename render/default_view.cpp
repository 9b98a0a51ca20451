#include "render/default_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>

namespace duet::render {
namespace {

// Height of the picture over the diameter of the ball around the moving bodies. A larger one shows them
// smaller.
constexpr double margin = 1.3;
constexpr double longest_way = 2;  // s, for which the picture has room if bodies keep their first velocities
constexpr double irradiance = 2;   // of the lamp on a facing surface in the center of the ball
constexpr double lamp_distance = 8;  // in radii of the ball; far, so that all bodies are lit alike
constexpr double lamp_radius = 0.8;  // in radii of the ball

// Unit directions from the center of the ball. A scene is seen from +z with +y up.
const Vec3 to_camera = Vec3(0.45, 0.35, 1).normalized();
const Vec3 to_lamp = Vec3(-0.6, 1, 0.7).normalized();

// The ball around the moving bodies and their paths.
struct Ball {
  Vec3 center = Vec3::Zero();  // m
  double radius = 0;           // m
};

// Returns the velocity at frame 0 (m/s) of the body at place `i` of the manifest, which lists rigid bodies
// first, then deformable ones.
Vec3 start_velocity(const scene::Scene& scene, std::size_t i) {
  const std::size_t rigid = scene.rigid.size();
  if (i < rigid) return scene.rigid[i].placement.velocity;
  return i - rigid < scene.deformable.size() ? scene.deformable[i - rigid].placement.velocity : Vec3::Zero();
}

// Returns the ball that the picture shall show. Empty if no body of the manifest has a box of finite size.
std::optional<Ball> around_what_moves(const scene::Scene& scene, const io::Manifest& manifest) {
  Eigen::AlignedBox3d moving, all;
  const double seconds = std::min(scene.frames / scene.fps, longest_way);
  for (std::size_t i = 0; i < manifest.bodies.size(); ++i) {
    const io::ManifestBody& body = manifest.bodies[i];
    if (!body.box) continue;
    all.extend(*body.box);
    if (body.kind == "static") continue;
    moving.extend(*body.box);
    moving.extend(body.box->translated(seconds * start_velocity(scene, i)));
  }
  Eigen::AlignedBox3d box = moving.isEmpty() ? all : moving;
  if (box.isEmpty()) return std::nullopt;
  if (scene.ground && scene.ground->height < box.min().y()) {
    Vec3 below = box.center();
    below.y() = scene.ground->height;
    box.extend(below);
  }
  const Ball ball{box.center(), box.diagonal().norm() / 2};
  if (!(ball.radius > 0) || !std::isfinite(ball.radius)) return std::nullopt;
  return ball;
}

// Moves the camera back until the ball, enlarged by `margin`, fits into its vertical field of view.
void place_camera(const Ball& ball, scene::Camera& camera) {
  const double half = camera.vertical_fov / 2 * std::numbers::pi / 180;
  camera.target = ball.center;
  camera.position = ball.center + margin * ball.radius / std::sin(half) * to_camera;
}

scene::Light lamp(const Ball& ball) {
  scene::Light light;
  const double distance = lamp_distance * ball.radius;
  light.position = ball.center + distance * to_lamp;
  light.target = ball.center;
  light.radius = lamp_radius * ball.radius;
  light.power = irradiance * 4 * std::numbers::pi * distance * distance;
  return light;
}

}  // namespace

scene::Scene with_default_view(scene::Scene scene, const io::Manifest& manifest) {
  const bool needs_lamp = scene.lights.empty() && !scene.has_sky;
  if (scene.has_camera && !needs_lamp) return scene;
  const std::optional<Ball> ball = around_what_moves(scene, manifest);
  if (!ball) return scene;
  if (!scene.has_camera) place_camera(*ball, scene.camera);
  if (needs_lamp) scene.lights.push_back(lamp(*ball));
  return scene;
}

}  // namespace duet::render
