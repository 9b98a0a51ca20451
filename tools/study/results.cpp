#include "tools/study/results.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace duet::study {
namespace {

using Json = nlohmann::ordered_json;

// A setting in the diagram of error against cost. For orders, `cost` holds the time step or the size of
// cells.
struct Point {
  double cost, error;
};

// Returns the slope of log(error) over log(cost), by least squares.
double slope(const std::vector<Point>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const Point& point : points) {
    x += std::log(point.cost) / static_cast<double>(points.size());
    y += std::log(point.error) / static_cast<double>(points.size());
  }
  for (const Point& point : points) {
    const double dx = std::log(point.cost) - x;
    xx += dx * dx;
    xy += dx * (std::log(point.error) - y);
  }
  return xy / xx;
}

// Fits the order of every measure along every knob that has one. Two points or more are needed.
void fit_orders(Results& results) {
  for (const Knob& knob : results.spec.knobs) {
    if (knob.order == OrderOf::none) continue;
    for (std::size_t m = 0; m < results.spec.measures.size(); ++m) {
      std::vector<Point> points;
      for (const Row& row : results.rows) {
        if (row.line != knob.name || row.failed || !(row.errors[m] > results.spec.measures[m].floor))
          continue;
        const double size = knob.order == OrderOf::steps ? 1 / row.steps : 1 / row.number.value_or(NAN);
        if (std::isfinite(size)) points.push_back({size, row.errors[m]});
      }
      if (points.size() >= 2)
        results.orders.push_back(
            {knob.name, results.spec.measures[m].name, slope(points), static_cast<int>(points.size())});
    }
  }
}

// Returns the cost of a setting: seconds, or the count if runs were not timed.
double cost_of(const Results& results, const Row& row) { return results.timed ? row.seconds : row.count; }

// Returns the cost at which the error is `target`, on the straight line between two settings in the
// logarithmic diagram.
double cost_between(const Point& a, const Point& b, double target) {
  const double share = std::log(target / a.error) / std::log(b.error / a.error);
  return a.cost * std::pow(b.cost / a.cost, share);
}

// Extrapolates the errors of knobs that change the time step to `target`, if no setting reaches it. Only
// knobs with three points and an order above 1/2 count, at most a factor of ten beyond the error of their
// last value.
void extrapolate(const Results& results, std::size_t m, double target, TenTimes& answer) {
  // A smaller least order admits errors that hardly fall; a larger factor `farthest` extrapolates farther.
  constexpr double min_order = 0.5, farthest = 10;
  for (const Knob& knob : results.spec.knobs) {
    if (knob.order != OrderOf::steps) continue;
    std::vector<Point> points;
    for (const Row& row : results.rows)
      if (row.line == knob.name && !row.failed && row.errors[m] > results.spec.measures[m].floor)
        points.push_back({cost_of(results, row), row.errors[m]});
    if (points.size() < 3) continue;
    const double order = -slope(points);
    const Point& best = points.back();
    if (!(order > min_order) || best.error > farthest * target) continue;
    const double factor =
        best.cost * std::pow(best.error / target, 1 / order) / cost_of(results, results.shipped);
    if (factor >= answer.factor) continue;
    answer.line = knob.name;
    answer.factor = factor;
    answer.extrapolated = true;
  }
}

// Finds the lowest cost of a tenth of the shipped setting's error for measure `m`: among the settings,
// between neighbors on a knob, and by extrapolation.
TenTimes cheapest(const Results& results, std::size_t m) {
  TenTimes answer;
  answer.measure = results.spec.measures[m].name;
  answer.factor = std::numeric_limits<double>::infinity();
  answer.shipped =
      results.shipped.failed ? std::numeric_limits<double>::quiet_NaN() : results.shipped.errors[m];
  answer.exact = answer.shipped <= results.spec.measures[m].floor;
  if (answer.exact || results.shipped.failed) return answer;
  const double target = answer.shipped / 10, start = cost_of(results, results.shipped);
  const auto offer = [&](const std::string& line, double cost) {
    if (cost / start >= answer.factor) return;
    answer.line = line;
    answer.factor = cost / start;
  };
  for (std::size_t i = 0; i < results.rows.size(); ++i) {
    const Row& row = results.rows[i];
    if (row.failed || !(row.errors[m] > 0)) continue;
    const Point now{cost_of(results, row), row.errors[m]};
    if (now.error <= target) offer(row.line, now.cost);
    if (i == 0 || results.rows[i - 1].line != row.line || results.rows[i - 1].failed) continue;
    const Point before{cost_of(results, results.rows[i - 1]), results.rows[i - 1].errors[m]};
    if (before.error > 0 && (before.error - target) * (now.error - target) < 0)
      offer(row.line, cost_between(before, now, target));
  }
  if (answer.line.empty()) extrapolate(results, m, target, answer);
  return answer;
}

// Returns null for numbers that are not finite.
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json row_json(const Results& results, const Row& row) {
  Json errors = Json::object();
  for (std::size_t m = 0; m < row.errors.size(); ++m)
    errors[results.spec.measures[m].name] = number_json(row.errors[m]);
  Json stages = Json::object();
  for (const StageCost& stage : row.stages)
    stages[stage.name] = {{"seconds", number_json(stage.seconds)}, {"calls", stage.calls}};
  return {{"line", row.line},
          {"label", row.label},
          {"failed", row.failed},
          {"error", row.error},
          {"seconds", number_json(row.seconds)},
          {"seconds_least", number_json(row.seconds_least)},
          {"seconds_most", number_json(row.seconds_most)},
          {"steps", number_json(row.steps)},
          {"iterations", number_json(row.iterations)},
          {"unknowns", row.unknowns},
          {"count", number_json(row.count)},
          {"errors", errors},
          {"stages", stages},
          {"hash", row.hash},
          {"picture", row.picture}};
}

