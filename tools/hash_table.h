// tests/hashes/frames.toml: which frames of which scenes have expected hashes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace duet::tools {

struct HashEntry {
  std::string name;              // of the entry, and of its file of hashes: "stack", "hard/pile"
  std::string scene;             // the scene; `name` unless the entry says otherwise
  std::vector<std::string> set;  // "key=value", as after --set
  int short_frames = 0;          // frames 0 to this one are looked at always
  std::optional<int> later;      // one more, with --full
};

// Sorted by name. Throws FileError naming the entry and key that are wrong; a table without entries is.
std::vector<HashEntry> read_hash_table(const std::filesystem::path& file);

// Throws Error (usage) with a near miss.
const HashEntry& find_entry(const std::vector<HashEntry>& table, const std::string& name,
                            const std::filesystem::path& file);

}  // namespace duet::tools
