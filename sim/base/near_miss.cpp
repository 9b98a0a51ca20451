#include "sim/base/near_miss.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace duet {
namespace {

// Words that other programs use, with ours.
struct OtherWord {
  std::string_view other, ours;
};
constexpr OtherWord other_words[] = {
    {"min", "least"},
    {"max", "most"},
    {"kinematic", "motion"},
    {"animated", "motion"},
    {"fixed", "static"},
    {"passive", "static"},
    {"length", "height"},
    {"height", "length"},
    {"color", "look"},
    {"colour", "look"},
    {"pos", "position"},
    {"translation", "position"},
    {"location", "position"},
    {"rot", "rotation"},
    {"orientation", "rotation"},
    {"omega", "angular_velocity"},
    {"spin", "angular_velocity"},
    {"bounciness", "restitution"},
    {"bounce", "restitution"},
    {"elasticity", "restitution"},
    {"mu", "friction"},
    {"stiffness", "youngs_modulus"},
    {"E", "youngs_modulus"},
    {"young", "youngs_modulus"},
    {"nu", "poisson_ratio"},
    {"poisson", "poisson_ratio"},
    {"rho", "density"},
    {"weight", "mass"},
    {"fov", "vertical_fov"},
    {"look_at", "target"},
    {"eye", "position"},
    {"intensity", "power"},
    {"dt", "max_time_step"},
    {"time_step", "max_time_step"},
    {"timestep", "max_time_step"},
    {"substeps", "max_substeps"},
    {"frame_rate", "fps"},
    {"framerate", "fps"},
    {"duration", "frames"},
    {"resolution", "cells"},
    {"subdivisions", "cells"},
    {"segments", "cells"},
    {"limits", "angle"},
};

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

int edit_distance(std::string_view a, std::string_view b) {
  // Rows i-2, i-1 and i of the table of distances between prefixes of the two words (restricted
  // Damerau-Levenshtein distance).
  std::vector<int> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(above);
    above.swap(row);
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const char p = lower(a[i - 1]), q = lower(b[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (p == q ? 0 : 1)});
      if (i > 1 && j > 1 && p == lower(b[j - 2]) && lower(a[i - 2]) == q)
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

std::optional<std::string> near_miss(std::string_view word, const std::vector<std::string>& known) {
  for (const OtherWord& entry : other_words)
    if (word == entry.other && std::find(known.begin(), known.end(), entry.ours) != known.end())
      return std::string(entry.ours);
  const int allowed = std::max(1, static_cast<int>(word.size()) / 3);
  std::optional<std::string> best;
  int least = allowed + 1;
  for (const std::string& candidate : known) {
    const int distance = edit_distance(word, candidate);
    // A one-letter word is one replacement away from every other one, which is no near miss.
    if (distance < least && distance < static_cast<int>(std::max(word.size(), candidate.size()))) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  if (const auto candidate = near_miss(word, known)) return fmt::format("did you mean `{}`?", *candidate);
  if (known.empty()) return {};
  return fmt::format("known: {}", fmt::join(known, ", "));
}

}  // namespace duet
