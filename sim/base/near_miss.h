// "Did you mean": finds the known word that is closest to a misspelled one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace duet {

/// Returns the least number of insertions, deletions, replacements and swaps of neighboring letters that turn
/// one word into the other (restricted Damerau-Levenshtein distance). Upper and lower case count as equal.
int edit_distance(std::string_view a, std::string_view b);

/// Returns the one of the `known` words that may have been meant: that for which other programs have this
/// word, such as `least` for "min", else the closest one, and the first of several. The edit distance may be
/// at most a third of the length of `word`, or 1 for shorter words, and not every letter may differ.
std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& known);

/// Returns a hint for an unknown word: "did you mean `friction`?" if there is a near miss, else "known: a, b,
/// c". Returns an empty string if no word is known.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace duet
