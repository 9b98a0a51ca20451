#include "render/shaders.h"

#include <fmt/format.h>

#include "render/looks.h"
#include "render/shading_glsl.h"

namespace duet::render::shaders {
namespace {

// Returns the version line and the constants that all shaders share with the renderer.
std::string header() {
  return fmt::format(
      "#version 330 core\n"
      "const int block = {}, max_looks = {}, max_lights = {}, max_samples = {}, max_mirrors = {};\n"
      "const int look_codes = 2 * max_looks, value_pattern = {}, max_spots = {};\n",
      block, max_looks, max_lights, max_shadow_samples, max_mirrors, value_pattern, scene::Look::max_spots);
}

// Octahedral maps of unit vectors: fold() projects a unit vector to the octahedron |x| + |y| + |z| = 1, whose
// lower half is folded outwards, and returns two numbers in [-1, 1]; unfold() is its inverse.
constexpr const char* octahedron = R"(
vec2 signs(vec2 v) { return vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0); }
vec2 fold(vec3 n) {
  n /= abs(n.x) + abs(n.y) + abs(n.z);
  return n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * signs(n.xy);
}
vec3 unfold(vec2 f) {
  vec3 n = vec3(f, 1.0 - abs(f.x) - abs(f.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * signs(n.xy);
  return normalize(n);
}
)";

// Patterns are averaged over the width of a pixel, so that they never flicker.
constexpr const char* patterns = R"(
// Returns the mean over `width` around x of the square wave that is +1 on (0, 1), -1 on (1, 2) and has the period 2.
float square_wave(float x, float width) {
  return (abs(mod(x - 0.5 * width, 2.0) - 1.0) - abs(mod(x + 0.5 * width, 2.0) - 1.0)) / width;
}
// Returns the weight of the second color, 0 to 1, at the place x (bands) of a pattern: 0 none, 1 checker, 2 stripes
// across x. `width` is that of a pixel (bands).
float pattern_blend(int pattern, vec2 x, vec2 width) {
  if (pattern == 0) return 0.0;
  width = max(width, vec2(1e-4));
  float along = square_wave(x.x, width.x);
  return 0.5 - 0.5 * (pattern == 1 ? along * square_wave(x.y, width.y) : along);
}
)";

constexpr const char* ground_plane = R"(
uniform int has_ground;
uniform float ground_height;
const int ground_look = 1;
)";

// surface_at() returns the surface that a sample of the picture shows, from the depth of the bodies and the
// plane of the ground.
constexpr const char* surface_lookup = R"(
uniform sampler2D surfaces;
uniform sampler2D depths;
// Place of the camera (m) and its axes: right and up lead to the border of the picture at distance 1.
uniform vec3 eye, forward, right, up;
uniform vec2 depth_range;
uniform ivec2 picture;
uniform int supersampling;

struct Surface { bool hit; vec3 position; vec3 normal; float z; int look; int mirror; float blend; };

// Returns the ray through the place `at` (pixels) of the picture. Its component along `forward` is 1.
vec3 ray_through(vec2 at) {
  vec2 x = 2.0 * at / vec2(picture) - 1.0;
  return forward + x.x * right + x.y * up;
}

// Returns the nearest surface at the sample `place`; its z is the distance along the view (m).
Surface surface_at(ivec2 place) {
  vec3 ray = ray_through((vec2(place) + 0.5) / float(supersampling));
  vec4 body = texelFetch(surfaces, place, 0);
  float depth = texelFetch(depths, place, 0).x;
  int code = int(body.w * 65535.0 + 0.5), look = code % look_codes - 1;
  float body_z = depth_range.x * depth_range.y / (depth_range.y - depth * (depth_range.y - depth_range.x));
  float ground_z = (ground_height - eye.y) / min(ray.y, -1e-9);
  bool ground = has_ground == 1 && ray.y < 0.0 && ground_z > 0.0 && (look < 0 || ground_z < body_z);
  Surface s;
  s.hit = ground || look >= 0;
  s.z = ground ? ground_z : body_z;
  s.position = eye + s.z * ray;
  s.normal = ground ? vec3(0.0, 1.0, 0.0) : unfold(body.xy * 2.0 - 1.0);
  s.look = ground ? ground_look : look;
  s.mirror = ground ? -1 : code / look_codes - 1;
  s.blend = ground ? 0.0 : body.z;
  return s;
}
)";

constexpr const char* shadow_lookup = R"(
struct ShadowSample {
  mat4 to_map;
  vec4 place;   // w = 1: point on a light (m), w = 0: unit direction towards the sky
  vec4 weight;  // x: luminance of the irradiance, y: width of a texel (m); of lights at distance 1 m
};
layout(std140) uniform ShadowSamples { ShadowSample samples[max_samples]; };
uniform sampler2DArrayShadow shadow_maps;

// Returns the visibility of sample i: 1 if nothing stands between it and the point, 0 if a body does, and values
// between them at the border of a shadow. The maps hold the far sides of bodies, so that a shift of the point by half a
// texel keeps surfaces from shadowing themselves. `distance_to_light` is in m, and 1 for the sky.
float visible(int i, vec3 position, vec3 normal, float distance_to_light) {
  vec3 shifted = position + normal * (0.5 * samples[i].weight.y * distance_to_light);
  vec4 m = samples[i].to_map * vec4(shifted, 1.0);
  if (m.w <= 0.0) return 1.0;
  m.xyz /= m.w;
  return texture(shadow_maps, vec4(m.xy, float(i), min(m.z, 1.0)));
}
)";

