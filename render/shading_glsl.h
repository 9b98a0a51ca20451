// GLSL texts of the passes that shade: sky and lights, mirror images, and what a surface shows to the camera.
// The sources of shaders.cpp put them together with the lookups of surfaces and shadows.
#pragma once

namespace duet::render::shaders {

/// Looks, lights, sky and ground: the data of shading, and the radiance of what is not a body.
inline constexpr const char* environment = R"(
struct Look { vec4 color_metallic; vec4 color2_roughness; };
layout(std140) uniform Looks { Look looks[max_looks]; };
// place_radius: m; color_shadow: irradiance at distance 1 m, and w > 0 if the light casts shadows.
struct Light { vec4 place_radius; vec4 color_shadow; };
layout(std140) uniform Lights { Light lights[max_lights]; };
uniform int light_count;
uniform vec3 zenith, horizon;
uniform vec3 target;  // m, target of the camera: the place from which the background shows the glow of the lights
uniform float sky_intensity;
uniform float fade_distance;  // m, distance at which the ground has faded by 1 - 1/e
const float pi = 3.14159265;
const float glow_strength = 0.8;  // relative to the radiance of a white surface that faces the light

// Returns the radiance of the sky in direction d, seen from `position`: a gradient and a broad glow around every area
// light. The glow makes the faces of a mirroring body differ.
vec3 sky(vec3 position, vec3 d) {
  float x = 1.0 - clamp(d.y, 0.0, 1.0), x2 = x * x;
  vec3 radiance = mix(zenith, horizon, x2 * x2);
  for (int i = 0; i < light_count; ++i) {
    vec3 to_light = lights[i].place_radius.xyz - position;
    float squared = dot(to_light, to_light);
    float toward = 0.5 + 0.5 * dot(d, to_light) * inversesqrt(squared);
    float glow = lights[i].place_radius.w > 0.0 ? toward * toward * toward * toward : 0.0;
    radiance += lights[i].color_shadow.rgb * (glow_strength * glow / (pi * squared));
  }
  return radiance;
}

// Returns the irradiance of the unobstructed sky on a surface with the normal n, which sees the fraction (1 + n.y) / 2
// of it.
vec3 sky_irradiance(vec3 n) {
  float share = 0.5 + 0.5 * n.y;
  return pi * sky_intensity * share * mix(horizon, zenith, mix(0.76, 0.93, max(n.y, 0.0)));
}

// Returns 1 - exp(-(d / fade_distance)^2), the weight of the horizon's color in that of the ground at distance d (m).
float faded(float d) {
  float x = d / fade_distance;
  return 1.0 - exp(-x * x);
}

// Returns the color of the ground; `blend` is the weight of its second color.
vec3 ground_color(float blend) {
  return mix(looks[ground_look].color_metallic.rgb, looks[ground_look].color2_roughness.rgb, blend);
}

// Returns the radiance of the ground at `position` on it. `lit` is the fraction of the light of area lights that
// arrives there.
vec3 ground_radiance(vec3 position, float lit) {
  vec3 irradiance = sky_irradiance(vec3(0.0, 1.0, 0.0));
  for (int i = 0; i < light_count; ++i) {
    vec3 d = lights[i].place_radius.xyz - position;
    float squared = dot(d, d);
    float arrives = lights[i].color_shadow.w > 0.0 ? lit : 1.0;
    irradiance += arrives * lights[i].color_shadow.rgb * max(d.y, 0.0) / (squared * sqrt(squared));
  }
  return irradiance * ground_color(0.5) / pi;
}

// Returns the radiance that a mirror of this roughness shows in direction d: that of the sky, or of the ground with the
// shadows of the first `shadow_lookups` samples. Other bodies are not in it.
vec3 reflected(vec3 position, vec3 d, float roughness, int shadow_lookups) {
  float blur = 0.01 + 0.6 * roughness * roughness;
  vec3 above = sky(position, d);
  float side = smoothstep(-blur, blur, d.y);
  if (has_ground == 0) return above;
  float fall = max(-d.y, 0.02);
  float path = max(position.y - ground_height, 0.0) / fall;
  vec3 there = position + path * d;
  there.y = ground_height;
  float lit = 0.0, lookups = 0.0;
  for (int i = 0; i < shadow_lookups; i += 2) {  // every second one is enough for a mirrored shadow
    lit += visible(i, there, vec3(0.0, 1.0, 0.0), length(samples[i].place.xyz - there));
    lookups += 1.0;
  }
  lit = lookups > 0.0 ? lit / lookups : 1.0;
  return mix(mix(ground_radiance(there, lit), sky(position, normalize(vec3(d.x, 0.0, d.z))), faded(path)), above, side);
}
)";

