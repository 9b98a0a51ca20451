#include "render/mirrors.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "render/shaders.h"
#include "sim/base/assert.h"

namespace duet::render {
namespace {

constexpr int side = 128;  // texels
// Half the size of a view at distance 1: 1 for 90 degrees, and four texels more on either side, which blurred
// look-ups at the border need.
constexpr double half_width = 1 + 8.0 / side;
constexpr float nothing = 1e30f;  // m, stored distance where there is no body

Vec3 middle(const Box& bounds) { return 0.5 * (bounds.low + bounds.high); }

// Returns the six views along the axes. mirror_place() in shaders.cpp counts on their order: +x, -x, +y, -y,
// +z, -z.
std::array<View, 6> views_from(const Vec3& eye) {
  std::array<View, 6> views;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Index axis = static_cast<Eigen::Index>(i / 2);
    View& view = views[i];
    view.eye = eye;
    view.forward = (i % 2 == 0 ? 1.0 : -1.0) * Vec3::Unit(axis);
    view.up = axis == 1 ? Vec3::UnitZ() : Vec3::UnitY();
    view.right = view.forward.cross(view.up);
    view.half_width = view.half_height = half_width;
  }
  return views;
}

// Returns a rough upper bound of the solid angle that the bounds take in a view; 0: no part of them can be
// seen.
double apparent_size(const Box& bounds, const View& view) {
  const std::array<Vec3, 8> corners = bounds.corners();
  for (const Vec3& inward : view.inward_normals())
    if (std::all_of(corners.begin(), corners.end(),
                    [&](const Vec3& x) { return inward.dot(x - view.eye) < 0; }))
      return 0;
  const double extent = (bounds.high - bounds.low).squaredNorm();
  return extent / std::max((middle(bounds) - view.eye).squaredNorm(), 1e-6 * extent);
}

}  // namespace

Mirrors::Mirrors(const Gl& gl)
    : gl_(gl),
      colors_(gl, GL_TEXTURE_2D_ARRAY),
      distances_(gl, GL_TEXTURE_2D_ARRAY),
      depth_(gl, GL_TEXTURE_2D),
      target_(gl) {
  const auto allocate = [&](const Texture& texture, GLenum internal_format, GLenum format, GLenum filter) {
    texture.bind(0);
    gl_.TexImage3D(texture.target(), 0, static_cast<GLint>(internal_format), side, side,
                   6 * shaders::max_mirrors, 0, format, GL_FLOAT, nullptr);
    gl_.TexParameteri(texture.target(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
    gl_.TexParameteri(texture.target(), GL_TEXTURE_MAG_FILTER, filter == GL_NEAREST ? GL_NEAREST : GL_LINEAR);
    for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
      gl_.TexParameteri(texture.target(), axis, GL_CLAMP_TO_EDGE);
  };
  allocate(colors_, GL_RGBA16F, GL_RGBA, GL_LINEAR_MIPMAP_LINEAR);
  gl_.GenerateMipmap(colors_.target());
  allocate(distances_, GL_R32F, GL_RED, GL_NEAREST);
  depth_.allocate(side, side, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
}

void Mirrors::choose(const BodyMeshes& meshes, const std::vector<bool>& metallic, const View& view) {
  DUET_ASSERT(metallic.size() == static_cast<std::size_t>(meshes.count()));
  std::vector<std::pair<double, int>> seen;
  for (int body = 0; body < meshes.count(); ++body) {
    if (!metallic[static_cast<std::size_t>(body)]) continue;
    const double size = apparent_size(meshes.bounds(body), view);
    if (size > 0) seen.emplace_back(-size, body);
  }
  std::sort(seen.begin(), seen.end());
  seen.resize(std::min<std::size_t>(seen.size(), shaders::max_mirrors));
  bodies_.clear();
  centers_.clear();
  for (const auto& [size, body] : seen) {
    bodies_.push_back(body);
    centers_.push_back(middle(meshes.bounds(body)));
  }
}

int Mirrors::mirror_of(int body) const {
  const auto place = std::find(bodies_.begin(), bodies_.end(), body);
  return place == bodies_.end() ? -1 : static_cast<int>(place - bodies_.begin());
}

void Mirrors::draw(const BodyMeshes& meshes, const Program& program,
                   const std::function<void(int)>& prepare) {
  if (bodies_.empty()) return;
  gl_.Viewport(0, 0, side, side);
  gl_.Enable(GL_DEPTH_TEST);
  target_.bind();
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const std::array<View, 6> views = views_from(centers_[i]);
    for (std::size_t face = 0; face < views.size(); ++face)
      draw_view(static_cast<int>(6 * i + face), views[face], bodies_[i], meshes, program, prepare);
  }
  gl_.Disable(GL_DEPTH_TEST);
  colors_.bind(0);
  gl_.GenerateMipmap(colors_.target());
}

void Mirrors::draw_view(int layer, const View& view, int mirror, const BodyMeshes& meshes,
                        const Program& program, const std::function<void(int)>& prepare) {
  target_.attach_layers(std::array<const Texture*, 2>{&colors_, &distances_}, layer, depth_);
  const std::array<float, 4> empty = {0, 0, 0, 0}, far_away = {nothing, 0, 0, 0};
  const float farthest = 1;
  gl_.ClearBufferfv(GL_COLOR, 0, empty.data());
  gl_.ClearBufferfv(GL_COLOR, 1, far_away.data());
  gl_.ClearBufferfv(GL_DEPTH, 0, &farthest);

  const Box& own = meshes.bounds(mirror);
  const double size = (own.high - own.low).norm();
  program.set("projection", view.projection(0.02 * size, 1000 * size));
  program.set("eye", view.eye);
  for (int body = 0; body < meshes.count(); ++body) {
    if (body == mirror || apparent_size(meshes.bounds(body), view) <= 0) continue;
    prepare(body);
    meshes.draw_shaded(body);
  }
}

void Mirrors::bind(const Program& program, int first_unit) const {
  colors_.bind(first_unit);
  distances_.bind(first_unit + 1);
  program.set("mirror_colors", first_unit);
  program.set("mirror_distances", first_unit + 1);
  program.set("mirror_half_width", static_cast<float>(half_width));
  program.set("mirror_side", static_cast<float>(side));
  for (std::size_t i = 0; i < centers_.size(); ++i)
    program.set(fmt::format("mirror_centers[{}]", i).c_str(), centers_[i]);
}

}  // namespace duet::render
