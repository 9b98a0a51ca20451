#include "render/body_meshes.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "sim/base/assert.h"
#include "sim/base/index.h"

namespace duet::render {
namespace {

// A vertex of draw_shaded(): one corner of one triangle.
struct ShadedCorner {
  Vec3f position, normal;
  Vec2f uv;
  // `value`: Surface::shown or Surface::strain. `inverted`: 1 at all corners of a triangle that touches an
  // inverted element, which has a negative strain, else 0.
  float value, inverted;
};
static_assert(sizeof(ShadedCorner) == 10 * sizeof(float));

// The box around the positions; an empty one at the origin without positions.
Box bounds_of(const std::vector<Vec3f>& positions) {
  if (positions.empty()) return {};
  Vec3f low = positions.front(), high = low;
  for (const Vec3f& x : positions) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return {low.cast<double>(), high.cast<double>()};
}

// Returns the mean over the area of |dx/du| and |dx/dv|, the lengths on the surface (m) that one unit of the
// texture coordinates takes. Triangles whose texture coordinates are degenerate (|det| < 1e-12) do not count.
// Without any other triangle both are 1.
Vec2 texture_scale_of(const Surface& surface) {
  Vec2 sum = Vec2::Zero();
  double area = 0;
  for (const auto& t : surface.triangles) {
    Eigen::Matrix<double, 3, 2> edges;
    Eigen::Matrix2d uv_edges;
    for (int k = 0; k < 2; ++k) {
      edges.col(k) = surface.positions[as_index(t[as_index(k + 1)].position)] -
                     surface.positions[as_index(t[0].position)];
      uv_edges.col(k) =
          (surface.uvs[as_index(t[as_index(k + 1)].uv)] - surface.uvs[as_index(t[0].uv)]).cast<double>();
    }
    if (std::abs(uv_edges.determinant()) < 1e-12) continue;
    const double a = edges.col(0).cross(edges.col(1)).norm();
    const Eigen::Matrix<double, 3, 2> derivative = edges * uv_edges.inverse();
    sum += a * derivative.colwise().norm().transpose();
    area += a;
  }
  return area > 0 ? Vec2(sum / area) : Vec2(Vec2::Ones());
}

}  // namespace

BodyMeshes::BodyMeshes(const Gl& gl)
    : gl_(gl), corners_(gl), positions_(gl), indices_(gl), shaded_(gl), shape_(gl) {
  shaded_.attribute(corners_, 0, 3, sizeof(ShadedCorner), offsetof(ShadedCorner, position));
  shaded_.attribute(corners_, 1, 3, sizeof(ShadedCorner), offsetof(ShadedCorner, normal));
  shaded_.attribute(corners_, 2, 2, sizeof(ShadedCorner), offsetof(ShadedCorner, uv));
  shaded_.attribute(corners_, 3, 2, sizeof(ShadedCorner), offsetof(ShadedCorner, value));
  shape_.attribute(positions_, 0, 3, sizeof(Vec3f), 0);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.id());
}

void BodyMeshes::upload(const std::vector<BodySurface>& bodies, const Vec3& origin) {
  std::vector<ShadedCorner> corners;
  std::vector<Vec3f> positions, place;
  std::vector<std::uint32_t> indices;
  ranges_.clear();
  for (const BodySurface& body : bodies) {
    const Surface& surface = body.surface;
    const std::vector<float>& values = surface.shown.empty() ? surface.strain : surface.shown;
    DUET_ASSERT(values.empty() || values.size() == surface.positions.size());
    Range range;
    range.first_corner = static_cast<int>(corners.size());
    range.corners = 3 * static_cast<int>(surface.triangles.size());
    place.clear();
    for (const Vec3& x : surface.positions) place.push_back((x - origin).cast<float>());
    range.bounds = bounds_of(place);
    auto scale = texture_scales_.find(body.name);
    if (scale == texture_scales_.end())
      scale = texture_scales_.emplace(body.name, texture_scale_of(surface)).first;
    range.texture_scale = scale->second;
    ranges_.push_back(range);

    const std::uint32_t base = static_cast<std::uint32_t>(positions.size());
    const auto value = [&](const Corner& c) { return values.empty() ? 0.0F : values[as_index(c.position)]; };
    for (const auto& triangle : surface.triangles) {
      const bool inverted =
          std::any_of(triangle.begin(), triangle.end(), [&](const Corner& c) { return value(c) < 0; });
      for (const Corner& c : triangle) {
        corners.push_back({place[as_index(c.position)], surface.normals[as_index(c.normal)],
                           surface.uvs[as_index(c.uv)], value(c), inverted ? 1.0F : 0.0F});
        indices.push_back(base + static_cast<std::uint32_t>(c.position));
      }
    }
    positions.insert(positions.end(), place.begin(), place.end());
  }
  corners_.fill(GL_ARRAY_BUFFER, std::span<const ShadedCorner>(corners));
  positions_.fill(GL_ARRAY_BUFFER, std::span<const Vec3f>(positions));
  shape_.bind();  // the binding of the index buffer belongs to the vertex array
  indices_.fill(GL_ELEMENT_ARRAY_BUFFER, std::span<const std::uint32_t>(indices));
}

void BodyMeshes::draw_shaded(int body) const {
  const Range& range = ranges_[as_index(body)];
  shaded_.bind();
  gl_.DrawArrays(GL_TRIANGLES, range.first_corner, range.corners);
}

void BodyMeshes::draw_shape(int body) const {
  const Range& range = ranges_[as_index(body)];
  shape_.bind();
  gl_.DrawElements(GL_TRIANGLES, range.corners, GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(as_index(range.first_corner) * sizeof(std::uint32_t)));
}

}  // namespace duet::render
