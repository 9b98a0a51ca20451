#include "sim/io/export/own_obj.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

namespace duet::io {
namespace {

constexpr std::string_view blanks = " \t\r";

// Returns the text without blanks at its beginning and end.
std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

// Removes the first word, with blanks before it, from the text and returns it. The result is empty if there
// is none.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  text.remove_prefix(word.size());
  return word;
}

// Parses an index of OBJ. A positive one counts from 1 among the `count` elements of the file, a negative one
// backwards from -1 among the `so_far` elements before its line. Returns the index counted from 1; 0 if the
// word is not the index of such an element.
int index_of(std::string_view word, int so_far, int count) {
  int index = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (error != std::errc() || end != word.data() + word.size() || index < -so_far || index > count) return 0;
  return index < 0 ? index + so_far + 1 : index;
}

// Calls visit(line) for each line of the text, without blanks at its beginning and end.
template <class Visit>
void for_lines(std::string_view text, Visit&& visit) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    visit(trimmed(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

OwnObj::OwnObj(std::string_view text, const std::string& body, int vertices_before, int uvs_before,
               const std::function<std::string(const std::string&)>& material)
    : body_(body), vertices_before_(vertices_before), uvs_before_(uvs_before), material_(material) {
  // Faces may name elements that come after them, so that these are counted first.
  for_lines(text, [&](std::string_view line) {
    const std::string_view keyword = take_word(line);
    vertices_ += keyword == "v" ? 1 : 0;
    uvs_ += keyword == "vt" ? 1 : 0;
  });
  for_lines(text, [&](std::string_view line) { read_line(line); });
}

void OwnObj::read_line(std::string_view line) {
  std::string_view rest = line;
  const std::string_view keyword = take_word(rest);
  rest = trimmed(rest);
  if (keyword == "v") {
    ++vertices_so_far_;
  } else if (keyword == "vt") {
    ++uvs_so_far_;
    uv_lines_ += fmt::format("vt {}\n", rest);
  } else if (keyword == "f") {
    begin_faces();
    add_face(rest);
    ++faces_so_far_;
  } else if (keyword == "o") {
    if (++objects_ > 1 || vertices_so_far_ + faces_so_far_ > 0)
      faces_ += fmt::format("o {}.{}\n", body_, rest);
  } else if (keyword == "g" || keyword == "s") {
    faces_ += fmt::format("{} {}\n", keyword, rest);
  } else if (keyword == "usemtl") {
    has_material_ = true;
    if (const std::string name = material_(std::string(rest)); !name.empty())
      faces_ += "usemtl " + name + '\n';
  }
}

void OwnObj::begin_faces() {
  if (has_material_) return;
  has_material_ = true;
  if (const std::string name = material_(""); !name.empty()) faces_ += "usemtl " + name + '\n';
}

void OwnObj::add_face(std::string_view corners) {
  std::string face = "f", without_uvs = "f";
  bool lacks_uv = false;
  for (std::string_view corner = take_word(corners); !corner.empty(); corner = take_word(corners)) {
    const std::size_t slash = corner.find('/');
    const int vertex = index_of(corner.substr(0, slash), vertices_so_far_, vertices_);
    if (vertex == 0) {
      ++damaged_faces_;
      return;
    }
    const std::string place = fmt::format(" {}", vertices_before_ + vertex);
    face += place;
    without_uvs += place;
    if (slash == std::string_view::npos) continue;
    const std::string_view after = corner.substr(slash + 1), word = after.substr(0, after.find('/'));
    if (word.empty()) continue;
    const int uv = index_of(word, uvs_so_far_, uvs_);
    lacks_uv |= uv == 0;
    face += fmt::format("/{}", uvs_before_ + uv);
  }
  damaged_faces_ += lacks_uv ? 1 : 0;
  faces_ += (lacks_uv ? without_uvs : face) + '\n';
}

void OwnObj::add(TextBuilder& text, const std::vector<Vec3>& positions, const std::vector<int>& order) const {
  text.add("o ");
  text.add(body_);
  text.add("\n");
  for (const int i : order) {
    text.add("v");
    text.numbers(' ', positions[static_cast<std::size_t>(i)]);
    text.add("\n");
  }
  text.add(uv_lines_);
  text.add(faces_);
}

}  // namespace duet::io
