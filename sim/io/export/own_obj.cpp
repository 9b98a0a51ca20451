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

// Parses an index of OBJ, which counts from 1, or backwards from -1, among the `count` elements so far.
// Returns it counted from 1; 0 if the word is not the index of one of them.
int index_of(std::string_view word, int count) {
  int index = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (error != std::errc() || end != word.data() + word.size()) return 0;
  if (index < 0) index += count + 1;
  return index >= 1 && index <= count ? index : 0;
}

}  // namespace

OwnObj::OwnObj(std::string_view text, const std::string& body, int vertices_before, int uvs_before,
               const std::function<std::string(const std::string&)>& material)
    : body_(body), vertices_before_(vertices_before), uvs_before_(uvs_before), material_(material) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    read_line(trimmed(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

void OwnObj::read_line(std::string_view line) {
  std::string_view rest = line;
  const std::string_view keyword = take_word(rest);
  rest = trimmed(rest);
  if (keyword == "v") {
    ++vertices_;
  } else if (keyword == "vt") {
    ++uvs_;
    tail_ += fmt::format("vt {}\n", rest);
  } else if (keyword == "f") {
    begin_faces();
    add_face(rest);
  } else if (keyword == "o") {
    if (++objects_ > 1 || vertices_ > 0) tail_ += fmt::format("o {}.{}\n", body_, rest);
  } else if (keyword == "g" || keyword == "s") {
    tail_ += fmt::format("{} {}\n", keyword, rest);
  } else if (keyword == "usemtl") {
    has_material_ = true;
    if (const std::string name = material_(std::string(rest)); !name.empty())
      tail_ += "usemtl " + name + '\n';
  }
}

void OwnObj::begin_faces() {
  if (has_material_) return;
  has_material_ = true;
  if (const std::string name = material_(""); !name.empty()) tail_ += "usemtl " + name + '\n';
}

void OwnObj::add_face(std::string_view corners) {
  std::string face = "f";
  while (true) {
    const std::string_view corner = take_word(corners);
    if (corner.empty()) break;
    const std::size_t slash = corner.find('/');
    const int vertex = index_of(corner.substr(0, slash), vertices_);
    if (vertex == 0) return;
    face += fmt::format(" {}", vertices_before_ + vertex);
    if (slash == std::string_view::npos) continue;
    const std::string_view after = corner.substr(slash + 1);
    if (const int uv = index_of(after.substr(0, after.find('/')), uvs_); uv != 0)
      face += fmt::format("/{}", uvs_before_ + uv);
  }
  tail_ += face + '\n';
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
  text.add(tail_);
}

}  // namespace duet::io
