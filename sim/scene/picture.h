// How the pictures of a scene are drawn: camera, lights, sky, looks of surfaces and size, as a scene file
// gives them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/base/types.h"

namespace duet::scene {

/// A keyframe of the camera. Members that are not given are those of the camera itself.
struct CameraKey {
  double time = 0;                     ///< Time of the keyframe, s.
  std::optional<Vec3> position;        ///< Position of the eye, m.
  std::optional<Vec3> target;          ///< Point in the middle of the picture, m.
  std::optional<double> vertical_fov;  ///< Vertical angle of view, degrees.
};

/// The camera.
struct Camera {
  Vec3 position = Vec3(0, 2, 10);         ///< Position of the eye, m, world space.
  Vec3 target = Vec3::Zero();             ///< Point in the middle of the picture, m, world space.
  Vec3 up = Vec3::UnitY();                ///< Direction that points up in the picture.
  double vertical_fov = 30;               ///< Angle from the lower to the upper edge of the picture, degrees.
  std::vector<CameraKey> keyframes = {};  ///< Keyframes that it moves between; see CameraPath.
};

/// Kinds of lights.
enum class LightKind {
  area,  ///< A disc that faces its target and casts soft shadows.
  point  ///< A point that casts no shadows.
};

/// A light.
struct Light {
  std::string name;                  ///< Name, unique among the lights.
  LightKind kind = LightKind::area;  ///< Kind of the light.
  Vec3 position = Vec3(0, 10, 0);    ///< Position of the light, m, world space.
  Vec3 target = Vec3::Zero();        ///< Point that an area light faces, m, world space.
  double radius = 1;                 ///< Radius of the disc of an area light, m.
  /// Power, as in the paper's pictures: a surface that faces the light at distance d has the irradiance
  /// power / (4 pi d^2).
  double power = 1000;
  Vec3 color = Vec3::Ones();  ///< Color of the light, linear RGB, in [0, 1].
  bool shadow = true;         ///< True if the light casts shadows; false for point lights.
};

/// Ambient light from all directions, which is also the background.
struct Sky {
  Vec3 zenith = Vec3(0.45, 0.6, 0.9);   ///< Radiance straight up, linear RGB.
  Vec3 horizon = Vec3(0.9, 0.93, 1.0);  ///< Radiance at the horizon, linear RGB.
  double intensity = 0.5;               ///< Factor on both as light, 1.
};

/// How a surface is drawn.
struct Look {
  std::string name;                  ///< Unique name, by which bodies refer to the look.
  Vec3 color = Vec3(0.8, 0.8, 0.8);  ///< Base color, linear RGB, in [0, 1].
  double metallic = 0;               ///< From 0 (plastic, stone, wood) to 1 (bare metal).
  double roughness = 0.5;            ///< From 0 (mirror) to 1 (chalk).
  std::string pattern;  ///< "checker", "stripes" (bands that show the spin of balls), or empty for none.
  Vec3 color2 = Vec3(0.6, 0.6, 0.6);  ///< Color of the pattern and the spots, linear RGB, in [0, 1].
  double pattern_size = 1;            ///< Size of the pattern's cells, m.
  double opacity = 1;                 ///< Fraction of a pixel that hides what lies behind, in [0, 1].
  /// Round spots of `color2`: u, v and radius in texture coordinates.
  std::vector<Vec3> spots;
  /// Largest number of spots; the renderer's shaders hold this many.
  static constexpr std::size_t max_spots = 16;
};

/// Meaning of the colors of deformable bodies.
enum class ColorBy {
  look,    ///< The look of the body.
  strain,  ///< Strain, from blue (none) to yellow (strain_range); red where elements are inverted.
  stress,  ///< Von Mises' equivalent of the stress, from blue (none) to yellow (color_range).
  contact  ///< Pressure of contact, from blue (none) to yellow (color_range).
};

/// Size and quality of the pictures.
struct Render {
  int width = 1280;               ///< Width of the picture, pixels.
  int height = 720;               ///< Height of the picture, pixels.
  int supersampling = 2;          ///< Samples per pixel along each axis.
  int shadow_samples = 64;        ///< Shadow maps, shared by the shadow-casting lights and the sky; 0: none.
  double exposure = 1.0;          ///< Factor on radiance before tone mapping, 1.
  ColorBy color = ColorBy::look;  ///< Meaning of the colors of deformable bodies.
  double strain_range = 0.5;      ///< |stretch - 1| at the yellow end of the strain colors, 1.
  /// Stress or pressure of contact at the yellow end of their colors, Pa. Given if `color` is one of them.
  std::optional<double> color_range{};
  /// Returns the value at the yellow end of the colors, in the unit of what they show.
  double range_of_color() const { return color == ColorBy::strain ? strain_range : color_range.value_or(1); }
};

}  // namespace duet::scene
