#include "sim/io/expected_hashes.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/files.h"
#include "sim/base/hash.h"

namespace duet::io {
namespace {

constexpr std::size_t row = 12;            // hashes on a line "bodies", which then has 116 characters
constexpr std::string_view indent = "  ";  // begins the lines below a frame
// A group needs at least this many bodies; fewer have a line each. A larger value gives longer files that
// name the quantity of more bodies.
constexpr std::size_t min_group = 8;
constexpr std::string_view bodies = "bodies", group = "group ";

// Folds a hash of 64 bits into 8 hexadecimal digits.
std::string short_hash(std::uint64_t hash) {
  return fmt::format("{:08x}", static_cast<std::uint32_t>(hash ^ (hash >> 32)));
}

// Continues the hash of a sequence of hashes with the next one.
std::uint64_t join(std::uint64_t hash, std::uint64_t next) { return hash_bytes(&next, sizeof next, hash); }

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

// Returns the name as it stands in a label: see HashLine::label.
std::string quoted(const std::string& name) {
  const auto is_plain = [](char c) { return !is_control(c) && c != ' ' && c != '"' && c != '\\'; };
  if (!name.empty() && std::all_of(name.begin(), name.end(), is_plain)) return name;
  std::string text = "\"";
  for (const char c : name) {
    if (is_control(c)) {
      text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
      continue;
    }
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

// Returns the name that quoted() was given, but control characters as \xHH.
std::string unquoted(const std::string& text) {
  if (!text.starts_with('"') || text.size() < 2) return text;
  std::string name;
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (text[i] == '\\' && text[i + 1] != 'x') ++i;
    name += text[i];
  }
  return name;
}

std::string label_of(const BodyHashes& body) {
  if (body.owner == Owner::scene) return "scene";
  return (body.owner == Owner::rigid ? "rigid " : "deformable ") + quoted(body.name);
}

// Replaces each run of digits by a star: "loop12-link3" becomes "loop*-link*". Bodies of one stem form a
// group.
std::string stem(const std::string& name) {
  std::string result;
  for (const char c : name) {
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (!digit) result += c;
    if (digit && !result.ends_with('*')) result += '*';
  }
  return result;
}

HashLine line_of(const BodyHashes& body) {
  HashLine line;
  line.label = label_of(body);
  for (const NamedHash& quantity : body.quantities) {
    line.hashes.push_back(short_hash(quantity.hash));
    line.names.emplace_back(quantity.name);
  }
  return line;
}

// Appends the line of a group and the lines "bodies" of its members.
void add_group(const std::string& label, const std::vector<const BodyHashes*>& members,
               std::vector<HashLine>& lines) {
  HashLine all;
  all.label = fmt::format("{}{} {}", group, label, members.size());
  for (std::size_t q = 0; q < members[0]->quantities.size(); ++q) {
    std::uint64_t hash = hash_seed;
    for (const BodyHashes* body : members) hash = join(hash, body->quantities[q].hash);
    all.hashes.push_back(short_hash(hash));
    all.names.emplace_back(members[0]->quantities[q].name);
  }
  lines.push_back(std::move(all));
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (i % row == 0) lines.emplace_back().label = bodies;
    std::uint64_t hash = hash_seed;
    for (const NamedHash& quantity : members[i]->quantities) hash = join(hash, quantity.hash);
    lines.back().hashes.push_back(short_hash(hash));
    lines.back().names.push_back(members[i]->name);
  }
}

// Returns the number of hashes at the end of a line, or 0 if the line is malformed.
std::size_t trailing_hashes(const std::vector<std::string>& words) {
  const auto is_hash = [](const std::string& word) {
    return word.size() == 8 && word.find_first_not_of("0123456789abcdef") == std::string::npos;
  };
  // The label comes first, and its number of words follows from the first one. A name that looks like a
  // hash is thus not taken for one.
  const std::size_t label = words[0] == "scene" || words[0] == bodies ? 1 : words[0] == "group" ? 4 : 2;
  if (words.size() < label ||
      !std::all_of(words.begin() + static_cast<std::ptrdiff_t>(label), words.end(), is_hash))
    return 0;
  return words.size() - label;
}

// Returns the words of a line, which blanks separate. A name in quotes is one word, with its quotes; one
// whose quotes are not closed ends with the line.
std::vector<std::string> words_of(std::string_view line) {
  constexpr std::string_view blanks = " \t\r";
  std::vector<std::string> words;
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    if (line.empty()) return words;
    std::size_t end = 0;
    if (line[0] == '"') {
      for (end = 1; end < line.size() && line[end] != '"'; ++end)
        if (line[end] == '\\') ++end;
      end = std::min(end + 1, line.size());
    } else {
      end = std::min(line.find_first_of(blanks), line.size());
    }
    words.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

}  // namespace

std::vector<HashLine> hash_lines(const std::vector<BodyHashes>& all, std::size_t max_lines) {
  std::map<std::string, std::vector<const BodyHashes*>> groups;
  if (all.size() > max_lines)
    for (const BodyHashes& body : all) groups[stem(label_of(body))].push_back(&body);
  std::vector<HashLine> lines;
  for (const BodyHashes& body : all) {
    const auto found = groups.find(stem(label_of(body)));
    if (found == groups.end() || found->second.size() < min_group)
      lines.push_back(line_of(body));
    else if (found->second[0] == &body)
      add_group(found->first, found->second, lines);
  }
  return lines;
}

std::string whole_hash(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

std::string expected_text(const std::string& about, const std::vector<FrameHashes>& frames) {
  std::string text;
  std::istringstream comment(about);
  for (std::string line; std::getline(comment, line);) text += fmt::format("# {}\n", line);
  for (const FrameHashes& frame : frames) {
    text += fmt::format("frame {} {}\n", frame.frame, frame.whole);
    for (const HashLine& line : frame.lines)
      text += fmt::format("{}{} {}\n", indent, line.label, fmt::join(line.hashes, " "));
  }
  return text;
}

std::vector<FrameHashes> read_expected(const fs::path& path) {
  std::vector<FrameHashes> frames;
  std::istringstream text(read_file(path));
  int number = 0;
  const auto damaged = [&] {
    return FileError(path.string(), fmt::format("line {} is no line of hashes", number),
                     "renew the file with `duet hashes --write`");
  };
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> words = words_of(line);
    if (words.empty()) throw damaged();
    if (line.starts_with(indent)) {
      const std::size_t count = trailing_hashes(words);
      if (frames.empty() || count == 0) throw damaged();
      const auto end = words.end() - static_cast<std::ptrdiff_t>(count);
      HashLine& added = frames.back().lines.emplace_back();
      added.label = fmt::format("{}", fmt::join(words.begin(), end, " "));
      added.hashes.assign(end, words.end());
      continue;
    }
    if (words.size() != 3 || words[0] != "frame" || words[2].size() != 16) throw damaged();
    try {
      frames.push_back({std::stoi(words[1]), words[2], {}});
    } catch (const std::logic_error&) {
      throw damaged();
    }
  }
  if (frames.empty())
    throw FileError(path.string(), "has no hashes", "renew the file with `duet hashes --write`");
  return frames;
}

std::string HashDifference::text() const {
  std::string what = quantity.empty() ? "the state" : quantity;
  if (!body.empty()) what += fmt::format(" of `{}`", body);
  if (bodies > 1) what += fmt::format(" (and {} more bodies)", bodies - 1);
  return fmt::format("frame {}: {}", frame, what);
}

std::optional<HashDifference> compare_hashes(const FrameHashes& expected, const FrameHashes& found) {
  HashDifference difference;
  difference.frame = found.frame;
  bool equal = expected.whole == found.whole;
  const std::size_t count = expected.lines.empty() ? 0 : std::max(expected.lines.size(), found.lines.size());
  for (std::size_t i = 0; i < count; ++i) {
    const HashLine* then = i < expected.lines.size() ? &expected.lines[i] : nullptr;
    const HashLine* now = i < found.lines.size() ? &found.lines[i] : nullptr;
    if (!then || !now || then->label != now->label || then->hashes.size() != now->hashes.size()) {
      difference.quantity = fmt::format("the list of bodies (`{}` where `{}` was)",
                                        now ? now->label : "nothing", then ? then->label : "nothing");
      return difference;
    }
    const bool is_group = now->label.starts_with(group), is_row = now->label == bodies;
    bool first = true;
    for (std::size_t k = 0; k < now->hashes.size(); ++k) {
      if (then->hashes[k] == now->hashes[k]) continue;
      equal = false;
      if (!is_row && difference.quantity.empty()) difference.quantity = now->names[k];
      if (now->label != "scene" && !is_group && (is_row || first)) {
        if (difference.bodies++ == 0)
          difference.body = is_row ? now->names[k] : unquoted(now->label.substr(now->label.find(' ') + 1));
      }
      first = false;
    }
  }
  return equal ? std::nullopt : std::optional(difference);
}

}  // namespace duet::io
