// Measures the errors of a run's result.
#pragma once

#include "tools/study/run_result.h"
#include "tools/study/spec.h"

namespace duet::study {

// Returns the error of `result` by `measure`, in the unit of the measure's kind (unit_of()). `reference` may
// be null unless needs_reference(kind). NaN for the kind `state` if the reference has other meshes. Throws
// Error (usage) that names the measure if the scene does not fit it.
double evaluate(const Measure& measure, const RunResult& result, const RunResult* reference);

// Returns the root mean square distance (m) between two states of scenes with the same bodies. The distance
// of deformable bodies is the mean over their particles by mass; that of rigid ones is over six points on
// their axes, and over the center alone for balls. `body` is the name of one body; empty: the mean over all
// bodies that can move.
double state_difference(const World& a, const World& b, const std::string& body);

}  // namespace duet::study