/// Look-up of reflections in the views from the center of a mirroring body along the six directions of the
/// axes: colors and distances.
inline constexpr const char* mirror_lookup = R"(
uniform sampler2DArray mirror_colors;     // rgb: radiance times coverage, a: coverage
uniform sampler2DArray mirror_distances;  // m from the center
uniform vec3 mirror_centers[max_mirrors];
// Half the width of a view at distance 1. It is more than 1, because blurred look-ups at the border read beyond it.
uniform float mirror_half_width;
uniform float mirror_side;  // width of a view (texels)

// Returns texture coordinates and layer of the direction d in the views of a mirror.
vec3 mirror_place(int mirror, vec3 d) {
  vec3 a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  vec3 along = x ? vec3(d.x, d.z, d.y) : y ? vec3(d.y, d.x, d.z) : vec3(d.z, -d.x, d.y);
  float side = along.x < 0.0 ? -1.0 : 1.0;
  vec2 place = vec2(side * along.y, along.z) / (abs(along.x) * mirror_half_width);
  return vec3(0.5 + 0.5 * place, float(6 * mirror + (x ? 0 : y ? 2 : 4) + (side < 0.0 ? 1 : 0)));
}

// Returns the distance (m) by which the point p, relative to the center, lies behind the surface that the center sees
// in its direction.
float behind(int mirror, vec3 p) {
  return length(p) - textureLod(mirror_distances, mirror_place(mirror, p), 0.0).x;
}

// Returns the radiance of the bodies that the ray from `position` along d meets, and their coverage in w. Marches until
// the ray gets behind the surfaces that the center sees, then bisects the last step.
vec4 mirrored_bodies(int mirror, vec3 position, vec3 d, float alpha) {
  const int steps = 40, halvings = 5;
  float reach = has_ground == 1 && d.y < 0.0 ? (position.y - ground_height) / -d.y : 1e30;
  vec3 start = position - mirror_centers[max(mirror, 0)];
  float before = 0.0, after = 0.0, size = length(start);
  bool met = false;
  int count = mirror >= 0 ? steps : 0;
  for (int i = 0; i < count && !met && after < reach; ++i) {
    before = after;
    after = after * 1.11 + 0.03 * size;
    float depth = behind(mirror, start + after * d);
    met = depth > 0.0 && depth < 2.0 * (after - before) + size;  // takes bodies for as thick as this one
  }
  count = met ? halvings : 0;
  for (int i = 0; i < count; ++i) {
    float middle = 0.5 * (before + after);
    bool inside = behind(mirror, start + middle * d) > 0.0;
    after = inside ? middle : after;
    before = inside ? before : middle;
  }
  if (!met || after > reach) return vec4(0.0);
  float level = log2(1.0 + alpha * mirror_side);
  vec4 seen = textureLod(mirror_colors, mirror_place(mirror, start + after * d), level);
  return vec4(seen.rgb / max(seen.a, 1e-3), smoothstep(0.4, 0.9, seen.a));
}
)";

/// Main function of the mirror pass. It shades with the same lights as the picture, with fewer shadow maps
/// and without reflections of other bodies.
inline constexpr const char* mirror_main = R"(
uniform vec3 eye;
uniform int look, light_samples;
in vec3 world_normal, world_position;
layout(location = 0) out vec4 color;
layout(location = 1) out float distance_to_eye;

void main() {
  vec3 n = normalize(world_normal), v = normalize(eye - world_position);
  vec3 base = looks[look].color_metallic.rgb;
  float metallic = looks[look].color_metallic.a, lit = 0.0, lookups = 0.0;
  for (int i = 0; i < light_samples; i += block) {
    lit += visible(i, world_position, n, length(samples[i].place.xyz - world_position));
    lookups += 1.0;
  }
  lit = lookups > 0.0 ? lit / lookups : 1.0;
  vec3 irradiance = sky_irradiance(n);
  for (int i = 0; i < light_count; ++i) {
    vec3 d = lights[i].place_radius.xyz - world_position;
    float squared = dot(d, d), arrives = lights[i].color_shadow.w > 0.0 ? lit : 1.0;
    irradiance += arrives * lights[i].color_shadow.rgb * max(dot(n, d), 0.0) / (squared * sqrt(squared));
  }
  vec3 below = has_ground == 1 ? ground_radiance(vec3(world_position.x, ground_height, world_position.z), 0.5)
                               : vec3(0.0);
  irradiance += pi * below * (0.5 - 0.5 * n.y);
  vec3 mirror = reflected(world_position, reflect(-v, n), looks[look].color2_roughness.a, 0);
  color = vec4(base * mix(irradiance / pi, mirror, metallic), 1.0);
  distance_to_eye = length(eye - world_position);
}
)";

