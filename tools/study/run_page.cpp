#include "tools/study/run_page.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "tools/sheet.h"
#include "tools/study/charts.h"
#include "tools/study/page.h"
#include "tools/study/results.h"
#include "tools/study/run_result.h"
#include "tools/study/stages.h"
#include <fmt/format.h>

#include "render/picture.h"
#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"

namespace duet::study {
namespace {

namespace fs = std::filesystem;
using Frames = std::vector<nlohmann::json>;
using Value = std::function<double(const nlohmann::json&)>;

constexpr std::size_t max_pictures = 12;  // pictures of a run on its page
constexpr int thumbnail_width = 480;      // pixels; smallest width of such a picture

double number(const nlohmann::json& frame, const std::string& key) { return frame.at(key).get<double>(); }

Value value_of(const std::string& key) {
  return [key](const nlohmann::json& frame) { return number(frame, key); };
}
// Returns a function that reads a component of a vector.
Value component_of(const std::string& key, std::size_t axis) {
  return [key, axis](const nlohmann::json& frame) { return frame.at(key).at(axis).get<double>(); };
}

// Returns a value of all frames over time.
Series series_of(const Frames& frames, const std::string& name, const Value& value) {
  Series series{name, {}, true};
  for (const nlohmann::json& frame : frames)
    series.points.push_back({number(frame, "time"), value(frame), {}});
  return series;
}

// The page under construction.
class RunPage {
 public:
  RunPage(const io::RunDirectory& run, fs::path charts)
      : run_(run),
        charts_(std::move(charts)),
        manifest_(io::read_manifest(run)),
        frames_(read_stats(run.root)),
        page_(manifest_.title.empty() ? manifest_.scene : manifest_.title) {}

  std::string write() {
    write_summary();
    write_pictures();
    write_motion();
    write_work();
    write_plan();
    return page_.html();
  }

 private:
  // Returns the frames without frame 0, which took no work.
  Frames simulated() const { return {frames_.begin() + 1, frames_.end()}; }

  // Returns whether a body is drawn by another surface than the one that touches, in all frames. A run that
  // an older program began has the depth of drawn surfaces in its later frames only.
  bool draws_others() const {
    return std::all_of(frames_.begin(), frames_.end(),
                       [](const nlohmann::json& frame) { return frame.contains("drawn_penetration"); });
  }

  void write_summary() {
    double seconds = 0, substeps = 0, penetration = 0, drawn = 0;
    for (const nlohmann::json& frame : frames_) {
      seconds += number(frame, "seconds");
      substeps += number(frame, "substeps");
      penetration = std::max(penetration, number(frame, "max_penetration"));
      if (draws_others()) drawn = std::max(drawn, number(frame, "drawn_penetration"));
    }
    const double time = number(frames_.back(), "time");
    page_.text(fmt::format("{}; {}; {}.", manifest_.command, manifest_.origin.machine,
                           io::program_text(manifest_.origin)));
    std::vector<std::vector<std::string>> table = {
        {"frames", "simulated (s)", "substeps", "seconds of simulation", "seconds per simulated second",
         "deepest penetration (m)"},
        {std::to_string(frames_.size() - 1), number_text(time), fmt::format("{:.0f}", substeps),
         number_text(seconds), number_text(seconds / time), number_text(penetration)}};
    if (draws_others()) {
      table[0].push_back("of drawn surfaces (m)");
      table[1].push_back(number_text(drawn));
    }
    page_.table(table);
  }

  void write_pictures() {
    std::vector<int> drawn;
    for (std::size_t frame = 0; frame < frames_.size(); ++frame)
      if (fs::exists(run_.image(static_cast<int>(frame)))) drawn.push_back(static_cast<int>(frame));
    if (drawn.empty()) return;
    const std::size_t count = std::min(drawn.size(), max_pictures);
    std::vector<Page::Picture> pictures;
    for (std::size_t i = 0; i < count; ++i) {
      const int frame = drawn[count > 1 ? i * (drawn.size() - 1) / (count - 1) : 0];
      pictures.push_back({thumbnail(frame), fmt::format("frame {}, {:.3g} s", frame, frame / manifest_.fps)});
    }
    page_.heading("Pictures");
    page_.pictures(pictures);
  }

  fs::path thumbnail(int frame) const {
    run_.require_whole(run_.image(frame));
    const render::Picture picture = render::read_picture(run_.image(frame));
    const int factor = picture.width / thumbnail_width;
    if (factor < 2) return run_.image(frame);
    const render::Picture small = tools::shrunk(picture, factor);
    fs::path file = charts_ / run_.image(frame).filename();
    io::create_folder(charts_);
    render::write_png(file.string(), small.width, small.height, small.rgb);
    return file;
  }

  void plot(const std::string& name, const std::string& title, const std::string& unit,
            std::vector<Series> series, bool logarithmic = false) {
    Chart chart;
    chart.name = name;
    chart.title = title;
    chart.x_label = "simulated time (s)";
    chart.y_label = unit;
    chart.log_y = logarithmic;
    chart.series = std::move(series);
    page_.chart(draw(chart, charts_));
  }

  void plot_if_any(const std::string& name, const std::string& title, const std::string& unit,
                   const Frames& frames, const std::string& key) {
    const auto is_zero = [&](const nlohmann::json& frame) { return number(frame, key) == 0; };
    if (!std::all_of(frames.begin(), frames.end(), is_zero))
      plot(name, title, unit, {series_of(frames, title, value_of(key))});
  }

