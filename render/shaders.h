// The GLSL programs. A picture is made in five passes:
//   shadow      one depth map for each shadow sample, as layers of one array texture
//   geometry    normal, look and depth of the nearest body, `supersampling` samples a pixel along each axis
//   mirror      the other bodies as seen from the center of a mirroring body, in six directions
//   visibility  the fraction of the light of area lights and of the sky that arrives at a pixel. Every pixel
//               asks a ninth of the shadow maps; each block of 3 x 3 pixels asks all of them.
//   shading     gathers visibility from the block around a pixel, and shades once, or once a sample where the
//               samples of the pixel differ (edges); box filter in linear light, then the tone curve
#pragma once

#include <string>

namespace duet::render::shaders {

/// Side of the blocks of pixels that divide the shadow maps among themselves (pixels). It must equal the
/// width of the window from which the shading pass gathers visibility: then every pixel gathers from all
/// maps.
inline constexpr int block = 3;
static_assert(
    block == 3,
    "visibility() in shaders.cpp gathers from 3 x 3 pixels: with other blocks it would miss a part of "
    "the shadow maps, or count one twice");
/// Largest number of lights in a scene.
inline constexpr int max_lights = 32;
/// Largest number of shadow maps.
inline constexpr int max_shadow_samples = 256;
/// Largest number of bodies that mirror others; six pictures of 128 x 128 texels for each.
inline constexpr int max_mirrors = 8;
/// Number of the pattern that shows values as colors; 0 is none, 1 checker, 2 stripes.
inline constexpr int value_pattern = 3;

/// Binding points of the uniform blocks.
enum class Block : unsigned {
  looks,          ///< block `Looks`: colors of all looks
  lights,         ///< block `Lights`: the lights of the scene
  shadow_samples  ///< block `ShadowSamples`: the shadow maps and their projections
};

/// Vertex shader of the shadow pass: projects positions to a shadow map.
std::string shadow_vertex();
/// Fragment shader of the shadow pass: writes the depth alone.
std::string shadow_fragment();
/// Vertex shader of the geometry and mirror passes.
std::string geometry_vertex();
/// Fragment shader of the geometry pass: packs normal, pattern, look and mirror of a surface into four
/// numbers of 16 bits.
std::string geometry_fragment();
/// Fragment shader of the mirror pass, used with geometry_vertex(): color, and distance from the mirroring
/// center (m).
std::string mirror_fragment();
/// Vertex shader of the passes over the screen: one triangle that covers the viewport.
std::string screen_vertex();
/// Fragment shader of the visibility pass.
std::string visibility_fragment();
/// Fragment shader of the shading pass.
std::string shading_fragment();

}  // namespace duet::render::shaders
