// The programs of the graphics processor. Light, sky and tone curve are those of Duet's pictures (render/shaders.cpp),
// with one map of shadows in place of many, and without mirror images.

const mostLights = 8, mostSpots = 16;

const lightSource = `
uniform vec3 eye;
uniform int lightCount;
uniform vec4 lightPlace[${mostLights}];  // w: radius
uniform vec4 lightColor[${mostLights}];  // irradiance at 1 m; w: 1 for the one that casts shadows
uniform vec3 zenith, horizon, groundColor;
uniform float skyIntensity, exposure, groundHeight, shadowTexel;
uniform bool hasGround, hasShadow;
uniform mat4 toShadow;
uniform highp sampler2DShadow shadowMap;
const float pi = 3.14159265;

vec3 sky(vec3 d) {
  float x = 1.0 - clamp(d.y, 0.0, 1.0), x2 = x * x;
  return mix(zenith, horizon, x2 * x2);
}
vec3 skyIrradiance(vec3 n) {
  return pi * skyIntensity * (0.5 + 0.5 * n.y) * mix(horizon, zenith, mix(0.76, 0.93, max(n.y, 0.0)));
}
// The fraction of the light that arrives at x: 9 comparisons, each of which weighs 4 texels.
float arriving(vec3 x, vec3 n) {
  if (!hasShadow) return 1.0;
  vec4 m = toShadow * vec4(x, 1.0);
  m = toShadow * vec4(x + n * (1.5 * shadowTexel * m.w), 1.0);
  vec3 place = 0.5 + 0.5 * m.xyz / m.w;
  if (m.w <= 0.0 || any(lessThan(place, vec3(0.0))) || any(greaterThan(place, vec3(1.0)))) return 1.0;
  vec2 texel = 1.5 / vec2(textureSize(shadowMap, 0));
  float sum = 0.0;
  for (int i = -1; i <= 1; ++i)
    for (int k = -1; k <= 1; ++k) sum += texture(shadowMap, vec3(place.xy + vec2(i, k) * texel, place.z));
  return sum / 9.0;
}
vec3 toneCurve(vec3 c) {
  const float knee = 0.72;
  float peak = max(c.r, max(c.g, c.b));
  if (peak <= knee) return c;
  float room = 1.0 - knee, bent = 1.0 - room * room / (peak - knee + room);
  float pale = 1.0 - 1.0 / (1.0 + 0.12 * (peak - bent));
  return mix(c * (bent / peak), vec3(bent), pale);
}
// Linear light as sRGB.
vec3 shown(vec3 radiance) {
  vec3 c = toneCurve(exposure * max(radiance, vec3(0.0)));
  return mix(12.92 * c, 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}
vec3 schlick(vec3 f0, float cosine) {
  float x = 1.0 - clamp(cosine, 0.0, 1.0), x2 = x * x;
  return f0 + (1.0 - f0) * (x2 * x2 * x);
}
// Light that comes from below x: half of the lights' arrives at the ground there.
vec3 groundRadiance(vec3 x) {
  if (!hasGround) return 0.5 * skyIntensity * horizon;
  vec3 irradiance = skyIrradiance(vec3(0.0, 1.0, 0.0));
  for (int i = 0; i < lightCount; ++i) {
    vec3 d = lightPlace[i].xyz - vec3(x.x, groundHeight, x.z);
    float squared = dot(d, d);
    irradiance += 0.5 * lightColor[i].rgb * max(d.y, 0.0) / (squared * sqrt(squared));
  }
  return groundColor * irradiance / pi;
}
// Radiance of a surface toward the eye: Lambert, Cook-Torrance with the GGX distribution, sky, and light from below.
vec3 shade(vec3 x, vec3 n, vec3 base, float metallic, float roughness) {
  vec3 v = normalize(eye - x), f0 = mix(vec3(0.04), base, metallic);
  float alpha = max(roughness, 0.05) * max(roughness, 0.05), nv = max(dot(n, v), 0.05);
  vec3 diffuse = base * (1.0 - metallic) / pi, sum = vec3(0.0);
  for (int i = 0; i < lightCount; ++i) {
    vec3 d = lightPlace[i].xyz - x;
    float range = length(d), nl = max(dot(n, d) / range, 0.0);
    if (nl <= 0.0) continue;
    vec3 h = normalize(d / range + v);
    float wide = min(alpha + 0.5 * lightPlace[i].w / range, 1.0), a2 = wide * wide, nh = max(dot(n, h), 0.0);
    float below = nh * nh * (a2 - 1.0) + 1.0;
    float lobe = a2 / (pi * below * below) * (alpha / wide) * (alpha / wide) * 0.5 / mix(2.0 * nl * nv, nl + nv, alpha);
    float part = lightColor[i].w > 0.5 ? arriving(x, n) : 1.0;
    sum += lightColor[i].rgb * (part * nl / (range * range)) * (diffuse + schlick(f0, dot(v, h)) * lobe);
  }
  vec3 below = groundRadiance(x);
  vec3 mirror = reflect(-v, n);
  vec3 seen = mix(below, sky(mirror), smoothstep(-0.3, 0.3, mirror.y));
  return sum + diffuse * (skyIrradiance(n) + pi * below * (0.5 - 0.5 * n.y)) +
    seen * (f0 + (max(f0, vec3(1.0 - roughness)) - f0) * pow(1.0 - nv, 5.0));  // rough ones mirror little, also grazing
}
// A wave of period 2 that is +1 on (0, 1) and -1 on (1, 2), averaged over the width.
float squareWave(float x, float width) {
  return (abs(mod(x - 0.5 * width, 2.0) - 1.0) - abs(mod(x + 0.5 * width, 2.0) - 1.0)) / width;
}
// The fraction of the second color; pattern 1: checker, 2: stripes across x.
float patternBlend(int pattern, vec2 x, vec2 width) {
  if (pattern == 0) return 0.0;
  width = max(width, vec2(1e-4));
  float along = squareWave(x.x, width.x);
  return 0.5 - 0.5 * (pattern == 1 ? along * squareWave(x.y, width.y) : along);
}
`;

