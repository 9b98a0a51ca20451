// Seconds by stage, as bars.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/study/charts.h"

namespace duet::study {

using StageSeconds = std::vector<std::pair<std::string, double>>;  // name and seconds

// Whether the stage's seconds are counted in those of other stages already (sim/step/stage_table.h).
bool is_part_of_another(const std::string& stage);

// The stages that are no part of others, and "other": what is left of `total`.
StageSeconds with_rest(StageSeconds seconds, double total);

// A bar each; stages that never take more than a hundredth of a bar go into "other".
BarChart stage_chart(const std::string& name, const std::string& title, const std::string& y_label,
                     const std::vector<std::pair<std::string, StageSeconds>>& bars);

}  // namespace duet::study
