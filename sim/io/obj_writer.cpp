// Writes an OBJ file a frame, with a TextBuilder: it is an order of magnitude faster than general
// exporters, and a long run writes hundreds of these files.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"
#include "sim/io/text_builder.h"

namespace duet::io {
namespace {

// Appends a line with a keyword and numbers.
template <class Vector>
void add_line(TextBuilder& text, std::string_view keyword, const Vector& values) {
  text.add(keyword);
  text.numbers(' ', values);
  text.add("\n");
}

// Appends a corner " v/vt/vn". The indices count from one.
void add_corner(TextBuilder& text, int position, int uv, int normal) {
  text.add(" ");
  text.number(position);
  text.add("/");
  text.number(uv);
  text.add("/");
  text.number(normal);
}

// Estimates the length of the text in bytes, so that the builder rarely has to grow.
std::size_t expected_size(const std::vector<BodySurface>& surfaces) {
  std::size_t size = 0;
  for (const auto& [name, surface] : surfaces)
    size += name.size() + 40 * (surface.positions.size() + surface.normals.size()) + 24 * surface.uvs.size() +
            48 * surface.triangles.size();
  return size;
}

// Rounds positions to decimal places, so that they have few digits. The step is the largest power of ten
// that is at most 1e-6 m and 2^-24 of the surface's extent, the relative precision of a float.
class Rounding {
 public:
  explicit Rounding(const Surface& surface) {
    Eigen::AlignedBox3d box;
    for (const Vec3& x : surface.positions) box.extend(x);
    const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
    while (extent > 0 && extent * places_ < 0x1p24 && places_ < max_exact) places_ *= 10;
  }

  Vec3 operator()(const Vec3& x) const { return {rounded(x.x()), rounded(x.y()), rounded(x.z())}; }

 private:
  static constexpr double max_exact = 1e22;  // largest power of ten that is exactly a double

  double rounded(double x) const {
    const double count = x * places_;
    // Both operands of the quotient are exact, so it is the double nearest to the decimal number, whose
    // shortest form has only the digits of that number.
    return std::abs(count) < 0x1p53 ? std::nearbyint(count) / places_ + 0.0 : x;  // + 0.0 removes -0.0
  }

  double places_ = 1e6;  // inverse of the step, 1/m: a power of ten
};

}  // namespace

std::string obj_text(const std::vector<BodySurface>& bodies) {
  return obj_text(bodies,
                  {"metres; y up, right-handed; one object a body, constant vertex order", {}, {}, true});
}

std::string obj_text(const std::vector<BodySurface>& bodies, const ObjStyle& style) {
  TextBuilder text(expected_size(bodies));
  text.add("# Duet frame: ");
  text.add(style.comment);
  text.add("\n");
  if (!style.library.empty()) {
    text.add("mtllib ");
    text.add(style.library);
    text.add("\n");
  }
  Corner base{1, 1, 1};  // indices of the body's first elements: OBJ counts from one, through the whole file
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto& [name, surface] = bodies[i];
    text.add("o ");
    text.add(name);
    text.add("\n");
    if (style.is_rounded) {
      const Rounding round(surface);
      for (const Vec3& position : surface.positions) add_line(text, "v", round(position));
    } else {
      for (const Vec3& position : surface.positions) add_line(text, "v", position);
    }
    for (const Vec2f& uv : surface.uvs) add_line(text, "vt", uv);
    for (const Vec3f& normal : surface.normals) add_line(text, "vn", normal);
    if (!style.library.empty()) {
      text.add("usemtl ");
      text.add(style.materials.at(i));
      text.add("\n");
    }
    for (const auto& triangle : surface.triangles) {
      text.add("f");
      for (const Corner& corner : triangle)
        add_corner(text, base.position + corner.position, base.uv + corner.uv, base.normal + corner.normal);
      text.add("\n");
    }
    base.position += static_cast<int>(surface.positions.size());
    base.uv += static_cast<int>(surface.uvs.size());
    base.normal += static_cast<int>(surface.normals.size());
  }
  return text.take();
}

void write_obj(const fs::path& path, const std::vector<BodySurface>& bodies) {
  write_atomically(path, obj_text(bodies));
}

}  // namespace duet::io
