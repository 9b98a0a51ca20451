#include "tools/study/stages.h"

#include <algorithm>
#include <string_view>

#include "sim/step/stage_table.h"

namespace duet::study {
namespace {

// Smallest fraction of a bar that a stage of its own takes; a larger one makes fewer, larger parts.
constexpr double min_share = 0.01;
constexpr const char* rest = "other";

double sum(const StageSeconds& seconds) {
  double total = 0;
  for (const auto& [name, value] : seconds) total += value;
  return total;
}

}  // namespace

bool is_part_of_another(const std::string& stage) {
  return std::any_of(stage_rows.begin(), stage_rows.end(), [&](const StageRow& row) {
    return row.timing == Timing::within_others && row.label == stage;
  });
}

StageSeconds with_rest(StageSeconds seconds, double total) {
  std::erase_if(seconds, [](const auto& stage) { return is_part_of_another(stage.first); });
  seconds.emplace_back(rest, std::max(0.0, total - sum(seconds)));
  return seconds;
}

BarChart stage_chart(const std::string& name, const std::string& title, const std::string& y_label,
                     const std::vector<std::pair<std::string, StageSeconds>>& bars) {
  BarChart chart{name, title, y_label, {}, {}, {}};
  for (const auto& [bar, seconds] : bars) {
    const double total = sum(seconds);
    for (const auto& [stage, value] : seconds)
      if (stage != rest && value > min_share * total &&
          std::find(chart.parts.begin(), chart.parts.end(), stage) == chart.parts.end())
        chart.parts.push_back(stage);
  }
  chart.parts.emplace_back(rest);
  for (const auto& [bar, seconds] : bars) {
    chart.names.push_back(bar);
    std::vector<double> values(chart.parts.size(), 0);
    for (const auto& [stage, value] : seconds) {
      const auto part = std::find(chart.parts.begin(), chart.parts.end(), stage);
      values[part == chart.parts.end() ? values.size() - 1
                                       : static_cast<std::size_t>(part - chart.parts.begin())] += value;
    }
    chart.values.push_back(std::move(values));
  }
  return chart;
}

}  // namespace duet::study
