// What a study found: a row for every setting, and what follows from them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/study/spec.h"

namespace duet::study {

struct StageCost {
  std::string name;
  double seconds = 0;  // per simulated second
  double calls = 0;    // the same
};

// A setting of the scene. Costs are per simulated second; what a failed or untimed run does not tell is NaN.
struct Row {
  std::string line;  // knob; "shipped", "reference", or "without" of an effect
  std::string label;
  std::optional<double> number;  // of the knob's value
  bool failed = false;
  std::string error;
  double seconds = 0, seconds_least = 0, seconds_most = 0;  // median and range of the repetitions
  double steps = 0, iterations = 0, count = 0;              // substeps, of conjugate gradients, Spec::count
  std::int64_t unknowns = 0;
  std::vector<double> errors;  // of the measures
  std::vector<StageCost> stages;
  std::string hash;     // of the last state, 16 hexadecimal digits
  std::string picture;  // path of a PNG file; may be empty
};

// How an effect changes the scene: NaN and 0 calls for those that the scene does not call for.
struct EffectRow {
  std::string effect, reason;
  bool active = false;
  Row without;            // of an active one
  double difference = 0;  // m, of the last state with and without it
};

struct FittedOrder {
  std::string line, measure;
  double order = 0;
  int points = 0;
};

// The least cost of a ten times smaller error than the shipped setting has, over the cost of the latter.
struct TenTimes {
  std::string measure;
  std::string line;           // of the cheapest way there; empty: no setting gets there
  double factor = 0;          // of seconds, or of Spec::count where there are none
  double shipped = 0;         // its error
  bool exact = false;         // no more than rounding already
  bool extrapolated = false;  // along the line's slope, from its last setting
};

struct Results {
  Spec spec;
  std::string version, machine;
  int processor = -1;  // that timed runs were bound to
  bool timed = true;
  double simulated = 0;  // s
  Row shipped;
  std::optional<Row> reference;
  std::vector<Row> rows;  // knob after knob
  std::vector<EffectRow> effects;
  std::vector<FittedOrder> orders;
  std::vector<TenTimes> ten_times;
};

// Fills in orders and ten_times.
void conclude(Results& results);

std::string csv(const Results& results);
std::string json(const Results& results);
std::string table(const Results& results);  // for a terminal

std::string number_text(double value);  // three digits; "-" for NaN

}  // namespace duet::study
