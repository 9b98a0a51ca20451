#include "tools/study/study_page.h"

#include <algorithm>
#include <cmath>

#include "tools/study/charts.h"
#include "tools/study/page.h"
#include "tools/study/stages.h"
#include <fmt/format.h>

namespace duet::study {
namespace {

namespace fs = std::filesystem;

std::string with_unit(const Measure& measure) {
  const std::string unit = unit_of(measure.kind);
  return unit.empty() ? measure.name : fmt::format("{} ({})", measure.name, unit);
}

// Returns the name of the cost that does not depend on the machine.
std::string count_name(const Results& results) {
  if (results.spec.cost == Cost::drawing) return "samples of pixels and shadow maps per picture";
  return results.spec.count == Count::steps ? "substeps per simulated second"
                                            : "(substeps + CG iterations) x unknowns per simulated second";
}

// Returns the text with characters that file names may lack replaced by underscores.
std::string file_name(std::string text) {
  for (char& c : text)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
  return text;
}

std::string seconds_name(const Results& results) {
  return results.spec.cost == Cost::drawing ? "processor seconds per picture"
                                            : "processor seconds per simulated second";
}

// What the cost of a setting is measured in.
enum class CostIn { seconds, counts };

// Returns the chart of error against cost for measure `m`: one line for each knob, and a point for the
// shipped setting.
Chart precision_chart(const Results& results, std::size_t m, CostIn cost_in) {
  const bool seconds = cost_in == CostIn::seconds;
  const Measure& measure = results.spec.measures[m];
  Chart chart;
  chart.name = file_name(measure.name) + (seconds ? "_seconds" : "_count");
  chart.title = fmt::format("{}: {}", results.spec.title, measure.name);
  chart.x_label = seconds ? seconds_name(results) : count_name(results);
  chart.y_label = "error: " + with_unit(measure);
  chart.log_x = chart.log_y = true;
  const auto cost = [&](const Row& row) { return seconds ? row.seconds : row.count; };
  for (const Knob& knob : results.spec.knobs) {
    Series series{knob.name, {}, true};
    for (const Row& row : results.rows) {
      if (row.line != knob.name) continue;
      if (row.failed)
        chart.failed.push_back(fmt::format("{} {}", row.line, row.label));
      else
        series.points.push_back({cost(row), row.errors[m], row.label});
    }
    chart.series.push_back(std::move(series));
  }
  if (!results.shipped.failed)
    chart.series.push_back(
        {"shipped setting", {{cost(results.shipped), results.shipped.errors[m], ""}}, false});
  return chart;
}

// Returns whether any setting has an error beyond rounding.
bool has_error(const Results& results, std::size_t m) {
  const auto is_error = [&](const Row& row) { return row.errors[m] > results.spec.measures[m].floor; };
  return is_error(results.shipped) || std::any_of(results.rows.begin(), results.rows.end(), is_error);
}

// Adds the cost of a ten times smaller error.
void add_answers(Page& page, const Results& results) {
  for (const TenTimes& answer : results.ten_times) {
    if (std::isnan(answer.shipped)) continue;
    if (answer.exact)
      page.text(fmt::format("{}: exact but for rounding as shipped ({}).", answer.measure,
                            number_text(answer.shipped)));
    else if (answer.line.empty())
      page.text(fmt::format("{}: no setting here makes it ten times smaller than the {} of the shipped one.",
                            answer.measure, number_text(answer.shipped)));
    else
      page.text(fmt::format(
          "{}: ten times less than the {} of the shipped setting costs {:.3g} times as much {}, by {}{}.",
          answer.measure, number_text(answer.shipped), answer.factor, results.timed ? "time" : "work",
          answer.line, answer.extrapolated ? " (extrapolated along its slope)" : ""));
  }
}

// Returns the cells of a row of the table.
std::vector<std::string> cells_of(const Row& row) {
  std::vector<std::string> cells = {row.line, row.label};
  if (row.failed) {
    cells.insert(cells.end(), {"failed", row.error});
    return cells;
  }
  cells.push_back(std::isfinite(row.seconds_least) && row.seconds_least < row.seconds_most
                      ? fmt::format("{} ({} - {})", number_text(row.seconds), number_text(row.seconds_least),
                                    number_text(row.seconds_most))
                      : number_text(row.seconds));
  for (const double value : {row.steps, row.iterations}) cells.push_back(number_text(value));
  for (const double error : row.errors) cells.push_back(number_text(error));
  return cells;
}

void add_rows(Page& page, const Results& results) {
  std::vector<std::vector<std::string>> rows = {
      {"line", "setting", seconds_name(results), "substeps", "CG iterations"}};
  for (const Measure& measure : results.spec.measures) rows[0].push_back(with_unit(measure));
  rows.push_back(cells_of(results.shipped));
  if (results.reference) rows.push_back(cells_of(*results.reference));
  for (const Row& row : results.rows) rows.push_back(cells_of(row));
  page.heading("All settings");
  page.text("Seconds with the range of the repetitions; substeps and iterations per simulated second.");
  page.table(rows);
}

void add_orders(Page& page, const Results& results) {
  if (results.orders.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"along", "measure", "order", "points"}};
  for (const FittedOrder& order : results.orders)
    rows.push_back(
        {order.line, order.measure, fmt::format("{:.2f}", order.order), std::to_string(order.points)});
  page.heading("Orders of convergence");
  page.text("Slopes of the errors over the time step or the size of cells, by least squares on logarithms.");
  page.table(rows);
}

void add_stages(Page& page, const Results& results, const fs::path& folder) {
  std::vector<std::pair<std::string, const Row*>> rows;
  const auto add = [&](const std::string& name, const Row& row) {
    if (!row.failed && std::isfinite(row.seconds)) rows.emplace_back(name, &row);
  };
  add("shipped", results.shipped);
  for (std::size_t i = 0; i < results.rows.size(); ++i) {
    const Row& row = results.rows[i];
    const bool first = i == 0 || results.rows[i - 1].line != row.line;
    const bool last = i + 1 == results.rows.size() || results.rows[i + 1].line != row.line;
    if (first || last) add(fmt::format("{}: {}", row.line, row.label), row);
  }
  if (rows.empty()) return;
  std::vector<std::pair<std::string, StageSeconds>> bars;
  for (const auto& [name, row] : rows) {
    StageSeconds seconds;
    for (const StageCost& stage : row->stages) seconds.emplace_back(stage.name, stage.seconds);
    bars.emplace_back(name, with_rest(std::move(seconds), row->seconds));
  }
  page.heading("Where the time goes");
  page.text("The shipped setting, and the first and the last value of every knob.");
  page.chart(draw(stage_chart("stages", "Seconds by stage", "processor seconds per simulated second", bars),
                  folder));
  std::vector<std::vector<std::string>> cells = {{"stage, shipped setting", "seconds", "share", "calls"}};
  for (const StageCost& stage : results.shipped.stages)
    if (stage.calls > 0)
      cells.push_back({stage.name + (is_part_of_another(stage.name) ? " (within others)" : ""),
                       number_text(stage.seconds),
                       fmt::format("{:.1f}%", 100 * stage.seconds / results.shipped.seconds),
                       number_text(stage.calls)});
  page.table(cells);
}

void add_effects(Page& page, const Results& results) {
  if (results.effects.empty()) return;
  std::vector<std::vector<std::string>> rows = {
      {"effect", "seconds without it", "its cost", "difference in the result (m)"}};
  for (const Measure& measure : results.spec.measures) rows[0].push_back(with_unit(measure) + " without it");
  for (const EffectRow& effect : results.effects) {
    if (!effect.active) continue;
    if (effect.without.failed) {
      rows.push_back({effect.effect, "failed", effect.without.error});
      continue;
    }
    rows.push_back({effect.effect, number_text(effect.without.seconds),
                    number_text(results.shipped.seconds - effect.without.seconds),
                    number_text(effect.difference)});
    for (const double error : effect.without.errors) rows.back().push_back(number_text(error));
  }
  page.heading("What each effect costs and does");
  page.text(
      "The scene simulated without one effect at a time. A negative cost means that the rest has more to do "
      "without it.");
  page.table(rows);
  std::vector<std::vector<std::string>> absent = {{"not called for: 0 calls", "why"}};
  for (const EffectRow& effect : results.effects)
    if (!effect.active) absent.push_back({effect.effect, effect.reason});
  if (absent.size() > 1) page.table(absent);
}

void add_pictures(Page& page, const Results& results) {
  std::vector<Page::Picture> pictures;
  const auto add = [&](const Row& row) {
    if (!row.picture.empty())
      pictures.push_back(
          {row.picture, row.line == row.label ? row.line : fmt::format("{}: {}", row.line, row.label)});
  };
  if (results.reference) add(*results.reference);
  add(results.shipped);
  for (const Row& row : results.rows) add(row);
  if (pictures.size() < 2) return;
  page.heading("The last frame side by side");
  page.pictures(pictures);
}

}  // namespace

