#include "tools/hash_table.h"

#include <algorithm>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/near_miss.h"

namespace duet::tools {
namespace {

HashEntry read_entry(const std::filesystem::path& file, const std::string& name, const toml::table& table) {
  const auto wrong = [&](const std::string& key, const std::string& what) {
    return FileError(file.string(), fmt::format("[\"{}\"] {}: {}", name, key, what));
  };
  HashEntry entry;
  entry.name = entry.scene = name;
  std::optional<int> frames;
  for (const auto& [word, node] : table) {
    const std::string key(word.str());
    if (key == "short" || key == "later") {
      const std::optional<std::int64_t> frame = node.value_exact<std::int64_t>();
      if (!frame || *frame < 0) throw wrong(key, "must be the number of a frame");
      (key == "short" ? frames : entry.later) = static_cast<int>(*frame);
    } else if (key == "scene") {
      entry.scene = node.value_exact<std::string>().value_or("");
    } else if (key == "set" && node.is_array()) {
      for (const toml::node& text : *node.as_array())
        entry.set.push_back(text.value_exact<std::string>().value_or(""));
    } else {
      throw wrong(key, "no such key (short, later, scene, set)");
    }
  }
  if (!frames) throw wrong("short", "is missing: the last frame of those looked at always");
  entry.short_frames = *frames;
  if (entry.later && *entry.later <= entry.short_frames) throw wrong("later", "must come after `short`");
  return entry;
}

}  // namespace

std::vector<HashEntry> read_hash_table(const std::filesystem::path& file) {
  toml::table table;
  try {
    table = toml::parse(io::read_file(file), file.string());
  } catch (const toml::parse_error& error) {
    throw FileError(file.string(),
                    fmt::format("line {}: {}", error.source().begin.line, error.description()));
  }
  std::vector<HashEntry> entries;
  for (const auto& [name, node] : table) {
    if (!node.is_table()) throw FileError(file.string(), fmt::format("{} is no table", name.str()));
    entries.push_back(read_entry(file, std::string(name.str()), *node.as_table()));
  }
  if (entries.empty()) throw FileError(file.string(), "names no scene");
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return entries;
}

const HashEntry& find_entry(const std::vector<HashEntry>& table, const std::string& name,
                            const std::filesystem::path& file) {
  std::vector<std::string> names;
  for (const HashEntry& entry : table) {
    if (entry.name == name) return entry;
    names.push_back(entry.name);
  }
  throw Error(ExitStatus::usage,
              fmt::format("{}: no entry in {} ({})", name, file.string(), did_you_mean(name, names)));
}

}  // namespace duet::tools
