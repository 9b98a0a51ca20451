#include "tools/farm/collect.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "tools/farm/status.h"
#include "tools/sheet.h"
#include "tools/study/charts.h"
#include "tools/study/page.h"
#include "tools/study/results.h"
#include "tools/study/run_result.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_folder.h"
#include "sim/io/run_journal.h"

namespace duet::farm {
namespace {

constexpr int thumbnail_width = 320;      // pixels; smallest width of a picture on the sheet
constexpr std::size_t max_lines = 16;     // lines of a chart that can be told apart
constexpr std::size_t max_on_page = 200;  // pictures on the page; the sheet has all

// The error of a variation whose folder holds another run.
constexpr const char* other_settings = "the folder holds a run of another scene or other settings";

double number(const nlohmann::json& frame, const char* key) { return frame.at(key).get<double>(); }
double energy(const nlohmann::json& frame) {
  return number(frame, "kinetic") + number(frame, "potential") + number(frame, "elastic");
}

// Returns the numbers of results(), in that order.
std::vector<double> numbers_of(const std::vector<nlohmann::json>& frames) {
  double substeps = 0, seconds = 0, penetration = 0, stretch = 0, volume = 0;
  double drawn = std::numeric_limits<double>::quiet_NaN();  // none: what is drawn touches
  double det = std::numeric_limits<double>::infinity();
  for (const nlohmann::json& frame : frames) {
    substeps += number(frame, "substeps");
    seconds += number(frame, "seconds");
    penetration = std::max(penetration, number(frame, "max_penetration"));
    if (frame.contains("drawn_penetration")) drawn = std::fmax(drawn, number(frame, "drawn_penetration"));
    stretch = std::max(stretch, number(frame, "max_stretch"));
    volume = std::max(volume, number(frame, "volume_error"));
    det = std::min(det, number(frame, "min_det_F"));
  }
  const nlohmann::json& last = frames.back();
  return {number(last, "time"),
          substeps,
          seconds,
          penetration,
          drawn,
          stretch,
          det,
          volume,
          number(last, "kinetic"),
          number(last, "potential"),
          number(last, "elastic"),
          energy(last) - energy(frames.front())};
}

// Returns the newest picture of a run; empty if there is none.
fs::path last_picture(const io::RunDirectory& run) {
  int last = -1;
  for (const fs::path& file : io::files_in(run.image(0).parent_path()))
    if (io::holds_bytes(file)) last = std::max(last, io::frame_of_file(file, ".png"));
  return last < 0 ? fs::path() : run.image(last);
}

// Returns why the simulation of a run failed, as its task left it; empty if it did not.
std::string failure_of(const std::vector<TaskState>& tasks, std::size_t index) {
  const std::string name = fmt::format("simulate-{}", index + 1);
  const auto task = std::lower_bound(tasks.begin(), tasks.end(), name,
                                     [](const TaskState& a, const std::string& b) { return a.name < b; });
  if (task == tasks.end() || task->name != name || !task->has_failed()) return {};
  return fmt::format("status {} on {}: {}", task->status, task->node, task->last_line);
}

// Returns a field of CSV.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string escaped;
  for (const char c : text) escaped += c == '"' ? std::string("\"\"") : std::string(1, c);
  return '"' + escaped + '"';
}

std::optional<double> parse_number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

// Returns the values of a run as text: "friction=0.2, seed=3".
std::string label(const PlannedRun& run, std::size_t first = 0) {
  std::string text;
  for (std::size_t i = first; i < run.values.size(); ++i)
    text += fmt::format("{}{}={}", text.empty() ? "" : ", ", run.values[i].first, run.values[i].second);
  return text;
}

// Returns a chart of a result over the first key, if its values are numbers, or over the number of the run.
// Runs that differ in the first key only are a line.
study::Chart chart_of(const std::vector<VariationResult>& rows, std::size_t index) {
  study::Chart chart;
  chart.name = results()[index].name;
  chart.title = chart.y_label = results()[index].title;
  const bool has_numbers = std::all_of(rows.begin(), rows.end(), [](const VariationResult& row) {
    return parse_number(row.run->values.front().second).has_value();
  });
  std::map<std::string, study::Series> lines;
  std::set<std::string> others;
  for (const VariationResult& row : rows) others.insert(has_numbers ? label(*row.run, 1) : "");
  const bool is_split = has_numbers && others.size() <= max_lines;
  chart.x_label = has_numbers ? rows.front().run->values.front().first : "number of the run";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const VariationResult& row = rows[i];
    if (row.state == "failed") chart.failed.push_back(label(*row.run));
    if (row.frames < 0) continue;
    const std::string name = is_split ? label(*row.run, 1) : "";
    study::Series& line =
        lines.try_emplace(name, study::Series{name.empty() ? "runs" : name, {}, is_split}).first->second;
    line.points.push_back(
        {has_numbers ? *parse_number(row.run->values.front().second) : static_cast<double>(i + 1),
         row.numbers[index],
         {}});
  }
  for (auto& [name, line] : lines) {
    std::stable_sort(line.points.begin(), line.points.end(),
                     [](const auto& a, const auto& b) { return a.x < b.x; });
    chart.series.push_back(std::move(line));
  }
  return chart;
}

