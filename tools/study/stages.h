// Charts of the seconds of each stage.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/study/charts.h"

namespace duet::study {

using StageSeconds = std::vector<std::pair<std::string, double>>;  // names and seconds

// Returns whether the seconds of a stage are contained in those of other stages (Timing::within_others in
// sim/step/stage_table.h).
bool is_part_of_another(const std::string& stage);

// Returns the stages that are not contained in others, and "other": the rest of `total`.
StageSeconds with_rest(StageSeconds seconds, double total);

// Makes a chart with one bar for each of `bars`. Stages that take at most a hundredth of every bar are added
// to "other".
BarChart stage_chart(const std::string& name, const std::string& title, const std::string& y_label,
                     const std::vector<std::pair<std::string, StageSeconds>>& bars);

}  // namespace duet::study
