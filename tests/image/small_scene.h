// The small scene, which is a ball and two boxes on the ground, and functions that read its picture.
#pragma once

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/projection.h"
#include "render/sequence.h"
#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/simulation/frame.h"

namespace duet::image_tests {

// A pixel of a picture: sRGB bytes.
struct Pixel {
  int r = 0, g = 0, b = 0;
};

struct Picture {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;

  Pixel at(int x, int y) const {
    if (x < 0 || x >= width || y < 0 || y >= height) throw std::out_of_range("pixel outside of the picture");
    const unsigned char* p = rgb.data() + 3 * (y * width + x);
    return {p[0], p[1], p[2]};
  }
  bool operator==(const Picture&) const = default;
};

// Returns the linear value of an sRGB byte, from 0 to 1.
inline double linear(int byte) {
  const double c = byte / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

// Returns the relative luminance of a pixel, from 0 to 1 (coefficients of ITU-R BT.709).
inline double luminance(Pixel p) {
  return 0.2126 * linear(p.r) + 0.7152 * linear(p.g) + 0.0722 * linear(p.b);
}

// Families of colors to which the looks of the small scene belong, in light and in shade.
inline bool is_orange(Pixel p) { return p.r > 1.3 * p.g && p.g > 1.3 * p.b; }
inline bool is_green(Pixel p) { return p.g > 1.3 * p.r && p.g > 1.3 * p.b; }
inline bool is_gray(Pixel p) { return std::abs(p.r - p.g) < 40 && std::abs(p.g - p.b) < 40; }

inline scene::Look make_look(const std::string& name, const Vec3& color, double metallic, double roughness) {
  scene::Look look;
  look.name = name;
  look.color = color;
  look.metallic = metallic;
  look.roughness = roughness;
  return look;
}

inline scene::Scene small_scene() {
  scene::Scene scene;
  scene.path = "small.toml";
  scene.camera = {.position = {0, 4, 12}, .target = {0, 1, 0}, .vertical_fov = 30};
  scene.ground = scene::Ground{.look = "floor"};
  scene.lights = {{.name = "key", .position = {12, 12, 2}, .target = {0, 0, 0}, .radius = 1, .power = 6000}};
  scene.sky = {.zenith = {0.3, 0.3, 0.3}, .horizon = {0.5, 0.5, 0.5}, .intensity = 0.5};
  scene.looks = {
      make_look("floor", {0.5, 0.5, 0.5}, 0, 0.9),
      make_look("orange", {0.9, 0.3, 0.06}, 0, 0.5),
      make_look("green", {0.1, 0.6, 0.1}, 0, 0.5),
      make_look("silver", {0.8, 0.8, 0.8}, 1, 0.25),
  };
  scene.render = {.width = 320, .height = 180, .supersampling = 2, .shadow_samples = 32};
  return scene;
}

inline const Vec3 ball_center(-2.8, 1, 0), orange_center(0, 1, 0), green_center(2.8, 0.8, 0.5);

inline io::Manifest small_manifest() {
  io::Manifest manifest;
  const Surface ball = shape_surface(LevelSet::sphere(1)), box = shape_surface(LevelSet::box(Vec3(2, 2, 2)));
  const auto body = [](const std::string& name, const std::string& look, const Surface& s) {
    return io::ManifestBody{.name = name,
                            .kind = "rigid",
                            .look = look,
                            .material = "",
                            .vertices = static_cast<int>(s.positions.size()),
                            .triangles = static_cast<int>(s.triangles.size())};
  };
  manifest.bodies = {body("ball", "silver", ball), body("orange", "orange", box),
                     body("green", "green", box)};
  return manifest;
}

// Returns the surface moved to `pose`.
inline BodySurface placed(const std::string& name, Surface surface, const Pose& pose) {
  for (Vec3& x : surface.positions) x = pose.to_world(x);
  for (Vec3f& n : surface.normals) n = (pose.orientation * n.cast<double>()).cast<float>();
  return {name, std::move(surface)};
}

inline std::vector<BodySurface> small_bodies() {
  const Quat turned(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  return {placed("ball", shape_surface(LevelSet::sphere(1)), {ball_center, Quat::Identity()}),
          placed("orange", shape_surface(LevelSet::box(Vec3(2, 2, 2))), {orange_center, turned}),
          placed("green", shape_surface(LevelSet::box(Vec3(1.6, 1.6, 1.6))), {green_center, turned})};
}

inline Picture draw(const scene::Scene& scene, const io::Manifest& manifest = small_manifest(),
                    const std::vector<BodySurface>& bodies = small_bodies(),
                    render::Backend backend = render::Backend::automatic) {
  render::SequenceRenderer renderer(scene, manifest, backend);
  return {scene.render.width, scene.render.height, renderer.draw(bodies)};
}

// Returns the pixel at which the camera of the scene sees `point` (m), if nothing hides it.
inline Pixel pixel_of(const Picture& picture, const scene::Scene& scene, const Vec3& point) {
  const Vec2 at = render::make_view(scene.camera, picture.width, picture.height)
                      .to_pixel(point, picture.width, picture.height);
  return picture.at(static_cast<int>(at.x()), static_cast<int>(at.y()));
}

}  // namespace duet::image_tests
