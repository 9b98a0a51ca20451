// "Did you mean": the known word closest to a misspelt one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace duet {

// Least number of insertions, deletions, replacements and swaps of neighbours that turn one word into the
// other; upper and lower case count as equal.
int edit_distance(std::string_view a, std::string_view b);

// The closest of `known` if it is close enough to be meant: at most a third of the letters wrong, at least
// one allowed.
std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& known);

// "did you mean `friction`?", else "known: a, b, c", else empty when nothing is known.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace duet
