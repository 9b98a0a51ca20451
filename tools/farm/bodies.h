// What became of the bodies of a run: where they are at its end, how far they came, and how fast they are.
#pragma once

#include <string>
#include <vector>

#include "sim/io/run_directory.h"

namespace duet::farm {

// A number by which runs are compared.
struct Result {
  const char* name;   // head of its column
  const char* title;  // of its chart, with the unit
};

// Numbers of one body of a run. A rigid body counts with its center of mass; a deformable one with the center
// of its surface, in which each vertex has the weight of the area around it at frame 0.
struct BodyResult {
  std::string name, kind;       // as in the manifest
  std::vector<double> numbers;  // by body_results(); NaN: a body of this kind has none
};

// Places of the numbers that pages show in BodyResult::numbers.
enum BodyNumber : std::size_t { place_x, place_y, place_z, moved, travelled, speed, top_speed, spin };

// Returns the numbers of bodies that tables have.
const std::vector<Result>& body_results();

// Reads what became of the bodies of a run from frame 0 to the frame `last`, in the order of the manifest and
// without static bodies. Throws FileError if the motion of a frame (values/) is missing or damaged.
std::vector<BodyResult> read_bodies(const io::RunDirectory& run, int last);

}  // namespace duet::farm
