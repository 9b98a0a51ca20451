#include "render/scene_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "render/color.h"
#include "render/shaders.h"
#include "sim/base/error.h"

namespace duet::render {
namespace {

using shaders::Block;
// Not an Eigen type: the alignment of those depends on the instruction set.
using Float4 = std::array<float, 4>;

constexpr int shadow_map_side = 512;  // texels, 1 MiB a map; coarse ones suffice, because many are averaged
// Distance at which the ground fades out, over the distance from eye to target. A larger one shows more of
// the ground's horizon.
constexpr double fade_in_views = 8;
constexpr double faint_pattern = 0.94;  // second color of a ground without a pattern, over the first color

// The uniform blocks as the shaders declare them (std140).
struct LookEntry {
  Float4 color_metallic, color2_roughness;
};
struct LightEntry {
  Float4 place_radius, color_shadow;
};
struct SampleEntry {
  std::array<float, 16> to_map;  // by columns
  Float4 place, weight;
};
static_assert(sizeof(LookEntry) == 32 && sizeof(LightEntry) == 32 && sizeof(SampleEntry) == 96);

// Number of a binding point.
GLuint binding(Block block) { return static_cast<GLuint>(block); }

Float4 join(const Vec3& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
          static_cast<float>(w)};
}

std::array<float, 16> by_columns(const Mat4& m) {
  std::array<float, 16> numbers;
  Eigen::Map<Eigen::Matrix4f>(numbers.data()) = m.cast<float>();
  return numbers;
}

// Number of a pattern in the shaders; 0: none.
int pattern_number(const std::string& pattern) {
  return pattern == "checker"       ? 1
         : pattern == "stripes"     ? 2
         : pattern == value_pattern ? shaders::value_pattern
                                    : 0;
}

// Gives a ground without a pattern a faint checker: without one, the motion of a sliding body cannot be seen.
LookTable with_readable_ground(LookTable table) {
  scene::Look& ground = table.looks[LookTable::ground];
  if (ground.pattern.empty()) {
    ground.pattern = "checker";
    ground.color2 = faint_pattern * ground.color;
    ground.pattern_size = 2;
  }
  return table;
}

// Throws Error (usage) if the scene asks for more than OpenGL or the shaders hold.
void check_bounds(const Gl& gl, const scene::Scene& scene) {
  const scene::Render& r = scene.render;
  GLint largest = 0;
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  const auto require = [&](bool good, const std::string& what) {
    if (!good) throw Error(ExitStatus::usage, fmt::format("{}: {}", scene.path, what));
  };
  require(r.width > 0 && r.height > 0 && r.supersampling > 0,
          "render.width, render.height and render.supersampling must be positive");
  require(std::max(r.width, r.height) <= largest / r.supersampling,
          fmt::format("a picture of {} x {} pixels with {} samples along each axis is more than OpenGL's {} "
                      "(lower render.supersampling or the size)",
                      r.width, r.height, r.supersampling, largest));
  require(r.shadow_samples >= 0 && r.shadow_samples <= shaders::max_shadow_samples,
          fmt::format("render.shadow_samples must be 0 to {}", shaders::max_shadow_samples));
  require(scene.lights.size() <= static_cast<std::size_t>(shaders::max_lights),
          fmt::format("{} lights are more than the renderer holds ({})", scene.lights.size(),
                      shaders::max_lights));
}

// Returns the scene after check_bounds(), for the list of initializers.
const scene::Scene& checked(const Gl& gl, const scene::Scene& scene) {
  check_bounds(gl, scene);
  return scene;
}

// Number of blocks along `pixels` pixels, rounded up.
int ninth(int pixels) { return (pixels + shaders::block - 1) / shaders::block; }

}  // namespace

SceneRenderer::SceneRenderer(const Gl& gl, const scene::Scene& scene, const LookTable& looks)
    : gl_(gl),
      scene_(checked(gl, scene)),
      looks_(with_readable_ground(looks)),
      camera_path_(scene.camera),
      camera_(camera_path_.at(0)),
      view_(make_view(camera_, scene.render.width, scene.render.height)),
      samples_(make_shadow_samples(scene)),
      tile_width_(ninth(scene.render.width)),
      tile_height_(ninth(scene.render.height)),
      shadow_program_(gl, "shadow", shaders::shadow_vertex(), shaders::shadow_fragment()),
      geometry_program_(gl, "geometry", shaders::geometry_vertex(), shaders::geometry_fragment()),
      mirror_program_(gl, "mirror", shaders::geometry_vertex(), shaders::mirror_fragment()),
      visibility_program_(gl, "visibility", shaders::screen_vertex(), shaders::visibility_fragment()),
      shading_program_(gl, "shading", shaders::screen_vertex(), shaders::shading_fragment()),
      shadow_maps_(gl, GL_TEXTURE_2D_ARRAY),
      surfaces_(gl, GL_TEXTURE_2D),
      depths_(gl, GL_TEXTURE_2D),
      shares_(gl, GL_TEXTURE_2D),
      keys_(gl, GL_TEXTURE_2D),
      picture_(gl, GL_TEXTURE_2D),
      shadow_target_(gl),
      geometry_target_(gl),
      visibility_target_(gl),
      picture_target_(gl),
      look_block_(gl),
      light_block_(gl),
      sample_block_(gl),
      nothing_(gl),
      meshes_(gl),
      mirrors_(gl) {
  allocate_targets();
  fill_looks();
}

