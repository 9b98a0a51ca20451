#include "render/projection.h"

#include <cmath>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/error.h"

namespace duet::render {

Vec3 View::to_view(const Vec3& world) const {
  const Vec3 d = world - eye;
  return {right.dot(d), up.dot(d), forward.dot(d)};
}

Vec2 View::to_pixel(const Vec3& world, int width, int height) const {
  const Vec3 v = to_view(world);
  DUET_ASSERT(v.z() > 0);
  const double x = v.x() / (v.z() * half_width), y = v.y() / (v.z() * half_height);
  return {0.5 * width * (1 + x), 0.5 * height * (1 - y)};
}

Mat4 View::projection(double near, double far) const {
  DUET_ASSERT(is_unit(right) && is_unit(up) && is_unit(forward));
  Mat4 to_view = Mat4::Identity();
  to_view.block<1, 3>(0, 0) = right.transpose();
  to_view.block<1, 3>(1, 0) = up.transpose();
  to_view.block<1, 3>(2, 0) = forward.transpose();
  to_view.block<3, 1>(0, 3) = -(to_view.block<3, 3>(0, 0) * eye);
  const Vec2 half(half_width, half_height);
  return clip_perspective(-half, half, near, far) * to_view;
}

std::array<Vec3, 5> View::inward_normals() const {
  return {half_width * forward + right, half_width * forward - right, half_height * forward + up,
          half_height * forward - up, forward};
}

View make_view(const scene::Camera& camera, int width, int height) {
  DUET_ASSERT(width > 0 && height > 0);
  View view;
  view.eye = camera.position;
  view.forward = (camera.target - camera.position).normalized();
  view.right = view.forward.cross(camera.up).normalized();
  view.up = view.right.cross(view.forward);
  view.half_height = std::tan(camera.vertical_fov * std::numbers::pi / 360);
  view.half_width = view.half_height * width / height;
  if (!(view.right.norm() > 0.5) || !(view.half_height > 0))
    throw Error(
        ExitStatus::usage,
        "camera: position, target, up and vertical_fov give no view (the target must differ from the "
        "position, "
        "up must not point along the line of sight, vertical_fov must lie between 0 and 180 degrees)");
  return view;
}

Mat4 clip_perspective(const Vec2& low, const Vec2& high, double near, double far) {
  DUET_ASSERT((low.array() < high.array()).all() && 0 < near && near < far);
  const Vec2 size = high - low;
  Mat4 m = Mat4::Zero();
  m(0, 0) = 2 / size.x();
  m(0, 2) = -(high.x() + low.x()) / size.x();
  m(1, 1) = 2 / size.y();
  m(1, 2) = -(high.y() + low.y()) / size.y();
  m(2, 2) = (far + near) / (far - near);
  m(2, 3) = -2 * far * near / (far - near);
  m(3, 2) = 1;
  return m;
}

Mat4 clip_parallel(const Vec3& low, const Vec3& high) {
  DUET_ASSERT((low.array() < high.array()).all());
  const Vec3 size = high - low;
  Mat4 m = Mat4::Identity();
  for (int i = 0; i < 3; ++i) {
    m(i, i) = 2 / size(i);
    m(i, 3) = -(high(i) + low(i)) / size(i);
  }
  return m;
}

}  // namespace duet::render
