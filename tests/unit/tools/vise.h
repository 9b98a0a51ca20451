// Two plates that close in half a second, and what the program says of a run.
#pragma once

#include <string>

#include "tests/restart/program.h"

namespace duet::test {

/// Returns the plates of a vise around the height of 1.5 m, which closes to a gap of `gap` (m), as text of a
/// scene.
inline std::string vise_plates(double gap) {
  const auto plate = [&](const std::string& name, double side) {
    return "[[rigid]]\nname = \"" + name + "\"\nshape = { box = [4, 0.5, 4] }\nmotion = { keyframes = [" +
           "{ time = 0, position = [0, " + std::to_string(1.5 + 0.76 * side) +
           ", 0] }, { time = 0.5, position = [0, " + std::to_string(1.5 + (0.25 + gap / 2) * side) +
           ", 0] }] }\n";
  };
  return plate("lower", -1) + plate("upper", 1);
}

/// Returns everything that the program has printed.
inline std::string text_of(const Finished& finished) {
  std::string text = finished.errors;
  for (const std::string& line : finished.output) text += line + '\n';
  return text;
}

}  // namespace duet::test
