// The bodies' surfaces as OpenGL draws them.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/gl_objects.h"
#include "render/shadow_samples.h"
#include "sim/simulation/frame.h"

namespace duet::render {

class BodyMeshes {
 public:
  explicit BodyMeshes(const Gl& gl);

  // Positions and bounds are relative to `origin` (m) from here on: as floats, they are exact near it only.
  void upload(const std::vector<BodySurface>& bodies, const Vec3& origin);
  int count() const { return static_cast<int>(ranges_.size()); }
  const Bounds& bounds(int body) const { return ranges_[static_cast<std::size_t>(body)].bounds; }

  // m per unit of the texture coordinates along each of them, mean over the surface as it was in the first
  // picture.
  Vec2 texture_scale(int body) const { return ranges_[static_cast<std::size_t>(body)].texture_scale; }

  // Attributes 0 position, 1 normal, 2 texture coordinates, 3 strain and whether an element is inverted.
  void draw_shaded(int body) const;
  // Attribute 0 position, each vertex once.
  void draw_shape(int body) const;

 private:
  struct Range {
    int first_corner = 0, corners = 0;  // of the shaded vertices; the indices of the shape are as many
    Bounds bounds;
    Vec2 texture_scale = Vec2::Ones();
  };

  const Gl& gl_;
  Buffer corners_, positions_, indices_;
  VertexArray shaded_, shape_;
  std::vector<Range> ranges_;
  std::map<std::string, Vec2> texture_scales_;
};

}  // namespace duet::render
