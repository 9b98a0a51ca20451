#include "sim/geometry/files/obj_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet {
namespace {

constexpr std::string_view blanks = " \t\r";

// Removes the first word of a line and returns it; empty at the end of the line.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(blanks));
  line.remove_prefix(word.size());
  return word;
}

// What the corners of faces refer to, in their order: 3/2/1 is vertex 3, texture coordinates 2 and normal 1.
struct Referred {
  std::string_view statement, one, many;
};
constexpr std::array<Referred, 3> referred = {{{"v", "vertex", "vertices"},
                                               {"vt", "texture coordinate", "texture coordinates"},
                                               {"vn", "normal", "normals"}}};
using Counts = std::array<std::int64_t, 3>;

// Calls visit(line, number) for every line of the text. A backslash at the end of a line joins the next one
// to it; the line then has the number of the first.
template <class Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  std::size_t number = 0;
  while (!text.empty()) {
    std::string joined;
    const std::size_t first = ++number;
    for (bool goes_on = true; goes_on; number += goes_on ? 1 : 0) {
      std::string_view line = text.substr(0, text.find('\n'));
      text.remove_prefix(std::min(line.size() + 1, text.size()));
      if (line.ends_with('\r')) line.remove_suffix(1);
      goes_on = line.ends_with('\\') && !text.empty();
      if (goes_on) line.remove_suffix(1);
      joined.append(line).push_back(' ');
    }
    visit(std::string_view(joined), first);
  }
}

// Checks one corner of a face. `before` are the counts of what stands before the face, from which negative
// indices count back, and `all` those of the file.
void check_corner(std::string_view corner, const Counts& before, const Counts& all, const auto& fail) {
  for (std::size_t kind = 0; kind < referred.size(); ++kind) {
    const std::string_view part = corner.substr(0, corner.find('/'));
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
    const Referred& what = referred[kind];
    if (!part.empty() && (error != std::errc() || end != part.data() + part.size()))
      fail(fmt::format("a face has the {} `{}`, which is no whole number", what.one, part));
    if (!part.empty() && (index == 0 || index > all[kind] || index < -before[kind]))
      fail(index == 0  ? fmt::format("a face has the {} 0, and they are counted from 1", what.one)
           : index < 0 ? fmt::format("a face has the {} {}, and {} {} stand before it", what.one, index,
                                     before[kind], what.many)
                       : fmt::format("a face has the {} {}, and the file has {} {}", what.one, index,
                                     all[kind], what.many));
    if (part.size() == corner.size()) return;
    corner.remove_prefix(part.size() + 1);
  }
}

}  // namespace

void check_obj_faces(const std::string& path, std::string_view text) {
  const auto count = [](std::string_view word, Counts& counts) {
    for (std::size_t kind = 0; kind < referred.size(); ++kind)
      counts[kind] += word == referred[kind].statement ? 1 : 0;
  };
  Counts all = {}, before = {};
  for_each_line(text, [&](std::string_view line, std::size_t) { count(take_word(line), all); });
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    const auto fail = [&](const std::string& what) {
      throw FileError(path, fmt::format("line {}: {}", number, what), "export the mesh again");
    };
    const std::string_view statement = take_word(line);
    count(statement, before);
    if (statement != "f") return;
    int corners = 0;
    for (std::string_view corner = take_word(line); !corner.empty() && corner[0] != '#';
         corner = take_word(line), ++corners)
      check_corner(corner, before, all, fail);
    if (corners < 3)
      fail(fmt::format("a face has {} corner{}, and needs 3", corners, corners == 1 ? "" : "s"));
  });
}

}  // namespace duet