study::Chart energy_chart(const std::vector<VariationResult>& rows) {
  study::Chart chart;
  chart.name = "energy";
  chart.title = "Total energy";
  chart.x_label = "simulated time (s)";
  chart.y_label = "J";
  for (const VariationResult& row : rows) {
    study::Series line{label(*row.run), {}, true};
    for (const auto& [time, joules] : row.energy) line.points.push_back({time, joules, {}});
    if (!line.points.empty()) chart.series.push_back(std::move(line));
  }
  return chart;
}

// Returns the last picture of a variation, at most twice as wide as the thumbnails.
render::Picture thumbnail(const VariationResult& row) {
  render::Picture picture = render::read_picture(row.picture);
  const int factor = picture.width / thumbnail_width;
  return factor < 2 ? picture : tools::shrunk(picture, factor);
}

// Writes the last pictures of all variations onto one sheet, and those for the page into `folder`. Returns
// the latter.
std::vector<study::Page::Picture> write_pictures(const std::vector<VariationResult>& rows,
                                                 const fs::path& folder, const fs::path& sheet_file) {
  std::vector<study::Page::Picture> pictures;
  std::vector<render::Picture> on_sheet;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].picture.empty()) continue;
    render::Picture small = thumbnail(rows[i]);
    if (pictures.size() < max_on_page) {
      const fs::path file = folder / fmt::format("run-{:04}.png", i + 1);
      render::write_png(file.string(), small.width, small.height, small.rgb);
      pictures.push_back({file, fmt::format("{}: {}", i + 1, label(*rows[i].run))});
    }
    if (on_sheet.empty() ||
        (small.width == on_sheet.front().width && small.height == on_sheet.front().height))
      on_sheet.push_back(std::move(small));
  }
  if (on_sheet.empty()) return pictures;
  tools::Sheet sheet(static_cast<int>(on_sheet.size()), on_sheet.front().width, on_sheet.front().height);
  for (const render::Picture& picture : on_sheet) sheet.add(picture.rgb);
  render::write_png(sheet_file.string(), sheet.picture().width, sheet.picture().height, sheet.picture().rgb);
  return pictures;
}

void add_table(const std::vector<VariationResult>& rows, study::Page& page) {
  std::vector<std::vector<std::string>> table(1, {"run"});
  for (const auto& [key, value] : rows.front().run->values) table[0].push_back(key);
  for (const char* head : {"state", "frames"}) table[0].emplace_back(head);
  for (const Result& result : results()) table[0].emplace_back(result.title);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<std::string> line = {std::to_string(i + 1)};
    for (const auto& [key, value] : rows[i].run->values) line.push_back(value);
    line.push_back(rows[i].state);
    line.push_back(std::to_string(std::max(rows[i].frames, 0)));
    if (!rows[i].error.empty())
      line.push_back(rows[i].error);
    else
      for (const double value : rows[i].numbers) line.push_back(study::number_text(value));
    table.push_back(std::move(line));
  }
  page.table(table);
}

}  // namespace