const bodyVertex = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in float scalar;
uniform mat4 projection;
uniform mat3 turn;
uniform vec3 place, velocity, spin;
out vec3 worldPosition, worldNormal;
out vec2 texturePlace;
out float share, speed;
void main() {
  vec3 arm = turn * position;
  worldPosition = arm + place;
  worldNormal = turn * normal;
  texturePlace = uv;
  share = scalar;
  speed = length(velocity + cross(spin, arm));
  gl_Position = projection * vec4(worldPosition, 1.0);
}
`;

// The colors of numbers in linear light: the same as colorOf of panels.js, which draws the legend.
const bodyFragment = `#version 300 es
precision highp float;
${lightSource}
uniform vec3 color, color2;
uniform float metallic, roughness, opacity, picked;
uniform int pattern, mode, spotCount;
uniform vec2 repeats;
uniform vec3 spots[${mostSpots}];
uniform float largest, top;  // of the bytes, and of the scale
in vec3 worldPosition, worldNormal;
in vec2 texturePlace;
in float share, speed;
out vec4 result;

vec3 scale(float t) {
  vec3 low = vec3(0.02, 0.10, 0.42), middle = vec3(0.03, 0.36, 0.28), high = vec3(1.0, 0.72, 0.05);
  return t < 0.5 ? mix(low, middle, 2.0 * t) : mix(middle, high, 2.0 * t - 1.0);
}
vec3 baseColor() {
  const vec3 plain = vec3(0.42);
  if (mode == 1) return share > 0.998 ? vec3(0.9, 0.0, 0.01) : scale(clamp(share * share * 1.00788 * largest / top, 0.0, 1.0));
  if (mode == 2) return scale(clamp(share * share * largest / top, 0.0, 1.0));
  if (mode == 3) return scale(clamp(speed / top, 0.0, 1.0));
  if (mode == 4) return mix(plain, vec3(0.9, 0.16, 0.02), smoothstep(0.0, 0.6, share));
  if (mode == 5) return plain;
  vec2 x = texturePlace * repeats;
  float blend = patternBlend(pattern, x, fwidth(x));
  vec2 jump = vec2(length(dFdx(texturePlace)), length(dFdy(texturePlace)));
  vec2 width = vec2(length(dFdx(worldPosition)), length(dFdy(worldPosition)));
  int count = length(jump) < 4.0 * length(width) ? spotCount : 0;
  for (int i = 0; i < count; ++i) {
    float inside = spots[i].z - distance(texturePlace, spots[i].xy);
    blend = max(blend, clamp(0.5 + inside / max(fwidth(inside), 1e-6), 0.0, 1.0));
  }
  return mix(color, color2, blend);
}
void main() {
  vec3 n = dot(worldNormal, worldNormal) > 0.0 ? normalize(worldNormal) : vec3(0.0, 1.0, 0.0);
  if (!gl_FrontFacing) n = -n;
  vec3 radiance = shade(worldPosition, n, baseColor(), mode == 0 ? metallic : 0.0, mode == 0 ? roughness : 0.8);
  float rim = 1.0 - abs(dot(n, normalize(eye - worldPosition)));
  radiance = mix(radiance, vec3(1.0, 0.45, 0.05) / exposure, picked * (0.15 + 0.45 * smoothstep(0.55, 0.95, rim)));
  result = vec4(shown(radiance), opacity);
}
`;

const lineFragment = `#version 300 es
precision highp float;
uniform vec4 lineColor;
out vec4 result;
void main() { result = lineColor; }
`;

const depthFragment = `#version 300 es
precision highp float;
void main() {}
`;

const groundVertex = `#version 300 es
uniform mat4 projection;
uniform vec3 middle;
uniform float reach;
out vec3 worldPosition;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  worldPosition = middle + vec3(corner.x, 0.0, -corner.y) * reach;
  gl_Position = projection * vec4(worldPosition, 1.0);
}
`;

const groundFragment = `#version 300 es
precision highp float;
${lightSource}
uniform vec3 color, color2;
uniform float roughness, patternSize, fade;
uniform int pattern;
uniform vec2 patternOrigin;
in vec3 worldPosition;
out vec4 result;
void main() {
  vec2 x = patternOrigin + worldPosition.xz / patternSize;
  vec3 base = mix(color, color2, patternBlend(pattern, x, fwidth(x)));
  vec3 radiance = shade(worldPosition, vec3(0.0, 1.0, 0.0), base, 0.0, roughness);
  vec3 away = worldPosition - eye;
  float far = length(away) / fade;
  radiance = mix(radiance, sky(normalize(vec3(away.x, 0.0, away.z))), 1.0 - exp(-far * far));
  result = vec4(shown(radiance), 1.0);
}
`;

const skyVertex = `#version 300 es
uniform vec3 forward, right, up;  // right and up reach to the picture's border
out vec3 direction;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  direction = forward + corner.x * right + corner.y * up;
  gl_Position = vec4(corner, 1.0, 1.0);
}
`;

const skyFragment = `#version 300 es
precision highp float;
${lightSource}
in vec3 direction;
out vec4 result;
void main() { result = vec4(shown(sky(normalize(direction))), 1.0); }
`;
