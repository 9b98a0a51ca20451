// The surfaces of the bodies as vertex and index buffers of OpenGL.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/gl_objects.h"
#include "render/shadow_samples.h"
#include "sim/simulation/frame.h"

namespace duet::render {

/// Holds the surfaces of all bodies of one frame in buffers of OpenGL, and draws single bodies from them. The
/// current context must be that of the constructor in every member function. `body` is the place of a body in
/// the list that upload() was given.
class BodyMeshes {
 public:
  /// Creates empty buffers. `gl` must outlive the object.
  explicit BodyMeshes(const Gl& gl);

  /// Replaces all surfaces by those of `bodies` (m, world frame). Stored positions and bounds are relative to
  /// `origin` (m, world frame) from here on, because floats are exact near zero only. Computes
  /// texture_scale() for names of bodies that it has not seen before.
  void upload(const std::vector<BodySurface>& bodies, const Vec3& origin);
  /// Returns the number of bodies that upload() was given.
  int count() const { return static_cast<int>(ranges_.size()); }
  /// Returns the box around a body (m, relative to the origin of upload(), axes of the world).
  const Box& bounds(int body) const { return ranges_[static_cast<std::size_t>(body)].bounds; }

  /// Returns the length on the surface that one unit of the texture coordinates u and v takes (m), as the
  /// mean over the area. It belongs to the first upload of a body of this name: a pattern stretches with the
  /// body.
  Vec2 texture_scale(int body) const { return ranges_[static_cast<std::size_t>(body)].texture_scale; }

  /// Draws the triangles of a body with unshared vertices. The attributes are 0: position, 1: normal, 2:
  /// texture coordinates, 3: value shown as a color, and 1 at triangles that touch an inverted element, else
  /// 0.
  void draw_shaded(int body) const;
  /// Draws the triangles of a body with shared vertices and attribute 0, the position, alone: for shadow
  /// maps.
  void draw_shape(int body) const;

 private:
  // The part of the buffers that belongs to a body.
  struct Range {
    // Interval of entries in corners_ and in indices_: both have one for each corner of a triangle.
    int first_corner = 0, corners = 0;
    Box bounds;
    Vec2 texture_scale = Vec2::Ones();
  };

  const Gl& gl_;
  // Vertices of draw_shaded(); positions and triangles of draw_shape().
  Buffer corners_, positions_, indices_;
  VertexArray shaded_, shape_;
  std::vector<Range> ranges_;
  // Scale of the texture coordinates by the name of the body; see texture_scale().
  std::map<std::string, Vec2> texture_scales_;
};

}  // namespace duet::render