  void write_motion() {
    page_.heading("Energy and momentum");
    const auto total = [](const nlohmann::json& frame) {
      return number(frame, "kinetic") + number(frame, "potential") + number(frame, "elastic");
    };
    plot("energy", "Energy", "J",
         {series_of(frames_, "kinetic", value_of("kinetic")),
          series_of(frames_, "of gravity", value_of("potential")),
          series_of(frames_, "elastic", value_of("elastic")), series_of(frames_, "total", total)});
    for (const auto& [key, title, unit] : {std::tuple{"momentum", "Momentum", "kg m/s"},
                                           std::tuple{"angular_momentum", "Angular momentum", "kg m^2/s"}})
      plot(key, title, unit,
           {series_of(frames_, "x", component_of(key, 0)), series_of(frames_, "y", component_of(key, 1)),
            series_of(frames_, "z", component_of(key, 2))});
    page_.heading("Contact and deformation");
    plot_if_any("penetration", "Deepest penetration at frame ends", "m", frames_, "max_penetration");
    if (draws_others())
      plot_if_any("drawn_penetration", "Penetration of drawn surfaces", "m", frames_, "drawn_penetration");
    plot_if_any("contacts", "Contacts", "", frames_, "contacts");
    plot_if_any("volume", "Largest relative error of volume", "", frames_, "volume_error");
    const auto is_rigid = [](const nlohmann::json& frame) { return number(frame, "min_det_F") == 1; };
    if (!std::all_of(frames_.begin(), frames_.end(), is_rigid))
      plot("det", "Least determinant of the deformation gradient", "",
           {series_of(frames_, "least det F", value_of("min_det_F"))});
    plot_if_any("stretch", "Largest principal stretch", "", frames_, "max_stretch");
  }

  void write_work() {
    const Frames frames = simulated();
    if (frames.empty()) return;
    page_.heading("Work");
    plot("substeps", "Substeps a frame", "", {series_of(frames, "substeps", value_of("substeps"))});
    plot_if_any("iterations", "Conjugate-gradient iterations a frame", "", frames, "cg_iterations");
    plot_if_any("pressure", "Pressure iterations a frame", "", frames, "pressure_iterations");
    plot_stages(frames);
    write_stages(frames);
  }

  void plot_stages(const Frames& frames) {
    std::vector<std::pair<std::string, StageSeconds>> bars;
    for (const nlohmann::json& frame : frames) {
      StageSeconds seconds;
      for (const auto& [name, stage] : frame.at("stages").items())
        seconds.emplace_back(name, number(stage, "seconds"));
      bars.emplace_back("", with_rest(std::move(seconds), number(frame, "seconds")));
    }
    const BarChart bars_chart = stage_chart("stages", "", "", bars);
    Chart chart;
    chart.name = "stages";
    chart.title = "Seconds by stage";
    chart.x_label = "simulated time (s)";
    chart.y_label = "seconds a frame";
    chart.stacked = true;
    for (std::size_t k = 0; k < bars_chart.parts.size(); ++k) {
      std::size_t i = 0;
      chart.series.push_back(series_of(frames, bars_chart.parts[k],
                                       [&](const nlohmann::json&) { return bars_chart.values[i++][k]; }));
    }
    page_.chart(draw(chart, charts_));
  }

  // A run that another version has gone on with has stages by the names of both.
  static std::vector<std::string> stage_names_of(const Frames& frames) {
    std::vector<std::string> names;
    for (const nlohmann::json& frame : frames)
      for (const auto& [name, ignored] : frame.at("stages").items())
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    return names;
  }

  void write_stages(const Frames& frames) {
    double total = 0;
    for (const nlohmann::json& frame : frames) total += number(frame, "seconds");
    std::vector<std::vector<std::string>> rows = {{"stage", "seconds", "share", "calls"}};
    for (const std::string& name : stage_names_of(frames)) {
      double seconds = 0, calls = 0;
      for (const nlohmann::json& frame : frames) {
        const auto stage = frame.at("stages").find(name);
        if (stage == frame.at("stages").end()) continue;
        seconds += number(*stage, "seconds");
        calls += number(*stage, "calls");
      }
      rows.push_back({name + (is_part_of_another(name) ? " (within others)" : ""), number_text(seconds),
                      fmt::format("{:.1f}%", 100 * seconds / total), fmt::format("{:.0f}", calls)});
    }
    page_.table(rows);
  }

  // The command of the run says what was left out.
  void write_plan() {
    std::vector<std::string> without;
    std::istringstream words(manifest_.command);
    for (std::string word; words >> word;)
      if (word == "--without" && words >> word)
        without.push_back(word);
      else if (word.starts_with("--without="))
        without.push_back(word.substr(10));
    run_.require_whole(run_.scene());
    const scene::Scene scene = scene::read(run_.scene().string(), {}, scene::Meshes::leave).scene;
    std::vector<std::vector<std::string>> rows = {{"effect", "simulated", "why"}};
    for (const scene::PlannedEffect& effect : scene::plan_effects(scene, without).effects)
      rows.push_back({std::string(name(effect.effect)), effect.active ? "yes" : "no", effect.reason});
    page_.heading("Effects");
    page_.table(rows);
  }

  const io::RunDirectory& run_;
  const fs::path charts_;
  const io::Manifest manifest_;
  const Frames frames_;
  Page page_;
};

}  // namespace

std::string run_page(const io::RunDirectory& run, const fs::path& charts) {
  try {
    return RunPage(run, charts).write();
  } catch (const nlohmann::json::exception& error) {
    throw FileError(run.stats().string(),
                    fmt::format("holds a line that is no frame's statistics: {}", error.what()),
                    "simulate the scene again");
  }
}

}  // namespace duet::study
