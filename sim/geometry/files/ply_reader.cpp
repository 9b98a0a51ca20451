#include "sim/geometry/files/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet {
namespace {

// Types of numbers in the file.
enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
// Encodings of the data.
enum class Format { ascii, little_endian, big_endian };

// A property of an element: one value or a list of values.
struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  // type of the length of a list; none for single values
};

// A kind of element and the number of its instances.
struct Element {
  std::string name;
  std::uint64_t count;
  std::vector<Property> properties;
};

// Returns the type with this name, if there is one.
std::optional<Type> type_named(std::string_view name) {
  constexpr std::array<std::string_view, 8> names = {"char", "uchar", "short", "ushort",
                                                     "int",  "uint",  "float", "double"};
  constexpr std::array<std::string_view, 8> sized = {"int8",  "uint8",  "int16",   "uint16",
                                                     "int32", "uint32", "float32", "float64"};
  for (std::size_t i = 0; i < names.size(); ++i)
    if (name == names[i] || name == sized[i]) return static_cast<Type>(i);
  return {};
}

// Reads one file into a mesh.
class PlyReader {
 public:
  explicit PlyReader(const std::string& path) : path_(path) {
    bytes_ = io::read_file(path);
    if (bytes_.starts_with("\xef\xbb\xbf")) at_ = 3;  // a byte order mark, which some editors put before text
  }

  TriangleMesh read() {
    read_header();
    for (const Element& element : elements_)
      if (element.name == "vertex")
        read_vertices(element);
      else if (element.name == "face")
        read_faces(element);
      else
        skip(element);
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& what, const char* remedy = "export the mesh again") const {
    throw FileError(path_, what, remedy);
  }

  void read_header() {
    for (int number = 1;; ++number) {
      const std::size_t end = bytes_.find('\n', at_);
      if (end == std::string::npos) fail("the header has no end");
      std::istringstream line(bytes_.substr(at_, end - at_));
      at_ = end + 1;
      std::string keyword;
      line >> keyword;
      if (number == 1 ? keyword != "ply" : !read_header_line(keyword, line))
        fail(fmt::format("line {} of the header cannot be understood", number));
      if (keyword == "end_header") return;
    }
  }

  // Takes one line of the header and returns whether it was understood.
  bool read_header_line(const std::string& keyword, std::istringstream& line) {
    std::string word, second, third;
    if (keyword == "format") {
      line >> word;
      format_ = word == "ascii" ? Format::ascii
                                : (word == "binary_big_endian" ? Format::big_endian : Format::little_endian);
      return word == "ascii" || word == "binary_big_endian" || word == "binary_little_endian";
    }
    if (keyword == "element") {
      std::uint64_t count = 0;
      if (!(line >> word >> count)) return false;
      elements_.push_back({word, count, {}});
      return true;
    }
    if (keyword == "property") {
      line >> word >> second >> third;
      if (elements_.empty()) return false;
      const bool list = word == "list";
      const auto type = type_named(list ? third : word), count = type_named(list ? second : "int");
      if (!type || !count) return false;
      if (list) line >> second;
      elements_.back().properties.push_back({second, *type, list ? count : std::nullopt});
      return true;
    }
    return keyword == "comment" || keyword == "obj_info" || keyword == "end_header" || keyword.empty();
  }

  // Reads a binary number of the given type.
  template <class Number>
  double binary() {
    std::array<char, sizeof(Number)> raw;
    if (bytes_.size() - at_ < raw.size()) fail("the file ends too early");
    std::memcpy(raw.data(), bytes_.data() + at_, raw.size());
    at_ += raw.size();
    if ((format_ == Format::big_endian) != (std::endian::native == std::endian::big))
      std::reverse(raw.begin(), raw.end());
    return static_cast<double>(std::bit_cast<Number>(raw));
  }

  // Reads a number that is written as text.
  double text() {
    at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
    if (at_ == bytes_.size()) fail("the file ends too early");
    double value = 0;
    const auto [end, error] = std::from_chars(bytes_.data() + at_, bytes_.data() + bytes_.size(), value);
    if (error != std::errc()) fail(fmt::format("there is no number at byte {}", at_));
    at_ = static_cast<std::size_t>(end - bytes_.data());
    return value;
  }

  // Reads a number of a type in the encoding of the file.
  double number(Type type) {
    if (format_ == Format::ascii) return text();
    switch (type) {
      case Type::i8:
        return binary<std::int8_t>();
      case Type::u8:
        return binary<std::uint8_t>();
      case Type::i16:
        return binary<std::int16_t>();
      case Type::u16:
        return binary<std::uint16_t>();
      case Type::i32:
        return binary<std::int32_t>();
      case Type::u32:
        return binary<std::uint32_t>();
      case Type::f32:
        return binary<float>();
      case Type::f64:
        break;
    }
    return binary<double>();
  }

