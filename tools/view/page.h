/// The page of `duet view`: the files of this folder and the data of a run in one file of HTML.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace duet::view {

/// A file of this folder that is compiled into the program.
struct PageFile {
  std::string_view name, text;
};
const std::vector<PageFile>& page_files();

/// Every page begins with this: a file that does not is no page of ours, and is not replaced.
inline constexpr std::string_view page_start = "<!DOCTYPE html>\n<!-- duet view -->\n";

/// Returns whether the file is there, is a regular file, and begins as a page does. Throws FileError if it
/// cannot be read.
bool is_page(const std::filesystem::path& path);

/// The page up to the blocks of data. `title` is the text of its tab.
std::string page_head(const std::string& title, const nlohmann::ordered_json& run);
/// A block of data, in base 64.
std::string page_block(const std::string& block);
/// What follows the last block.
std::string page_end();

}  // namespace duet::view
