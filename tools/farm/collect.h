// Results of variations: a table as CSV, a contact sheet, and a page with charts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/farm/bodies.h"
#include "tools/farm/plan.h"

namespace duet::farm {

// The results of one variation.
struct VariationResult {
  const PlannedRun* run = nullptr;
  std::string state;            // "done", "unfinished" or "failed"
  std::string error;            // why it failed; empty: it did not
  int frames = -1;              // last frame that is simulated; -1: none
  std::vector<double> numbers;  // by results(); NaN if there is no frame
  std::string hash;             // of the last state
  std::vector<BodyResult> bodies;
  std::string no_bodies;  // why there are none, although there are frames; empty: they are there
  // Simulated time (s) and total energy (J) of every frame.
  std::vector<std::pair<double, double>> energy;
  fs::path picture;  // the last one; empty: none
};

// Returns the numbers of runs that tables and charts show, from the statistics of their frames.
const std::vector<Result>& results();

// Reads the results of all runs of the plan. A run that failed, or cannot be read, says why.
std::vector<VariationResult> read_results(const Plan& plan);

// Returns the results as CSV with a head line, a line for each variation.
std::string results_csv(const Plan& plan, const std::vector<VariationResult>& rows);

// Returns the results of bodies as CSV with a head line, a line for each body of each variation.
std::string bodies_csv(const Plan& plan, const std::vector<VariationResult>& rows);

// Writes results.csv, bodies.csv, sheet.png (if there are pictures) and results.html into the folder of the
// farm. Returns their paths. Throws FileError.
std::vector<fs::path> collect(const Plan& plan, const std::vector<VariationResult>& rows);

}  // namespace duet::farm