const std::vector<Result>& results() {
  static const std::vector<Result> list = {
      {"simulated_s", "simulated time (s)"},
      {"substeps", "substeps"},
      {"seconds", "seconds of simulation"},
      {"max_penetration", "deepest penetration (m)"},
      {"drawn_penetration", "that of drawn surfaces that do not touch (m)"},
      {"max_stretch", "largest principal stretch"},
      {"min_det_F", "smallest determinant of F"},
      {"volume_error", "largest relative error of volume"},
      {"kinetic", "kinetic energy at the end (J)"},
      {"potential", "energy of gravity at the end (J)"},
      {"elastic", "elastic energy at the end (J)"},
      {"energy_change", "change of the total energy (J)"}};
  return list;
}

std::vector<VariationResult> read_results(const Plan& plan) {
  const std::vector<TaskState> tasks = task_states(plan);
  std::vector<VariationResult> rows;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    VariationResult row;
    row.run = &plan.runs[i];
    row.error = failure_of(tasks, i);
    row.numbers.assign(results().size(), NAN);
    const io::RunDirectory run{plan.runs[i].folder};
    try {
      if (holds_other_run(plan.runs[i])) {
        row.error = other_settings;
      } else if (!io::held_run(run).is_empty()) {
        const std::vector<nlohmann::json> frames = study::read_stats(run.root);
        row.frames = static_cast<int>(frames.size()) - 1;
        row.numbers = numbers_of(frames);
        row.hash = frames.back().at("hash").get<std::string>();
        for (const nlohmann::json& frame : frames)
          row.energy.emplace_back(number(frame, "time"), energy(frame));
        row.picture = last_picture(run);
      }
    } catch (const FileError& error) {
      if (row.error.empty()) row.error = error.what();
    } catch (const nlohmann::json::exception& error) {
      if (row.error.empty()) row.error = fmt::format("{}: {}", run.stats().string(), error.what());
    }
    row.state = !row.error.empty() ? "failed" : row.frames >= plan.runs[i].frames ? "done" : "unfinished";
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string results_csv(const Plan& plan, const std::vector<VariationResult>& rows) {
  std::string text = "run,folder";
  for (const auto& [key, value] : plan.runs.front().values) text += fmt::format(",{}", field(key));
  text += ",state,error,frames";
  for (const Result& result : results()) text += fmt::format(",{}", result.name);
  text += ",hash\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const VariationResult& row = rows[i];
    text += fmt::format("{},{}", i + 1, field(row.run->folder.string()));
    for (const auto& [key, value] : row.run->values) text += fmt::format(",{}", field(value));
    text += fmt::format(",{},{},{}", row.state, field(row.error), row.frames);
    for (const double value : row.numbers) text += std::isfinite(value) ? fmt::format(",{}", value) : ",";
    text += fmt::format(",{}\n", row.hash);
  }
  return text;
}

std::vector<fs::path> collect(const Plan& plan, const std::vector<VariationResult>& rows) {
  const fs::path table = plan.folder / "results.csv", sheet = plan.folder / "sheet.png",
                 file = plan.folder / "results.html", charts = plan.folder / "charts";
  io::create_folder(charts);
  io::write_atomically(table, results_csv(plan, rows));
  std::vector<fs::path> written = {table};
  const std::vector<study::Page::Picture> pictures = write_pictures(rows, charts, sheet);
  if (!pictures.empty()) written.push_back(sheet);
  study::Page page(fmt::format("{}: {} variations", plan.name, rows.size()));
  page.heading("Results");
  add_table(rows, page);
  if (!pictures.empty()) {
    page.heading("Last pictures");
    page.pictures(pictures);
  }
  page.heading("Charts");
  for (std::size_t i = 0; i < results().size(); ++i) {
    const auto values = [&](const VariationResult& row) { return row.numbers[i]; };
    const auto same = [&](const VariationResult& row) {
      return !std::isfinite(values(row)) || values(row) == values(rows.front());
    };
    if (!std::all_of(rows.begin(), rows.end(), same)) page.chart(study::draw(chart_of(rows, i), charts));
  }
  if (const study::Chart chart = energy_chart(rows);
      !chart.series.empty() && chart.series.size() <= max_lines)
    page.chart(study::draw(chart, charts));
  io::write_atomically(file, page.html());
  written.push_back(file);
  return written;
}

}  // namespace duet::farm
