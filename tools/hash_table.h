// The table tests/hashes/frames.toml: which frames of which scenes have expected hashes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace duet::tools {

// One entry of the table.
struct HashEntry {
  std::string name;              // of the entry, and of its file of hashes: "stack", "hard/pile"
  std::string scene;             // name of the scene; `name` unless the entry gives another
  std::vector<std::string> set;  // "key=value", as after --set
  int short_frames = 0;          // frames 0 to this one are always compared
  std::optional<int> later;      // one more frame, which --full compares
};

// Reads the table and returns its entries by name. Throws FileError that names the entry and key at fault, or
// if the table has no entries.
std::vector<HashEntry> read_hash_table(const std::filesystem::path& file);

// Finds an entry by its name. Throws Error (usage) with a similar name if there is none; `file` is for the
// message.
const HashEntry& find_entry(const std::vector<HashEntry>& table, const std::string& name,
                            const std::filesystem::path& file);

}  // namespace duet::tools
