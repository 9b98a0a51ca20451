// The camera: maps points of the scene to the picture.
#pragma once

#include <array>

#include "sim/base/types.h"
#include "sim/scene/scene.h"

namespace duet::render {

/// A 4x4 matrix of homogeneous coordinates.
using Mat4 = Eigen::Matrix4d;

/// A pinhole camera with orthonormal axes. The ray through the normalized picture coordinates (x, y) in [-1,
/// 1], to the right and up, is forward + x half_width right + y half_height up.
struct View {
  Vec3 eye;               ///< m, center of projection
  Vec3 right,             ///< unit vector to the right in the picture
      up,                 ///< unit vector upwards in the picture
      forward;            ///< unit direction of view
  double half_width = 1,  ///< half the width of the picture at distance 1
      half_height = 1;    ///< half the height of the picture at distance 1

  /// Returns the components of `world` - eye along right, up and forward (m).
  Vec3 to_view(const Vec3& world) const;
  /// Returns the place of a point in a picture of `width` x `height` pixels (pixels, from the top left
  /// corner). The point must lie in front of the eye.
  Vec2 to_pixel(const Vec3& world, int width, int height) const;
  /// Returns the matrix from world to OpenGL's clip space for points whose distance along `forward` lies
  /// between `near` and `far` (m).
  Mat4 projection(double near, double far) const;
  /// Returns the inward normals of the view's four sides and `forward`, which is that of the plane through
  /// the eye. They are not normalized, and all five planes pass through the eye.
  std::array<Vec3, 5> inward_normals() const;
};

/// Returns the view of a camera for a picture of `width` x `height` pixels. Throws Error (usage) if position,
/// target, up and the field of view do not define one.
View make_view(const scene::Camera& camera, int width, int height);

/// Returns OpenGL's clip matrix of a pyramid that need not be symmetric. `low` and `high` bound x/z and y/z,
/// `near` and `far` bound z, which points forward.
Mat4 clip_perspective(const Vec2& low, const Vec2& high, double near, double far);
/// Returns OpenGL's clip matrix of the box from `low` to `high`, for a parallel projection along z. `low`.z
/// may be negative.
Mat4 clip_parallel(const Vec3& low, const Vec3& high);

}  // namespace duet::render
