#include "tools/farm/collect.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
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

constexpr int thumbnail_width = 320;       // pixels; smallest width of a picture on the sheet
constexpr std::size_t max_lines = 16;      // lines of a chart that can be told apart
constexpr std::size_t max_bodies = 6;      // bodies in tables and charts of the page; bodies.csv has all
constexpr double least_difference = 1e-6;  // m, m/s, rad/s; of bodies; smaller ones count as none
constexpr std::size_t max_on_page = 200;   // pictures on the page; the sheet has all

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

// A number of each variation, of which a chart shows one or several.
struct Shown {
  std::string name;  // in the legend; empty: the chart has no other
  std::function<double(const VariationResult&)> number;
};

// Returns a chart over the first key, if its values are numbers, or over the number of the run. Runs that
// differ in the first key only are a line, as far as the lines can be told apart.
study::Chart chart_of(const std::vector<VariationResult>& rows, const Result& result,
                      const std::vector<Shown>& shown) {
  study::Chart chart;
  chart.name = result.name;
  chart.title = chart.y_label = result.title;
  const bool has_numbers = std::all_of(rows.begin(), rows.end(), [](const VariationResult& row) {
    return parse_number(row.run->values.front().second).has_value();
  });
  std::map<std::string, study::Series> lines;
  std::set<std::string> others;
  for (const VariationResult& row : rows) others.insert(has_numbers ? label(*row.run, 1) : "");
  const bool is_split = has_numbers && others.size() * shown.size() <= max_lines;
  chart.x_label = has_numbers ? rows.front().run->values.front().first : "number of the run";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const VariationResult& row = rows[i];
    if (row.state == "failed") chart.failed.push_back(label(*row.run));
    if (row.frames < 0) continue;
    for (const Shown& one : shown) {
      std::string name = is_split ? label(*row.run, 1) : "";
      if (!one.name.empty()) name = one.name + (name.empty() ? "" : ": " + name);
      study::Series& line =
          lines.try_emplace(name, study::Series{name.empty() ? "runs" : name, {}, is_split}).first->second;
      line.points.push_back(
          {has_numbers ? *parse_number(row.run->values.front().second) : static_cast<double>(i + 1),
           one.number(row),
           {}});
    }
  }
  for (auto& [name, line] : lines) {
    std::stable_sort(line.points.begin(), line.points.end(),
                     [](const auto& a, const auto& b) { return a.x < b.x; });
    chart.series.push_back(std::move(line));
  }
  return chart;
}

// Returns whether a number differs by more than `least` between the variations that have it.
bool differs(const std::vector<VariationResult>& rows, const Shown& shown, double least) {
  std::set<double> found;
  for (const VariationResult& row : rows)
    if (const double value = shown.number(row); std::isfinite(value)) found.insert(value);
  return !found.empty() && *found.rbegin() - *found.begin() > least;
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

// Begins the row of a variation: its number and values.
std::vector<std::string> row_of(std::size_t index, const VariationResult& row) {
  std::vector<std::string> line = {std::to_string(index + 1)};
  for (const auto& [key, value] : row.run->values) line.push_back(value);
  return line;
}

// Begins a table with the heads of row_of().
std::vector<std::vector<std::string>> table_of(const std::vector<VariationResult>& rows) {
  std::vector<std::vector<std::string>> table(1, {"run"});
  for (const auto& [key, value] : rows.front().run->values) table[0].push_back(key);
  return table;
}

void add_table(const std::vector<VariationResult>& rows, study::Page& page) {
  std::vector<std::vector<std::string>> table = table_of(rows);
  for (const char* head : {"state", "frames"}) table[0].emplace_back(head);
  for (const Result& result : results()) table[0].emplace_back(result.title);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<std::string> line = row_of(i, rows[i]);
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

// Returns a number of a body of a variation; NaN if that has no such body.
double body_number(const VariationResult& row, const std::string& body, BodyNumber number) {
  for (const BodyResult& found : row.bodies)
    if (found.name == body) return found.numbers[number];
  return NAN;
}

// A body of the variations.
struct KnownBody {
  std::string name;
  double least = std::numeric_limits<double>::infinity(), most = -least;  // length of its paths, m
};

// Returns the bodies of all variations, in the order of their scenes.
std::vector<KnownBody> known_bodies(const std::vector<VariationResult>& rows) {
  std::vector<KnownBody> bodies;
  std::map<std::string, std::size_t> places;
  for (const VariationResult& row : rows)
    for (const BodyResult& body : row.bodies) {
      const auto [place, is_new] = places.try_emplace(body.name, bodies.size());
      if (is_new) bodies.push_back({body.name});
      KnownBody& known = bodies[place->second];
      known.least = std::min(known.least, body.numbers[travelled]);
      known.most = std::max(known.most, body.numbers[travelled]);
    }
  return bodies;
}

// Returns the names of those bodies that the page shows: the ones whose paths differ most between the
// variations, in the order of the scene.
std::vector<std::string> shown_bodies(const std::vector<KnownBody>& bodies) {
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return bodies[a].most - bodies[a].least > bodies[b].most - bodies[b].least;
  });
  order.resize(std::min(order.size(), max_bodies));
  std::sort(order.begin(), order.end());
  std::vector<std::string> shown;
  for (const std::size_t index : order) shown.push_back(bodies[index].name);
  return shown;
}