/// Functions that shade a point of a surface: diffuse light, highlights, reflections, visibility of lights
/// and sky.
inline constexpr const char* shading_functions = R"(
uniform sampler2D shares, keys;
uniform ivec2 tile_size;
uniform int light_samples;
uniform int ground_pattern;
uniform float ground_pattern_size;
uniform vec2 ground_pattern_origin;  // bands, place of the eye in the pattern
uniform float exposure;
uniform float pixel_size;  // width of a pixel (m) at distance 1 m
layout(location = 0) out vec4 color;

// Returns the fractions of the light of area lights (x) and of the sky (y) that arrive at s. They are gathered from
// those of the 3 x 3 pixels around that show the surface of s: about the normal of s, on its tangent plane.
vec2 visibility(ivec2 pixel, Surface s) {
  vec4 same = vec4(0.0), all = vec4(0.0);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      ivec2 q = clamp(pixel + ivec2(dx, dy), ivec2(0), picture - 1);
      ivec2 cell = q / block;
      ivec2 stored = (q - block * cell) * tile_size + cell;
      vec4 key = texelFetch(keys, stored, 0), share = texelFetch(shares, stored, 0);
      vec3 there = eye + key.w * ray_through(vec2(q) + 0.5);
      bool near = key.w > 0.0 && dot(key.xyz, s.normal) > 0.9 &&
                  abs(dot(s.normal, there - s.position)) < 3.0 * pixel_size * s.z;
      all += share;
      same += near ? share : vec4(0.0);
    }
  vec4 sum = same.y + same.w > 0.0 ? same : all;
  return vec2(sum.y > 0.0 ? sum.x / sum.y : 1.0, sum.w > 0.0 ? sum.z / sum.w : 1.0);
}

// Returns the reflectance of a surface by Schlick (1994), between those at normal incidence and at grazing angles.
vec3 schlick(vec3 normal_incidence, vec3 grazing, float cosine) {
  float x = 1.0 - clamp(cosine, 0.0, 1.0), x2 = x * x;
  return normal_incidence + (grazing - normal_incidence) * (x2 * x2 * x);
}

// Returns the specular BRDF of Cook and Torrance (1982) with the GGX distribution (Walter et al. 2007) and the masking
// of Hammon (2017). The disc of a light widens the lobe by `widening` and dims it in proportion.
vec3 specular(vec3 n, vec3 v, vec3 l, float alpha, float widening, vec3 f0) {
  vec3 h = normalize(l + v);
  float nl = max(dot(n, l), 0.0), nv = max(dot(n, v), 1e-3), nh = clamp(dot(n, h), 0.0, 1.0);
  float wide = min(alpha + widening, 1.0), a2 = wide * wide;
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float distribution = a2 / (pi * d * d) * (alpha / wide) * (alpha / wide);
  float masking = 0.5 / mix(2.0 * nl * nv, nl + nv, alpha);
  return schlick(f0, vec3(1.0), dot(l, h)) * (distribution * masking);
}