std::string study_page(const Results& results, const fs::path& charts) {
  Page page(results.spec.title);
  if (!results.spec.about.empty()) page.text(results.spec.about);
  page.text(fmt::format(
      "Scene {}, {:.6g} s simulated. {} duet {}; {}.", results.spec.scene, results.simulated,
      results.timed
          ? fmt::format("Seconds are medians of {} runs, each alone with one thread on processor {}, without "
                        "file output.",
                        results.spec.repetitions, results.processor)
          : std::string("Runs were not timed."),
      results.version, results.machine));
  add_answers(page, results);
  page.heading("Error against cost");
  for (std::size_t m = 0; m < results.spec.measures.size(); ++m) {
    if (!has_error(results, m)) {
      page.text(fmt::format("{}: zero, or no more than rounding, wherever it could be measured.",
                            results.spec.measures[m].name));
      continue;
    }
    if (results.timed) page.chart(draw(precision_chart(results, m, CostIn::seconds), charts));
    page.chart(draw(precision_chart(results, m, CostIn::counts), charts));
  }
  add_orders(page, results);
  add_rows(page, results);
  if (results.timed && results.spec.cost == Cost::simulation) add_stages(page, results, charts);
  add_effects(page, results);
  add_pictures(page, results);
  return page.html();
}

}  // namespace duet::study
