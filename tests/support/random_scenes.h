// What the tests of random scenes draw: numbers and shapes that are the same with every standard library.
#pragma once

#include <cmath>
#include <memory>
#include <random>

#include "tests/support/meshes.h"

#include "sim/scene/scene.h"

namespace duet::test {

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double operator()(double least, double most) {
    return least + (most - least) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  int below(int count) { return static_cast<int>((*this)(0, count)); }
  Vec3 direction() {
    Vec3 v;
    do
      for (int axis = 0; axis < 3; ++axis) v[axis] = (*this)(-1, 1);
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

// Of any kind, its extents between 0.2 and 0.5 of `size` (m), in places less or up to twice that.
inline scene::Shape random_shape(Draw& draw, double size) {
  using scene::ShapeKind;
  const double a = size * draw(0.2, 0.5), b = size * draw(0.2, 0.5), c = size * draw(0.2, 0.5);
  switch (draw.below(6)) {
    case 0:
      return {.kind = ShapeKind::sphere, .radius = a};
    case 1:
      return {.kind = ShapeKind::capsule, .radius = 0.5 * a, .length = b};
    case 2:
      return {.kind = ShapeKind::cylinder, .radius = a, .length = b};
    case 3:
      return {.kind = ShapeKind::torus, .radius = 0.7 * a, .tube = 0.25 * a};
    case 4: {
      scene::Shape shape{.kind = ShapeKind::mesh, .scale = 1};
      shape.cells = 24;
      shape.mesh = std::make_shared<TriangleMesh>(box_mesh(-Vec3(a, b, c) / 2, Vec3(a, b, c) / 2));
      return shape;
    }
    default:
      return {.kind = ShapeKind::box, .size = Vec3(a, b, c)};
  }
}

}  // namespace duet::test