vec3 shade(ivec2 pixel, Surface s, vec2 arriving) {
  Look look = looks[max(s.look, 0)];
  vec3 base = mix(look.color_metallic.rgb, look.color2_roughness.rgb, s.blend);
  float metallic = look.color_metallic.a, roughness = max(look.color2_roughness.a, 0.05);
  float alpha = roughness * roughness;
  vec3 n = s.normal, v = normalize(eye - s.position);
  float nv = dot(n, v);
  if (nv < 0.05) n = normalize(n + (0.05 - nv) * v);  // interpolated normals may face away at silhouettes
  nv = max(dot(n, v), 0.05);
  // Light that a dielectric mirrors does not get under its surface. A rough surface mirrors little, even at grazing
  // angles.
  vec3 glancing = vec3(1.0 - roughness), dielectric = vec3(0.04), f0 = mix(dielectric, base, metallic);
  vec3 mirror_share = schlick(f0, max(f0, glancing), nv);
  vec3 diffuse = (1.0 - schlick(dielectric, max(dielectric, glancing), nv)) * base * (1.0 - metallic) / pi;

  vec3 sum = vec3(0.0);
  for (int i = 0; i < light_count; ++i) {
    vec3 d = lights[i].place_radius.xyz - s.position;
    float range = length(d);
    vec3 l = d / range;
    float arrives = lights[i].color_shadow.w > 0.0 ? arriving.x : 1.0;
    vec3 irradiance = lights[i].color_shadow.rgb * (arrives * max(dot(n, l), 0.0) / (range * range));
    vec3 highlight = specular(n, v, l, alpha, 0.5 * lights[i].place_radius.w / range, f0);
    sum += irradiance * (diffuse + highlight);
  }

  vec3 below = has_ground == 1 ? ground_radiance(vec3(s.position.x, ground_height, s.position.z), 0.5)
                               : 0.5 * sky_intensity * horizon;
  vec3 ambient = arriving.y * (sky_irradiance(n) + pi * below * (0.5 - 0.5 * n.y));
  vec3 away = reflect(-v, n);
  vec3 mirror = reflected(s.position, away, roughness, metallic > 0.5 ? light_samples : 0);
  vec4 bodies = mirrored_bodies(s.mirror, s.position, away, alpha);
  mirror = mix(mirror, bodies.rgb, bodies.w);
  float open = mix(arriving.y, 1.0, 0.3);
  return sum + ambient * diffuse + mirror * mirror_share * open;
}

// Returns the color c for display: equal to c up to the knee, bent towards white above. The largest channel is bent and
// the others keep their proportion to it, so that bright orange stays orange; a color pales far beyond white only.
vec3 tone_curve(vec3 c) {
  const float knee = 0.72;
  float peak = max(c.r, max(c.g, c.b));
  if (peak <= knee) return c;
  float room = 1.0 - knee;
  float bent = 1.0 - room * room / (peak - knee + room);
  float pale = 1.0 - 1.0 / (1.0 + 0.12 * (peak - bent));
  return mix(c * (bent / peak), vec3(bent), pale);
}
)";

/// Main function of the shading pass: the colors of the pixels from their samples, lights, sky and fog.
inline constexpr const char* shading_main = R"(
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), corner = supersampling * pixel;
  int samples_per_pixel = supersampling * supersampling;
  Surface center = surface_at(corner + supersampling / 2);
  bool uniform_pixel = true;
  for (int i = 0; i < samples_per_pixel; ++i) {
    Surface s = surface_at(corner + ivec2(i % supersampling, i / supersampling));
    uniform_pixel = uniform_pixel && s.hit == center.hit && s.look == center.look &&
                    dot(s.normal, center.normal) > 0.97 && abs(s.blend - center.blend) < 0.02;
  }

  // The width of the pixel on the ground follows from the rays through its neighbors.
  vec3 ray = ray_through(vec2(pixel) + 0.5);
  float drop = ground_height - eye.y;
  vec2 here = ray.xz * (drop / min(ray.y, -1e-6));
  vec3 ray_right = ray + right * (2.0 / float(picture.x)), ray_up = ray + up * (2.0 / float(picture.y));
  vec2 width = max(abs(ray_right.xz * (drop / min(ray_right.y, -1e-6)) - here),
                   abs(ray_up.xz * (drop / min(ray_up.y, -1e-6)) - here));

  int count = uniform_pixel ? (center.hit ? 1 : 0) : samples_per_pixel;
  vec3 sum = vec3(0.0);
  for (int i = 0; i < count; ++i) {
    ivec2 place = uniform_pixel ? corner + supersampling / 2
                                : corner + ivec2(i % supersampling, i / supersampling);
    Surface s = surface_at(place);
    vec3 background = sky(target, normalize(s.position - eye));
    if (s.look == ground_look)
      s.blend = pattern_blend(ground_pattern, ground_pattern_origin + s.position.xz / ground_pattern_size,
                              width / ground_pattern_size);
    vec3 radiance = shade(pixel, s, visibility(pixel, s));
    if (s.look == ground_look) radiance = mix(radiance, sky(target, normalize(vec3(ray.x, 0.0, ray.z))), faded(s.z));
    radiance = s.hit ? radiance : background;
    radiance = mix(vec3(0.0), radiance, greaterThan(radiance, vec3(0.0)));  // NaN becomes 0
    sum += min(radiance, vec3(16.0));
  }
  sum = count == 0 ? sky(target, normalize(ray)) : sum / float(count);
  color = vec4(tone_curve(exposure * sum), 1.0);
}
)";

}  // namespace duet::render::shaders