// Returns a number of a body as text; what is smaller than tables of bodies tell is 0.
std::string body_text(double value) {
  return std::abs(value) < least_difference ? "0" : study::number_text(value);
}

// Returns the place of a body at the end of a variation: "1.2, 0.5, 0"; empty if it is not known.
std::string place_text(const VariationResult& row, const std::string& body) {
  std::string text;
  for (const BodyNumber axis : {place_x, place_y, place_z}) {
    const double value = body_number(row, body, axis);
    if (!std::isfinite(value)) return {};
    text += (text.empty() ? "" : ", ") + body_text(value);
  }
  return text;
}

// Appends the table of the bodies that the page shows, of `all`.
void add_bodies(const std::vector<VariationResult>& rows, const std::vector<std::string>& shown,
                std::size_t all, study::Page& page) {
  std::vector<std::vector<std::string>> table = table_of(rows);
  for (const std::string& body : shown)
    for (const char* head : {"place at the end (m)", "path (m)", "speed at the end (m/s)"})
      table[0].push_back(fmt::format("{}: {}", body, head));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<std::string> line = row_of(i, rows[i]);
    for (const std::string& body : shown) {
      line.push_back(place_text(rows[i], body));
      for (const BodyNumber number : {travelled, speed})
        line.push_back(body_text(body_number(rows[i], body, number)));
    }
    table.push_back(std::move(line));
  }
  page.heading("Bodies");
  page.text(all == shown.size()
                ? "bodies.csv has more numbers of each."
                : fmt::format("{} of {} bodies: those whose paths differ most. bodies.csv has all.",
                              shown.size(), all));
  if (!shown.empty()) page.table(table);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!rows[i].no_bodies.empty()) page.text(fmt::format("Run {}: {}", i + 1, rows[i].no_bodies));
}

// Returns whether a body moves on a straight line in all variations, so that its path is as long as its way.
bool moves_straight(const std::vector<VariationResult>& rows, const std::string& body) {
  return std::none_of(rows.begin(), rows.end(), [&](const VariationResult& row) {
    return body_number(row, body, travelled) - body_number(row, body, moved) > least_difference;
  });
}

