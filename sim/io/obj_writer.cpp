// One OBJ file a frame. Written by hand because std::to_chars is an order of magnitude faster than the
// general exporters, and a long run writes hundreds of these.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::io {
namespace {

// A growing text whose numbers are written in place, with the fewest digits that read back to the same bits.
class Text {
 public:
  explicit Text(std::size_t expected) { text_.resize(expected + 1024); }

  void add(std::string_view part) {
    reserve(part.size());
    part.copy(text_.data() + size_, part.size());
    size_ += part.size();
  }
  template <class Vector>
  void numbers(std::string_view keyword, const Vector& values) {
    add(keyword);
    reserve(static_cast<std::size_t>(values.size()) * max_number);
    for (const auto value : values) {
      text_[size_++] = ' ';
      number(value);
    }
    text_[size_++] = '\n';
  }
  // "v/vt/vn", one-based.
  void corner(int position, int uv, int normal) {
    reserve(3 * max_number);
    text_[size_++] = ' ';
    number(position);
    text_[size_++] = '/';
    number(uv);
    text_[size_++] = '/';
    number(normal);
  }
  std::string take() {
    text_.resize(size_);
    return std::move(text_);
  }

 private:
  static constexpr std::size_t max_number = 25;  // characters: a double's shortest form needs 24, and a space

  void reserve(std::size_t more) {
    if (size_ + more + 1 > text_.size()) text_.resize(2 * (size_ + more + 1));
  }
  template <class Number>
  void number(Number value) {
    char* begin = text_.data() + size_;
    size_ += static_cast<std::size_t>(std::to_chars(begin, begin + max_number, value).ptr - begin);
  }

  std::string text_;
  std::size_t size_ = 0;
};

std::size_t expected_size(const std::vector<BodySurface>& bodies) {
  std::size_t size = 0;
  for (const auto& [name, surface] : bodies)
    size += name.size() + 40 * (surface.positions.size() + surface.normals.size()) + 24 * surface.uvs.size() +
            48 * surface.triangles.size();
  return size;
}

// Rounds positions to decimal places, so that few digits say them: to a part of the surface's extent as small
// as the last bit of a float is of its value (2^-24), and to 1e-6 m at most.
class Rounding {
 public:
  explicit Rounding(const Surface& surface) {
    Eigen::AlignedBox3d box;
    for (const Vec3& x : surface.positions) box.extend(x);
    const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
    while (extent > 0 && extent * places_ < 0x1p24 && places_ < largest_exact) places_ *= 10;
  }

  Vec3 operator()(const Vec3& x) const { return {rounded(x.x()), rounded(x.y()), rounded(x.z())}; }

 private:
  static constexpr double largest_exact = 1e22;  // of the powers of ten among the doubles

  double rounded(double x) const {
    const double count = x * places_;
    // The quotient of two exact numbers is the double nearest to the decimal number: its shortest form.
    return std::abs(count) < 0x1p53 ? std::nearbyint(count) / places_ + 0.0 : x;  // + 0.0: no negative zero
  }

  double places_ = 1e6;  // 1/m
};

}  // namespace

std::string obj_text(const std::vector<BodySurface>& bodies) {
  Text text(expected_size(bodies));
  text.add("# Duet frame: metres; y up, right-handed; one object a body, constant vertex order\n");
  Corner base{1, 1, 1};  // OBJ counts from one, through the whole file
  for (const auto& [name, surface] : bodies) {
    text.add("o ");
    text.add(name);
    text.add("\n");
    const Rounding round(surface);
    for (const Vec3& position : surface.positions) text.numbers("v", round(position));
    for (const Vec2f& uv : surface.uvs) text.numbers("vt", uv);
    for (const Vec3f& normal : surface.normals) text.numbers("vn", normal);
    for (const auto& triangle : surface.triangles) {
      text.add("f");
      for (const Corner& corner : triangle)
        text.corner(base.position + corner.position, base.uv + corner.uv, base.normal + corner.normal);
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
