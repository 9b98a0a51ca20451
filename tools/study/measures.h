// Errors of a run's result.
#pragma once

#include "tools/study/run_result.h"
#include "tools/study/spec.h"

namespace duet::study {

// In the unit of the measure's kind; NaN for the kind `state` when the reference has other meshes.
// `reference` is null unless needs_reference(kind). Throws Error (usage) when the scene is not what the
// measure is about, with the measure's name.
double evaluate(const Measure& measure, const RunResult& result, const RunResult* reference);

// m, root of the mean square distance of bodies in two states of scenes with the same bodies: of a deformable
// one's particles by mass, of six points of a rigid one along its axes; `body`: one of them, empty: all that
// can move.
double state_difference(const World& a, const World& b, const std::string& body);

}  // namespace duet::study
