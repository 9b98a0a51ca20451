// The results of a study: a row for every setting, and conclusions from them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/study/spec.h"

namespace duet::study {

// The cost of one stage of the time step.
struct StageCost {
  std::string name;
  double seconds = 0;  // per simulated second
  double calls = 0;    // per simulated second
};

// The result of one setting of the scene. Costs are per simulated second. Numbers that a failed or untimed
// run does not give are NaN.
struct Row {
  std::string line;              // name of the knob; "shipped", "reference", or "without" for an effect
  std::string label;             // text of the setting
  std::optional<double> number;  // value of the knob, if it is a number
  bool failed = false;           // a repetition of the setting failed
  std::string error;             // message of the failure
  double seconds = 0, seconds_least = 0, seconds_most = 0;  // median, least and greatest of the repetitions
  double steps = 0, iterations = 0, count = 0;  // substeps, CG iterations, and the cost by Spec::count
  std::int64_t unknowns = 0;                    // velocities that are solved for
  std::vector<double> errors;                   // by measure
  std::vector<StageCost> stages;                // of the median repetition
  std::string hash;                             // of the last state, 16 hexadecimal digits
  std::string picture;                          // path of a PNG file; empty: none
};

// The influence of one effect on the scene.
struct EffectRow {
  std::string effect, reason;  // name of the effect; why the scene needs it or not
  bool active = false;         // the scene needs the effect
  Row without;                 // result without it, if it is active
  // m, state_difference() of the last state with and without it; NaN if it is not active.
  double difference = 0;
};

// The order of convergence of a measure along a knob, fitted to `points` results.
struct FittedOrder {
  std::string line, measure;  // names of the knob and of the measure
  // Exponent p of error ~ size^p, for the time step or the size of cells.
  double order = 0;
  int points = 0;  // number of fitted settings
};

// The lowest cost of an error that is ten times smaller than that of the shipped setting.
struct TenTimes {
  // Name of the measure.
  std::string measure;
  std::string line;    // knob that reaches it at the lowest cost; empty: none does
  double factor = 0;   // cost over that of the shipped setting: in seconds, or by Spec::count if untimed
  double shipped = 0;  // error of the shipped setting
  bool exact = false;  // the shipped setting has no error beyond rounding
  bool extrapolated = false;  // beyond the last value of the knob, along the slope of its errors
};

// Everything that a study found.
struct Results {
  Spec spec;                        // the study
  std::string version, machine;     // of the program and the machine that simulated
  int processor = -1;               // number of the processor that timed runs were bound to; -1: none
  bool timed = true;                // seconds were measured
  double simulated = 0;             // s, simulated time of each run
  Row shipped;                      // the scene as it ships, with the changes of the study
  std::optional<Row> reference;     // empty: the study has none
  std::vector<Row> rows;            // settings, knob after knob
  std::vector<EffectRow> effects;   // empty unless Spec::effects
  std::vector<FittedOrder> orders;  // by conclude()
  std::vector<TenTimes> ten_times;  // by conclude(), one for each measure
};

// Computes `orders` and `ten_times` from the rows.
void conclude(Results& results);

// Returns all rows as CSV with a head line.
std::string csv(const Results& results);
// Returns everything as a JSON document; NaN becomes null.
std::string json(const Results& results);
// Returns the rows and conclusions as text for a terminal.
std::string table(const Results& results);

// Returns a number with three significant digits, as a whole number from 100 to 1e6; "-" if it is not finite.
std::string number_text(double value);

}  // namespace duet::study
