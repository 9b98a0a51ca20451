// How deep a JSON text nests, which is asked before it is parsed.
#pragma once

#include <cstddef>
#include <string_view>

namespace duet {

/// Depth up to which files are read. Files of runs nest up to 6 levels, glTF files up to 10. Libraries copy,
/// write and parse values recursively: some ten thousand levels overflow the stack.
inline constexpr std::size_t max_json_depth = 100;

/// Returns the largest number of brackets and braces that are open at a place of the text, outside of its
/// strings. For a malformed text, the number holds up to the first mistake at least.
std::size_t json_depth(std::string_view text);

}  // namespace duet
