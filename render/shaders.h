// The GLSL programs. How a picture comes about:
//   shadow      one depth map a shadow sample, layers of one array texture
//   geometry    normal, look and depth of the nearest body, `supersampling` samples per pixel along each axis
//   mirror      what the middle of a mirroring body sees of the other bodies, in six directions
//   visibility  per pixel: how much of the area lights' and of the sky's light arrives. Every pixel asks a
//   ninth of
//               the shadow maps; each block of 3 x 3 pixels asks them all
//   shading     per pixel: gathers visibility from the block around it, and shades once, or once a sample
//   where the
//               samples of the pixel differ (edges); box filter in linear light, then the tone curve
#pragma once

#include <string>

namespace duet::render::shaders {

// Side of the blocks of pixels that share the shadow maps out.
inline constexpr int block = 3;
inline constexpr int max_lights = 32;
inline constexpr int max_shadow_samples = 256;
inline constexpr int max_mirrors = 8;
inline constexpr int strain_pattern = 3;  // after checker and stripes

// Bindings of the uniform blocks.
enum class Block : unsigned { looks, lights, shadow_samples };

std::string shadow_vertex();
std::string shadow_fragment();
std::string geometry_vertex();
std::string geometry_fragment();
std::string mirror_fragment();  // with the vertex shader of the geometry
std::string screen_vertex();    // one triangle that covers the viewport
std::string visibility_fragment();
std::string shading_fragment();

}  // namespace duet::render::shaders