void SceneRenderer::allocate_targets() {
  const int width = scene_.render.width, height = scene_.render.height, k = scene_.render.supersampling;
  shadow_maps_.bind(0);
  const int maps = std::max<int>(1, static_cast<int>(samples_.samples.size()));
  gl_.TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, shadow_map_side, shadow_map_side, maps, 0,
                 GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  // Depth 1: everything beyond the border of a map is lit.
  const std::array<float, 4> outside = {1, 1, 1, 1};
  gl_.TexParameterfv(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BORDER_COLOR, outside.data());
  for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    gl_.TexParameteri(GL_TEXTURE_2D_ARRAY, axis, GL_CLAMP_TO_BORDER);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl_.TexParameteri(GL_TEXTURE_2D_ARRAY, filter, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl_.TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);

  surfaces_.allocate(k * width, k * height, GL_RGBA16, GL_RGBA, GL_UNSIGNED_SHORT);
  depths_.allocate(k * width, k * height, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
  shares_.allocate(shaders::block * tile_width_, shaders::block * tile_height_, GL_RGBA16F, GL_RGBA,
                   GL_FLOAT);
  keys_.allocate(shaders::block * tile_width_, shaders::block * tile_height_, GL_RGBA32F, GL_RGBA, GL_FLOAT);
  picture_.allocate(width, height, GL_RGBA16, GL_RGBA, GL_UNSIGNED_SHORT);

  geometry_target_.attach(std::array<const Texture*, 1>{&surfaces_}, &depths_);
  visibility_target_.attach(std::array<const Texture*, 2>{&shares_, &keys_}, nullptr);
  picture_target_.attach(std::array<const Texture*, 1>{&picture_}, nullptr);
  shadow_target_.bind();
  gl_.DrawBuffer(GL_NONE);
  gl_.ReadBuffer(GL_NONE);
  pixels_.resize(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

void SceneRenderer::fill_looks() {
  std::vector<LookEntry> looks(static_cast<std::size_t>(max_looks));
  for (std::size_t i = 0; i < looks_.looks.size(); ++i) {
    const scene::Look& look = looks_.looks[i];
    looks[i] = {join(look.color, look.metallic),
                join(look.pattern.empty() && look.spots.empty() ? look.color : look.color2, look.roughness)};
  }
  look_block_.fill(GL_UNIFORM_BUFFER, std::span<const LookEntry>(looks));

  gl_.BindBufferBase(GL_UNIFORM_BUFFER, binding(Block::looks), look_block_.id());
  gl_.BindBufferBase(GL_UNIFORM_BUFFER, binding(Block::lights), light_block_.id());
  gl_.BindBufferBase(GL_UNIFORM_BUFFER, binding(Block::shadow_samples), sample_block_.id());
  for (const Program* program : {&mirror_program_, &visibility_program_, &shading_program_}) {
    program->bind_block("Looks", binding(Block::looks));
    program->bind_block("Lights", binding(Block::lights));
    program->bind_block("ShadowSamples", binding(Block::shadow_samples));
  }
}

void SceneRenderer::take_view(double time) {
  camera_ = camera_path_.at(time);
  view_ = make_view(camera_, scene_.render.width, scene_.render.height);
  origin_ = view_.eye;
  camera_.position.setZero();
  camera_.target -= origin_;
  view_.eye.setZero();
  samples_ = make_shadow_samples(scene_);
  for (ShadowSample& sample : samples_.samples)
    if (!sample.is_sky) sample.place -= origin_;
  fill_lights();
}

void SceneRenderer::fill_lights() {
  std::vector<LightEntry> lights(static_cast<std::size_t>(shaders::max_lights));
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    const scene::Light& light = scene_.lights[i];
    const bool area = light.kind == scene::LightKind::area;
    lights[i] = {join(light.position - origin_, area ? light.radius : 0),
                 join(light.color * light.power / (4 * std::numbers::pi), area && light.shadow ? 1 : 0)};
  }
  light_block_.fill(GL_UNIFORM_BUFFER, std::span<const LightEntry>(lights));
}

std::vector<unsigned char> SceneRenderer::draw(const std::vector<BodySurface>& bodies,
                                               const std::vector<int>& looks_of_bodies, double time) {
  take_view(time);
  meshes_.upload(bodies, origin_);
  const Vec2 range = depth_range();
  draw_shadow_maps();
  draw_mirrors(looks_of_bodies);
  draw_geometry(looks_of_bodies, range);
  draw_visibility(range);
  draw_shading(range);
  return read_picture();
}

// The near distance is clamped to [1e-3, 0.5] times the far one, so that the depth buffer keeps its
// resolution when a body reaches the eye.
Vec2 SceneRenderer::depth_range() const {
  double near = 1e30, far = 0;
  for (int body = 0; body < meshes_.count(); ++body)
    for (const Vec3& corner : meshes_.bounds(body).corners()) {
      const double z = view_.to_view(corner).z();
      near = std::min(near, z);
      far = std::max(far, z);
    }
  far = far > 0 ? 1.01 * far : 1;
  return {std::clamp(0.99 * near, 1e-3 * far, 0.5 * far), far};
}

void SceneRenderer::draw_shadow_maps() {
  std::vector<Box> bounds;
  Box all;
  for (int body = 0; body < meshes_.count(); ++body) {
    bounds.push_back(meshes_.bounds(body));
    all.low = body == 0 ? bounds.back().low : Vec3(all.low.cwiseMin(bounds.back().low));
    all.high = body == 0 ? bounds.back().high : Vec3(all.high.cwiseMax(bounds.back().high));
  }
  const double reach = 2 * (all.high - all.low).norm() + (view_.eye - 0.5 * (all.low + all.high)).norm();
  const std::optional<double> ground = scene_.ground ? std::optional(ground_height()) : std::nullopt;

  shadow_target_.bind();
  gl_.Viewport(0, 0, shadow_map_side, shadow_map_side);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.Enable(GL_CULL_FACE);
  // Maps hold the far sides of bodies: those lie behind the surfaces that are lit, which therefore never
  // shadow themselves.
  gl_.CullFace(GL_FRONT);
  shadow_program_.use();
  std::vector<SampleEntry> entries(static_cast<std::size_t>(shaders::max_shadow_samples));
  for (std::size_t i = 0; i < samples_.samples.size(); ++i) {
    const ShadowSample& sample = samples_.samples[i];
    gl_.FramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, shadow_maps_.id(), 0,
                                static_cast<GLint>(i));
    gl_.Clear(GL_DEPTH_BUFFER_BIT);
    std::vector<int> bodies;
    std::vector<Box> casters;
    for (int body = 0; body < meshes_.count(); ++body) {
      const Box& b = bounds[static_cast<std::size_t>(body)];
      if (!shadow_is_seen(sample, b, view_, reach, ground)) continue;
      bodies.push_back(body);
      casters.push_back(b);
    }
    // Without casters to_map stays zero, and the shaders take every point for lit.
    ShadowFrustum frustum;
    if (!casters.empty()) frustum = fit_shadow_frustum(sample, casters, shadow_map_side);
    entries[i] = {by_columns(frustum.to_map),
                  join(sample.place, sample.is_sky ? 0 : 1),
                  {static_cast<float>(sample.weight), static_cast<float>(frustum.texel), 0, 0}};
    shadow_program_.set("to_map", frustum.to_map);
    for (const int body : bodies) meshes_.draw_shape(body);
  }
  gl_.Disable(GL_CULL_FACE);
  sample_block_.fill(GL_UNIFORM_BUFFER, std::span<const SampleEntry>(entries));
}

void SceneRenderer::draw_geometry(const std::vector<int>& looks_of_bodies, const Vec2& range) {
  geometry_target_.bind();
  gl_.Viewport(0, 0, scene_.render.supersampling * scene_.render.width,
               scene_.render.supersampling * scene_.render.height);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.ClearColor(0, 0, 0, 0);
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  geometry_program_.use();
  geometry_program_.set("supersampling", scene_.render.supersampling);
  geometry_program_.set("value_range", static_cast<float>(scene_.render.range_of_color()));
  geometry_program_.set("projection", view_.projection(range.x(), range.y()));
  for (int body = 0; body < meshes_.count(); ++body) {
    const int place = looks_of_bodies[static_cast<std::size_t>(body)];
    const scene::Look& look = looks_.looks[static_cast<std::size_t>(place)];
    const Vec2 scale = meshes_.texture_scale(body);
    // Rounds to whole periods of two bands, so that the pattern closes where the texture coordinates do.
    const auto bands = [&](double meters) {
      return static_cast<float>(2 * std::max(1.0, std::round(meters / (2 * look.pattern_size))));
    };
    geometry_program_.set("look", place);
    geometry_program_.set("mirror", mirrors_.mirror_of(body));
    geometry_program_.set("pattern", pattern_number(look.pattern));
    geometry_program_.set("opacity", static_cast<float>(look.opacity));
    geometry_program_.set("repeats", bands(scale.x()), bands(scale.y()));
    geometry_program_.set("spot_count", static_cast<int>(look.spots.size()));
    for (std::size_t i = 0; i < look.spots.size(); ++i)
      geometry_program_.set(fmt::format("spots[{}]", i).c_str(), look.spots[i]);
    meshes_.draw_shaded(body);
  }
  gl_.Disable(GL_DEPTH_TEST);
}

void SceneRenderer::set_view(const Program& program, const Vec2& range) const {
  program.use();
  program.set("surfaces", 0);
  program.set("depths", 1);
  surfaces_.bind(0);
  depths_.bind(1);
  program.set("eye", view_.eye);
  program.set("forward", view_.forward);
  program.set("right", Vec3(view_.half_width * view_.right));
  program.set("up", Vec3(view_.half_height * view_.up));
  program.set("depth_range", static_cast<float>(range.x()), static_cast<float>(range.y()));
  program.set("picture", scene_.render.width, scene_.render.height);
  program.set("supersampling", scene_.render.supersampling);
  set_environment(program);
  nothing_.bind();
}

// Uniforms that a program lacks are ignored.
void SceneRenderer::set_environment(const Program& program) const {
  program.set("shadow_maps", 2);
  shadow_maps_.bind(2);
  program.set("has_ground", scene_.ground ? 1 : 0);
  program.set("ground_height", static_cast<float>(ground_height()));
  program.set("light_samples", samples_.lights);
  program.set("light_count", static_cast<int>(scene_.lights.size()));
  program.set("target", camera_.target);
  program.set("zenith", scene_.sky.zenith);
  program.set("horizon", scene_.sky.horizon);
  program.set("sky_intensity", static_cast<float>(scene_.sky.intensity));
  program.set("fade_distance", static_cast<float>(fade_in_views * camera_.target.norm()));
}

void SceneRenderer::draw_mirrors(const std::vector<int>& looks_of_bodies) {
  std::vector<bool> metallic;
  metallic.reserve(looks_of_bodies.size());
  for (const int place : looks_of_bodies)
    metallic.push_back(looks_.looks[static_cast<std::size_t>(place)].metallic > 0.5);
  mirrors_.choose(meshes_, metallic, view_);
  mirror_program_.use();
  set_environment(mirror_program_);
  mirrors_.draw(meshes_, mirror_program_, [&](int body) {
    mirror_program_.set("look", looks_of_bodies[static_cast<std::size_t>(body)]);
  });
}

void SceneRenderer::draw_visibility(const Vec2& range) {
  visibility_target_.bind();
  set_view(visibility_program_, range);
  const int all = static_cast<int>(samples_.samples.size()), block = shaders::block;
  visibility_program_.set("all_samples", all);
  for (int i = 0; i < block * block; ++i) {
    const int x = i % block, y = i / block;
    gl_.Viewport(x * tile_width_, y * tile_height_, tile_width_, tile_height_);
    visibility_program_.set("tile", x * tile_width_, y * tile_height_);
    visibility_program_.set("phase", x, y);
    visibility_program_.set("first_sample", i);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  }
}

void SceneRenderer::draw_shading(const Vec2& range) {
  picture_target_.bind();
  gl_.Viewport(0, 0, scene_.render.width, scene_.render.height);
  set_view(shading_program_, range);
  const scene::Look& ground = looks_.looks[LookTable::ground];
  const Program& p = shading_program_;
  p.set("shares", 3);
  p.set("keys", 4);
  shares_.bind(3);
  keys_.bind(4);
  mirrors_.bind(p, 5);
  p.set("tile_size", tile_width_, tile_height_);
  p.set("ground_pattern", pattern_number(ground.pattern));
  p.set("ground_pattern_size", static_cast<float>(ground.pattern_size));
  const auto phase = [&](double x) { return static_cast<float>(std::fmod(x / ground.pattern_size, 2.0)); };
  p.set("ground_pattern_origin", phase(origin_.x()), phase(origin_.z()));
  p.set("exposure", static_cast<float>(scene_.render.exposure));
  p.set("pixel_size", static_cast<float>(2 * view_.half_height / scene_.render.height));
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

std::vector<unsigned char> SceneRenderer::read_picture() {
  const int width = scene_.render.width, height = scene_.render.height;
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_SHORT, pixels_.data());
  if (const GLenum error = gl_.GetError(); error != GL_NO_ERROR)
    throw Error(ExitStatus::files,
                fmt::format("OpenGL reports the error {:#06x} while drawing (out of memory? lower "
                            "render.supersampling or the picture's size)",
                            error));
  return encode_picture(pixels_, width, height);
}

}  // namespace duet::render