// Appends the charts of numbers that differ between the variations.
void add_charts(const std::vector<VariationResult>& rows, const std::vector<std::string>& bodies,
                const fs::path& folder, study::Page& page) {
  page.heading("Charts");
  for (const BodyNumber number : {moved, travelled, speed, top_speed, spin}) {
    std::vector<Shown> shown;
    for (const std::string& body : bodies) {
      if (number == travelled && moves_straight(rows, body)) continue;  // that would be the chart before
      Shown one{body, [body, number](const VariationResult& row) { return body_number(row, body, number); }};
      if (differs(rows, one, least_difference)) shown.push_back(std::move(one));
    }
    const Result& result = body_results()[number];
    if (!shown.empty()) page.chart(study::draw(chart_of(rows, result, shown), folder));
  }
  for (std::size_t i = 0; i < results().size(); ++i)
    if (const Shown shown{"", [i](const VariationResult& row) { return row.numbers[i]; }};
        differs(rows, shown, 0))
      page.chart(study::draw(chart_of(rows, results()[i], {shown}), folder));
  const study::Chart chart = energy_chart(rows);
  if (!chart.series.empty() && chart.series.size() <= max_lines) page.chart(study::draw(chart, folder));
}

// Sets what became of the bodies of a run that has frames.
void take_bodies(const io::RunDirectory& run, VariationResult& row) {
  try {
    row.bodies = read_bodies(run, row.frames);
  } catch (const FileError& error) {
    row.no_bodies = error.what();
  }
}

// Returns the beginning of a head line of CSV: "run,", then the keys.
std::string csv_head(const Plan& plan, const std::string& first) {
  std::string text = first;
  for (const auto& [key, value] : plan.runs.front().values) text += fmt::format(",{}", field(key));
  return text;
}

std::string csv_number(double value) { return std::isfinite(value) ? fmt::format(",{}", value) : ","; }

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
        take_bodies(run, row);
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
  std::string text = csv_head(plan, "run,folder") + ",state,error,frames";
  for (const Result& result : results()) text += fmt::format(",{}", result.name);
  text += ",hash\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const VariationResult& row = rows[i];
    text += fmt::format("{},{}", i + 1, field(row.run->folder.string()));
    for (const auto& [key, value] : row.run->values) text += fmt::format(",{}", field(value));
    text += fmt::format(",{},{},{}", row.state, field(row.error), row.frames);
    for (const double value : row.numbers) text += csv_number(value);
    text += fmt::format(",{}\n", row.hash);
  }
  return text;
}

std::string bodies_csv(const Plan& plan, const std::vector<VariationResult>& rows) {
  std::string text = csv_head(plan, "run") + ",frames,body,kind";
  for (const Result& result : body_results()) text += fmt::format(",{}", result.name);
  text += '\n';
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::string begin = std::to_string(i + 1);
    for (const auto& [key, value] : rows[i].run->values) begin += fmt::format(",{}", field(value));
    for (const BodyResult& body : rows[i].bodies) {
      text += fmt::format("{},{},{},{}", begin, rows[i].frames, field(body.name), body.kind);
      for (const double value : body.numbers) text += csv_number(value);
      text += '\n';
    }
  }
  return text;
}

std::vector<fs::path> collect(const Plan& plan, const std::vector<VariationResult>& rows) {
  const fs::path table = plan.folder / "results.csv", body_table = plan.folder / "bodies.csv",
                 sheet = plan.folder / "sheet.png", file = plan.folder / "results.html",
                 charts = plan.folder / "charts";
  io::create_folder(charts);
  io::write_atomically(table, results_csv(plan, rows));
  io::write_atomically(body_table, bodies_csv(plan, rows));
  std::vector<fs::path> written = {table, body_table};
  const std::vector<study::Page::Picture> pictures = write_pictures(rows, charts, sheet);
  if (!pictures.empty()) written.push_back(sheet);
  study::Page page(fmt::format("{}: {} variations", plan.name, rows.size()));
  page.heading("Results");
  add_table(rows, page);
  const std::vector<KnownBody> all = known_bodies(rows);
  const std::vector<std::string> shown = shown_bodies(all);
  add_bodies(rows, shown, all.size(), page);
  if (!pictures.empty()) {
    page.heading("Last pictures");
    page.pictures(pictures);
  }
  add_charts(rows, shown, charts, page);
  io::write_atomically(file, page.html());
  written.push_back(file);
  return written;
}

}  // namespace duet::farm