constexpr const char* visibility_main = R"(
uniform ivec2 tile;    // corner of this ninth of the pixels in the target (texels)
uniform ivec2 phase;   // place of the pixel in every block that belongs to this ninth
uniform int first_sample, light_samples, all_samples;
// Luminance of the irradiance; x, y: of area lights with and without shadows; z, w: of the sky with and without them.
layout(location = 0) out vec4 shares;
layout(location = 1) out vec4 key;  // xyz: normal; w: distance along the view (m), -1: no surface

void main() {
  ivec2 pixel = min(block * (ivec2(gl_FragCoord.xy) - tile) + phase, picture - 1);
  Surface s = surface_at(supersampling * pixel + supersampling / 2);
  vec4 sum = vec4(0.0);
  int last_light = s.hit ? light_samples : 0, last_sky = s.hit ? all_samples : 0;
  int i = first_sample;
  for (; i < last_light; i += block * block) {
    vec3 d = samples[i].place.xyz - s.position;
    float squared = dot(d, d), length_of_d = sqrt(squared);
    float full = samples[i].weight.x * max(dot(s.normal, d), 0.0) / (squared * length_of_d);
    sum.xy += full * vec2(visible(i, s.position, s.normal, length_of_d), 1.0);
  }
  for (; i < last_sky; i += block * block) {
    float full = samples[i].weight.x * max(dot(s.normal, samples[i].place.xyz), 0.0);
    sum.zw += full * vec2(visible(i, s.position, s.normal, 1.0), 1.0);
  }
  shares = sum;
  key = s.hit ? vec4(s.normal, s.z) : vec4(0.0, 0.0, 0.0, -1.0);
}
)";

}  // namespace

std::string shadow_vertex() {
  return header() + R"(
uniform mat4 to_map;
layout(location = 0) in vec3 position;
void main() {
  vec4 m = to_map * vec4(position, 1.0);
  gl_Position = vec4(2.0 * m.xyz - m.w, m.w);
}
)";
}

std::string shadow_fragment() { return header() + "void main() {}\n"; }

std::string geometry_vertex() {
  return header() + R"(
uniform mat4 projection;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec2 value_inverted;
out vec3 world_normal, world_position;
out vec2 texture_place, value;
void main() {
  world_position = position;
  world_normal = normal;
  texture_place = uv;
  value = value_inverted;
  gl_Position = projection * vec4(position, 1.0);
}
)";
}

std::string geometry_fragment() {
  return header() + octahedron + patterns + R"(
uniform int look, mirror, pattern;
uniform int supersampling;
uniform float opacity;
uniform int spot_count;
uniform vec3 spots[max_spots];  // place and radius in texture coordinates
uniform vec2 repeats;  // bands of the pattern in a unit of the texture coordinates
uniform float value_range;
in vec3 world_normal, world_position;
in vec2 texture_place, value;
layout(location = 0) out vec4 surface;

// Returns whether the body covers this sample. A translucent body covers the fraction `opacity` of the samples of every
// pixel, the middle one first, because the pixel is lit and shadowed as its middle sample is.
bool covered() {
  ivec2 place = ivec2(gl_FragCoord.xy) % supersampling;
  int count = supersampling * supersampling, middle = (supersampling + 1) * (supersampling / 2);
  int rank = (place.x + supersampling * place.y - middle + count) % count;
  return opacity * float(count) > float(rank) + 0.5;
}

void main() {
  if (!covered()) discard;
  vec2 x = texture_place * repeats;
  float length_of_normal = length(world_normal);
  vec3 n = length_of_normal > 0.0 ? world_normal / length_of_normal : vec3(0.0, 1.0, 0.0);
  if (!gl_FrontFacing) n = -n;
  float blend = pattern_blend(pattern, x, fwidth(x));
  // Triangles across the border of two planes of projection, whose texture coordinates jump, have no spots.
  vec2 jump = vec2(length(dFdx(texture_place)), length(dFdy(texture_place)));
  vec2 width = vec2(length(dFdx(world_position)), length(dFdy(world_position)));
  int count = length(jump) < 4.0 * length(width) ? spot_count : 0;
  for (int i = 0; i < count; ++i) {
    float inside = spots[i].z - distance(texture_place, spots[i].xy);
    blend = max(blend, clamp(0.5 + inside / max(fwidth(inside), 1e-6), 0.0, 1.0));
  }
  int worn = look;
  if (pattern == value_pattern) {
    blend = clamp(value.x / value_range, 0.0, 1.0);
    if (value.y > 0.5) worn += 1;  // the look of inverted elements follows that of values
  }
  surface = vec4(fold(n) * 0.5 + 0.5, blend, float(worn + 1 + look_codes * (mirror + 1)) / 65535.0);
}
)";
}

std::string screen_vertex() {
  return header() + R"(
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
)";
}

std::string mirror_fragment() { return header() + ground_plane + shadow_lookup + environment + mirror_main; }

std::string visibility_fragment() {
  return header() + octahedron + ground_plane + surface_lookup + shadow_lookup + visibility_main;
}

std::string shading_fragment() {
  return header() + octahedron + patterns + ground_plane + surface_lookup + shadow_lookup + environment +
         mirror_lookup + shading_functions + shading_main;
}

}  // namespace duet::render::shaders
