// Reads OBJ files that write_obj() wrote. Anything else is an error that names its line: a picture of a
// damaged frame would be worse than none.
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::io {
namespace {

// Begins a line of strain, which programs wrote before values/ held it.
constexpr std::string_view strain_mark = "# strain";

// Parses the text of an OBJ file.
class ObjReader {
 public:
  ObjReader(const fs::path& path, std::string_view text) : path_(path), rest_(text) {}

  std::vector<BodySurface> read() {
    while (!rest_.empty()) {
      ++line_number_;
      const std::size_t end = rest_.find('\n');
      if (end == std::string_view::npos) fail("the file ends within a line");
      line_ = rest_.substr(0, end);
      rest_.remove_prefix(end + 1);
      read_line();
    }
    finish_body();
    return std::move(bodies_);
  }

 private:
  // Parses line_, from which each function below takes what it has read.
  void read_line() {
    if (line_.starts_with(strain_mark)) return read_strain();
    if (line_.empty() || line_.front() == '#') return;
    const std::string_view keyword = word();
    if (keyword == "o") return begin_body();
    if (bodies_.empty()) fail("no object yet: expected `o NAME`");
    Surface& surface = bodies_.back().surface;
    if (keyword == "v") {
      surface.positions.push_back(numbers<double, 3>());
    } else if (keyword == "vt") {
      surface.uvs.push_back(numbers<float, 2>());
    } else if (keyword == "vn") {
      surface.normals.push_back(numbers<float, 3>());
    } else if (keyword == "f") {
      surface.triangles.push_back({corner(surface), corner(surface), corner(surface)});
    } else {
      fail(fmt::format("unknown keyword `{}`", keyword));
    }
    skip_spaces();
    if (!line_.empty()) fail(fmt::format("unexpected `{}`", line_));
  }

  // Reads the strain of the positions so far, which is in one line or in several.
  void read_strain() {
    line_.remove_prefix(strain_mark.size());
    if (bodies_.empty()) fail("no object yet: expected `o NAME`");
    Surface& surface = bodies_.back().surface;
    for (skip_spaces(); !line_.empty(); skip_spaces()) {
      if (surface.strain.size() == surface.positions.size()) fail(fmt::format("unexpected `{}`", line_));
      surface.strain.push_back(numbers<float, 1>()[0]);
    }
  }

  void begin_body() {
    finish_body();
    skip_spaces();
    if (line_.empty()) fail("the object has no name");
    bodies_.push_back({std::string(line_), {}});
    line_ = {};
  }

  // Checks the body that ends and moves base_ behind it. Indices in the file count through all bodies,
  // those of a surface from its own first vertex.
  void finish_body() {
    if (bodies_.empty()) return;
    const Surface& surface = bodies_.back().surface;
    if (!surface.strain.empty() && surface.strain.size() != surface.positions.size())
      fail(fmt::format("object `{}` has {} vertices and the strain of {}", bodies_.back().name,
                       surface.positions.size(), surface.strain.size()));
    base_.position += static_cast<int>(surface.positions.size());
    base_.uv += static_cast<int>(surface.uvs.size());
    base_.normal += static_cast<int>(surface.normals.size());
  }

  // Reads n finite numbers within the range of floats, because the renderer draws with floats.
  template <class Number, int n>
  Eigen::Matrix<Number, n, 1> numbers() {
    constexpr auto largest = static_cast<Number>(std::numeric_limits<float>::max());
    Eigen::Matrix<Number, n, 1> values;
    for (Number& value : values) {
      skip_spaces();
      value = number<Number>("a number");
      if (!(std::abs(value) <= largest)) fail("a coordinate is not finite");
    }
    return values;
  }

  // Reads "v/vt/vn".
  Corner corner(const Surface& surface) {
    skip_spaces();
    Corner corner;
    corner.position = index(base_.position, surface.positions.size());
    slash();
    corner.uv = index(base_.uv, surface.uvs.size());
    slash();
    corner.normal = index(base_.normal, surface.normals.size());
    return corner;
  }

  // Reads an index and returns it relative to `base`. It must be one of `count` elements.
  int index(int base, std::size_t count) {
    const int value = number<int>("a corner v/vt/vn");
    if (value < base || static_cast<std::size_t>(value - base) >= count)
      fail(
          fmt::format("index {} is not of a vertex that object `{}` has so far", value, bodies_.back().name));
    return value - base;
  }

  void slash() {
    if (line_.empty() || line_.front() != '/') fail("expected a corner v/vt/vn");
    line_.remove_prefix(1);
  }

  template <class Number>
  Number number(const char* expected) {
    Number value{};
    const auto [end, error] = std::from_chars(line_.data(), line_.data() + line_.size(), value);
    if (error != std::errc()) fail(fmt::format("expected {}", expected));
    line_.remove_prefix(static_cast<std::size_t>(end - line_.data()));
    return value;
  }

  std::string_view word() {
    const std::string_view word = line_.substr(0, line_.find(' '));
    line_.remove_prefix(word.size());
    return word;
  }

  void skip_spaces() {
    while (!line_.empty() && (line_.front() == ' ' || line_.front() == '\r')) line_.remove_prefix(1);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw FileError(path_.string(), fmt::format("line {}: {}", line_number_, what),
                    "the file is damaged or from another program: simulate the scene anew");
  }

  const fs::path& path_;
  std::string_view rest_, line_;  // text after the current line, and what is left of the current line
  int line_number_ = 0;
  Corner base_{1, 1, 1};  // indices in the file of the current body's first position, uv and normal
  std::vector<BodySurface> bodies_;
};

}  // namespace

std::vector<BodySurface> read_obj(const fs::path& path) {
  const std::string text = read_file(path);
  return ObjReader(path, text).read();
}

std::vector<BodySurface> read_mesh(const RunDirectory& run, int frame) {
  const fs::path path = run.mesh(frame);
  const std::string text = run.read(path);
  return ObjReader(path, text).read();
}

}  // namespace duet::io
