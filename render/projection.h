// The camera: where a point of the scene lands in the picture.
#pragma once

#include <array>

#include "sim/base/types.h"
#include "sim/scene/scene.h"

namespace duet::render {

using Mat4 = Eigen::Matrix4d;

// A pinhole with orthonormal axes. The ray through normalized picture coordinates (x, y) in [-1, 1] (right,
// up) is forward + x * half_width * right + y * half_height * up.
struct View {
  Vec3 eye;
  Vec3 right, up, forward;
  double half_width = 1, half_height = 1;  // of the picture at distance 1

  Vec3 to_view(const Vec3& world) const;  // right, up, forward components
  // Pixel coordinates, origin at the top left corner of the picture. The point must lie in front of the eye.
  Vec2 to_pixel(const Vec3& world, int width, int height) const;
  // World to clip space for the given range of distances along `forward`.
  Mat4 projection(double near, double far) const;
  // The four sides of the visible pyramid and the plane through the eye: normals that point inside, all
  // planes through the eye.
  std::array<Vec3, 5> inward_normals() const;
};

// Throws Error(usage) when position, target and up do not span a view.
View make_view(const scene::Camera& camera, int width, int height);

// OpenGL's clip matrix of a pyramid that is not centred: bounds of x/z and y/z, and of z, with z pointing
// forward.
Mat4 clip_perspective(const Vec2& low, const Vec2& high, double near, double far);
// The same of a box; near may be negative.
Mat4 clip_parallel(const Vec3& low, const Vec3& high);

}  // namespace duet::render