// Returns a cell of CSV, in quotes if needed.
std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

// Returns all rows in the order of the tables.
std::vector<const Row*> all_rows(const Results& results) {
  std::vector<const Row*> rows = {&results.shipped};
  if (results.reference) rows.push_back(&*results.reference);
  for (const Row& row : results.rows) rows.push_back(&row);
  for (const EffectRow& effect : results.effects)
    if (effect.active) rows.push_back(&effect.without);
  return rows;
}

}  // namespace

void conclude(Results& results) {
  fit_orders(results);
  for (std::size_t m = 0; m < results.spec.measures.size(); ++m)
    results.ten_times.push_back(cheapest(results, m));
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return "-";
  return std::abs(value) >= 100 && std::abs(value) < 1e6 ? fmt::format("{:.0f}", value)
                                                         : fmt::format("{:.3g}", value);
}

std::string csv(const Results& results) {
  std::string text =
      "line,setting,failed,seconds per simulated second,least,most,substeps per simulated second,"
      "CG iterations per simulated second,unknowns,count";
  for (const Measure& measure : results.spec.measures) {
    const std::string unit = unit_of(measure.kind);
    text += ',' + csv_text(unit.empty() ? measure.name : fmt::format("{} ({})", measure.name, unit));
  }
  text += ",message\n";
  for (const Row* row : all_rows(results)) {
    text += fmt::format("{},{},{}", csv_text(row->line), csv_text(row->label), row->failed ? "yes" : "no");
    const auto add = [&](double value) {
      text += std::isfinite(value) ? fmt::format(",{:.9g}", value) : ",";
    };
    for (const double value :
         {row->seconds, row->seconds_least, row->seconds_most, row->steps, row->iterations})
      add(value);
    text += fmt::format(",{}", row->unknowns);
    add(row->count);
    for (const double error : row->errors) add(error);
    text += ',' + csv_text(row->error) + '\n';
  }
  return text;
}

std::string json(const Results& results) {
  Json rows = Json::array(), effects = Json::array(), orders = Json::array(), ten_times = Json::array();
  for (const Row& row : results.rows) rows.push_back(row_json(results, row));
  for (const EffectRow& effect : results.effects) {
    effects.push_back({{"effect", effect.effect}, {"active", effect.active}, {"reason", effect.reason}});
    if (!effect.active) continue;
    effects.back()["difference"] = number_json(effect.difference);
    effects.back()["without"] = row_json(results, effect.without);
  }
  for (const FittedOrder& order : results.orders)
    orders.push_back({{"line", order.line},
                      {"measure", order.measure},
                      {"order", number_json(order.order)},
                      {"points", order.points}});
  for (const TenTimes& answer : results.ten_times)
    ten_times.push_back({{"measure", answer.measure},
                         {"line", answer.line},
                         {"factor", number_json(answer.factor)},
                         {"shipped", number_json(answer.shipped)},
                         {"exact", answer.exact},
                         {"extrapolated", answer.extrapolated}});
  Json units = Json::array();
  for (const Measure& measure : results.spec.measures) units.push_back(unit_of(measure.kind));
  const Json document = {{"title", results.spec.title},
                         {"scene", results.spec.scene},
                         {"version", results.version},
                         {"machine", results.machine},
                         {"processor", results.processor},
                         {"timed", results.timed},
                         {"repetitions", results.timed ? results.spec.repetitions : 1},
                         {"simulated", results.simulated},
                         {"units", units},
                         {"shipped", row_json(results, results.shipped)},
                         {"reference", results.reference ? row_json(results, *results.reference) : Json()},
                         {"rows", rows},
                         {"effects", effects},
                         {"orders", orders},
                         {"ten_times", ten_times}};
  return document.dump(1, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string table(const Results& results) {
  std::vector<std::vector<std::string>> cells = {{"line", "setting", "s/s", "substeps/s"}};
  for (const Measure& measure : results.spec.measures) {
    const std::string unit = unit_of(measure.kind);
    cells[0].push_back(unit.empty() ? measure.name : fmt::format("{} ({})", measure.name, unit));
  }
  for (const Row* row : all_rows(results)) {
    cells.push_back(
        {row->line, row->label, row->failed ? "failed" : number_text(row->seconds), number_text(row->steps)});
    for (const double error : row->errors) cells.back().push_back(number_text(error));
  }
  std::vector<std::size_t> widths(cells[0].size(), 0);
  for (const auto& row : cells)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text;
  for (const auto& row : cells) {
    for (std::size_t i = 0; i < row.size(); ++i)
      text += i < 2 ? fmt::format("{:<{}}  ", row[i], widths[i]) : fmt::format("{:>{}}  ", row[i], widths[i]);
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  for (const FittedOrder& order : results.orders)
    text += fmt::format("order of `{}` along `{}`: {:.2f} ({} points)\n", order.measure, order.line,
                        order.order, order.points);
  for (const TenTimes& answer : results.ten_times) {
    if (answer.exact)
      text += fmt::format("`{}` is exact but for rounding\n", answer.measure);
    else if (answer.line.empty())
      text += fmt::format("no setting makes `{}` ten times smaller than {}\n", answer.measure,
                          number_text(answer.shipped));
    else
      text += fmt::format("`{}` ten times smaller than {} costs {:.3g} times as much, by `{}`{}\n",
                          answer.measure, number_text(answer.shipped), answer.factor, answer.line,
                          answer.extrapolated ? " (extrapolated)" : "");
  }
  return text;
}

}  // namespace duet::study
