// One OBJ file a frame. Written by hand because std::to_chars is an order of magnitude faster than the
// general exporters, and a long run writes hundreds of these.
#include <charconv>
#include <string_view>

#include "sim/io/run_directory.h"

namespace duet::io {
namespace {

// A growing text whose numbers are written in place. Floats get the fewest digits that read back to the same
// bits.
class Text {
 public:
  explicit Text(std::size_t expected) { text_.resize(expected + 1024); }

  void add(std::string_view part) {
    reserve(part.size());
    part.copy(text_.data() + size_, part.size());
    size_ += part.size();
  }
  template <class Vector>
  void floats(std::string_view keyword, const Vector& values) {
    add(keyword);
    reserve(static_cast<std::size_t>(values.size()) * max_number);
    for (const float value : values) {
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
  static constexpr std::size_t max_number = 24;  // characters: a float's shortest form needs 15, an int 11

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
    size += name.size() + 12 * surface.strain.size() +
            36 * (surface.positions.size() + surface.normals.size()) + 24 * surface.uvs.size() +
            48 * surface.triangles.size();
  return size;
}

}  // namespace

void write_obj(const fs::path& path, const std::vector<BodySurface>& bodies) {
  Text text(expected_size(bodies));
  text.add("# Duet frame: metres; y up, right-handed; one object a body, constant vertex order\n");
  Corner base{1, 1, 1};  // OBJ counts from one, through the whole file
  for (const auto& [name, surface] : bodies) {
    text.add("o ");
    text.add(name);
    text.add("\n");
    for (const Vec3f& position : surface.positions) text.floats("v", position);
    // OBJ has no word for it: other programs pass over comments.
    if (!surface.strain.empty())
      text.floats("# strain", Eigen::Map<const Eigen::VectorXf>(
                                  surface.strain.data(), static_cast<Eigen::Index>(surface.strain.size())));
    for (const Vec2f& uv : surface.uvs) text.floats("vt", uv);
    for (const Vec3f& normal : surface.normals) text.floats("vn", normal);
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
  write_atomically(path, text.take());
}

}  // namespace duet::io
