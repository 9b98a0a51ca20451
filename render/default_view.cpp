#include "render/default_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace duet::render {
namespace {

// Size of the picture over that of the box around the moving bodies. A larger one shows them smaller.
constexpr double margin = 1.25;
constexpr double longest_way = 2;  // s, for which the picture has room if bodies keep their first velocities
constexpr double irradiance = 2;   // of the lamp on a facing surface in the center of the box
constexpr double lamp_distance = 8;  // in radii of the box; far, so that all bodies are lit alike
constexpr double lamp_radius = 0.8;  // in radii of the box

// Unit directions from the center of the box. A scene is seen from +z with +y up.
const Vec3 to_camera = Vec3(0.45, 0.35, 1).normalized();
const Vec3 to_lamp = Vec3(-0.6, 1, 0.7).normalized();

// Returns the velocity at frame 0 (m/s) of the body at place `i` of the manifest, which lists rigid bodies
// first, then deformable ones.
Vec3 start_velocity(const scene::Scene& scene, std::size_t i) {
  const std::size_t rigid = scene.rigid.size();
  if (i < rigid) return scene.rigid[i].placement.velocity;
  return i - rigid < scene.deformable.size() ? scene.deformable[i - rigid].placement.velocity : Vec3::Zero();
}

// Returns the displacements (m) from frame 0 that keyframes, the first of which is at frame 0, and sinusoidal
// motion give a kinematic body.
std::vector<Vec3> prescribed_ways(const scene::RigidBody& body) {
  std::vector<Vec3> ways;
  std::optional<Vec3> first;
  for (const scene::Keyframe& key : body.motion.keyframes) {
    if (!key.position) continue;
    if (!first) first = key.position;
    ways.push_back(*key.position - *first);
  }
  for (const scene::Sinusoid& sinusoid : body.motion.sinusoid)
    for (const double sign : {-1, 1}) ways.push_back(sign * sinusoid.amplitude);
  return ways;
}

// Adds the places that body `i` of the manifest is led to, and those to which it pushes bodies that are in
// its way.
void add_prescribed(const scene::RigidBody& body, const io::Manifest& manifest, std::size_t i,
                    Eigen::AlignedBox3d& box) {
  const Eigen::AlignedBox3d& start = *manifest.bodies[i].box;
  for (const Vec3& way : prescribed_ways(body)) {
    const Eigen::AlignedBox3d end = start.translated(way), swept = start.merged(end);
    box.extend(end);
    for (const io::ManifestBody& other : manifest.bodies)
      if (other.box && other.kind != "static" && swept.intersects(*other.box))
        box.extend(other.box->translated(way));
  }
}

// Returns for how long (s, at most `longest`) a box is shown that moves at `velocity` (m/s): until it has
// passed through the box of the other bodies, which stop it, if it flies at them.
double shown_seconds(const Eigen::AlignedBox3d& box, const Vec3& velocity, const Eigen::AlignedBox3d& others,
                     double longest) {
  if (others.isEmpty()) return longest;
  double enter = 0, exit = longest;  // s, when the two boxes begin and cease to overlap
  for (int axis = 0; axis < 3; ++axis) {
    const double below = others.min()[axis] - box.max()[axis], above = others.max()[axis] - box.min()[axis];
    if (velocity[axis] == 0) {
      if (below > 0 || above < 0) return longest;
      continue;
    }
    const double first = below / velocity[axis], last = above / velocity[axis];
    enter = std::max(enter, std::min(first, last));
    exit = std::min(exit, std::max(first, last));
  }
  const bool flies_at_them = enter > 0 && enter < exit;
  return flies_at_them ? exit : longest;
}

// Returns the box that the picture shall show: around the moving bodies, their paths and the ground below
// them. Empty if no body of the manifest has a box of finite size.
Eigen::AlignedBox3d box_of_what_moves(const scene::Scene& scene, const io::Manifest& manifest) {
  std::vector<std::size_t> moving;
  Eigen::AlignedBox3d all, box;
  for (std::size_t i = 0; i < manifest.bodies.size(); ++i) {
    const io::ManifestBody& body = manifest.bodies[i];
    if (!body.box) continue;
    all.extend(*body.box);
    if (body.kind == "static") continue;
    box.extend(*body.box);
    if (i < scene.rigid.size() && scene.rigid[i].is_kinematic)
      add_prescribed(scene.rigid[i], manifest, i, box);
    if (!start_velocity(scene, i).isZero()) moving.push_back(i);
  }
  const double longest = std::min(scene.frames / scene.fps, longest_way);
  for (const std::size_t i : moving) {
    Eigen::AlignedBox3d others;
    for (std::size_t k = 0; k < manifest.bodies.size(); ++k)
      if (k != i && manifest.bodies[k].box && manifest.bodies[k].kind != "static")
        others.extend(*manifest.bodies[k].box);
    const Vec3 velocity = start_velocity(scene, i);
    const Eigen::AlignedBox3d& start = *manifest.bodies[i].box;
    box.extend(start.translated(shown_seconds(start, velocity, others, longest) * velocity));
  }
  if (box.isEmpty()) box = all;
  if (!box.isEmpty() && scene.ground && scene.ground->height < box.min().y()) {
    Vec3 below = box.center();
    below.y() = scene.ground->height;
    box.extend(below);
  }
  const double size = box.isEmpty() ? 0 : box.diagonal().norm();
  return size > 0 && std::isfinite(size) ? box : Eigen::AlignedBox3d();
}

// Moves the camera back until the box, enlarged by `margin`, fits into the picture, which is `aspect` times
// as wide as high. With q = corner - center, and the directions f forward, r right and u up, the camera's
// distance d of the center is the least with
//   margin |q . u| <= (d + q . f) tan(fov / 2)  and  margin |q . r| <= (d + q . f) aspect tan(fov / 2).
void place_camera(const Eigen::AlignedBox3d& box, double aspect, scene::Camera& camera) {
  const double half = std::tan(camera.vertical_fov / 2 * std::numbers::pi / 180);
  const Vec3 right = camera.up.cross(to_camera).normalized(), up = to_camera.cross(right);
  double distance = 0;
  for (int i = 0; i < 8; ++i) {
    const Vec3 q = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)) - box.center();
    const double needed = margin * std::max(std::abs(q.dot(up)), std::abs(q.dot(right)) / aspect) / half;
    distance = std::max(distance, needed + q.dot(to_camera));
  }
  camera.target = box.center();
  camera.position = box.center() + distance * to_camera;
}

scene::Light lamp(const Eigen::AlignedBox3d& box) {
  scene::Light light;
  const double radius = box.diagonal().norm() / 2, distance = lamp_distance * radius;
  light.position = box.center() + distance * to_lamp;
  light.target = box.center();
  light.radius = lamp_radius * radius;
  light.power = irradiance * 4 * std::numbers::pi * distance * distance;
  return light;
}

}  // namespace

scene::Scene with_default_view(scene::Scene scene, const io::Manifest& manifest) {
  const bool needs_lamp = scene.lights.empty() && !scene.has_sky;
  if (scene.has_camera && !needs_lamp) return scene;
  const Eigen::AlignedBox3d box = box_of_what_moves(scene, manifest);
  if (box.isEmpty()) return scene;
  const double aspect = static_cast<double>(scene.render.width) / scene.render.height;
  if (!scene.has_camera) place_camera(box, aspect, scene.camera);
  if (needs_lamp) scene.lights.push_back(lamp(box));
  return scene;
}

}  // namespace duet::render