  // Reads the values of a property. Each value takes at least a byte, so the length of a list is bounded by
  // the size of the file.
  const std::vector<double>& values(const Property& property) {
    const double count = property.count ? number(*property.count) : 1;
    if (!(count >= 0 && count <= static_cast<double>(bytes_.size())) || count != std::floor(count))
      fail("a list has an impossible length");
    values_.clear();
    for (double i = 0; i < count; ++i) values_.push_back(number(property.type));
    return values_;
  }

  void skip(const Element& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t i = 0; i < element.count; ++i)
      for (const Property& property : element.properties) values(property);
  }

  void read_vertices(const Element& element) {
    constexpr std::array<std::array<std::string_view, 3>, 8> names = {
        {{"x"}, {"y"}, {"z"}, {"nx"}, {"ny"}, {"nz"}, {"u", "s", "texture_u"}, {"v", "t", "texture_v"}}};
    std::vector<std::size_t> slots;  // index into `names` of each property
    unsigned found = 0;
    for (const Property& property : element.properties) {
      std::size_t slot = 0;
      while (slot < names.size() &&
             std::find(names[slot].begin(), names[slot].end(), property.name) == names[slot].end())
        ++slot;
      slots.push_back(slot);
      found |= 1U << slot;
    }
    if ((found & 0x07) != 0x07) fail("the vertices have no x, y and z");
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<double, names.size() + 1> value{};
      for (std::size_t k = 0; k < slots.size(); ++k)
        if (const auto& read = values(element.properties[k]); !read.empty()) value[slots[k]] = read.front();
      mesh_.positions.emplace_back(value[0], value[1], value[2]);
      normals_.push_back(Vec3(value[3], value[4], value[5]).cast<float>());
      uvs_.push_back(Vec2(value[6], value[7]).cast<float>());
    }
    has_normals_ = (found & 0x38) == 0x38;
    has_uvs_ = (found & 0xC0) == 0xC0;
  }

  void read_faces(const Element& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t i = 0; i < element.count; ++i)
      for (const Property& property : element.properties) {
        const std::vector<double>& read = values(property);
        if (property.name == "vertex_indices" || property.name == "vertex_index") add_polygon(read);
      }
  }

  // Cuts a polygon into triangles.
  void add_polygon(const std::vector<double>& indices) {
    std::vector<int> polygon;
    for (const double index : indices) {
      if (!(index >= 0 && index < static_cast<double>(mesh_.positions.size())) || index != std::floor(index))
        fail(fmt::format("a face has the vertex {} of {}", index, mesh_.positions.size()));
      polygon.push_back(static_cast<int>(index));
    }
    if (polygon.size() < 3) return;
    // The triangles form a fan from one of the corners, for which all of them face the same way.
    // The search takes the square of the number of corners, which is bounded: large faces are tried from a
    // few corners only.
    constexpr std::size_t max_visits = 10'000'000;
    const std::size_t max_turns = std::min(polygon.size(), max_visits / polygon.size());
    for (std::size_t turns = 0; polygon.size() > 3 && !is_fan(polygon); ++turns) {
      if (turns == max_turns)
        fail("a face has an outline that cannot be cut into a fan of triangles", "export triangles");
      std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) add_triangle({polygon[0], polygon[k - 1], polygon[k]});
  }

  // Returns whether all triangles of the fan from the first corner face the same way. Outlines that go forth
  // and back have triangles whose areas cancel, which face both ways.
  bool is_fan(const std::vector<int>& polygon) const {
    const auto corner = [&](std::size_t k) -> const Vec3& {
      return mesh_.positions[static_cast<std::size_t>(polygon[k])];
    };
    const auto area = [&](std::size_t k) -> Vec3 {
      return (corner(k - 1) - corner(0)).cross(corner(k) - corner(0));
    };
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 2; k < polygon.size(); ++k) sum += area(k);
    for (std::size_t k = 2; k < polygon.size(); ++k)
      if (area(k).dot(sum) < 0 || (sum.isZero(0) && !area(k).isZero(0))) return false;
    return true;
  }

  void add_triangle(const Triangle& t) {
    mesh_.triangles.push_back(t);
    const auto corners = [&](const auto& of_vertex) {
      return std::array{of_vertex[static_cast<std::size_t>(t[0])], of_vertex[static_cast<std::size_t>(t[1])],
                        of_vertex[static_cast<std::size_t>(t[2])]};
    };
    if (has_normals_) mesh_.normals.push_back(corners(normals_));
    if (has_uvs_) mesh_.uvs.push_back(corners(uvs_));
  }

  const std::string& path_;
  std::string bytes_;
  std::size_t at_ = 0;
  Format format_ = Format::ascii;
  std::vector<Element> elements_;
  std::vector<double> values_;
  // Normals of the vertices.
  std::vector<Vec3f> normals_;
  // Texture coordinates of the vertices.
  std::vector<Vec2f> uvs_;
  bool has_normals_ = false, has_uvs_ = false;
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh read_ply(const std::string& path) { return PlyReader(path).read(); }

}  // namespace duet
