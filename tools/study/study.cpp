// `duet study`: runs a scene under many settings and reports what accuracy costs.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include "tools/study/charts.h"
#include "tools/study/last_picture.h"
#include "tools/study/measures.h"
#include "tools/study/results.h"
#include "tools/study/run_result.h"
#include "tools/study/runs.h"
#include "tools/study/study_page.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"
#include "sim/scene/plan.h"

namespace duet::study {
namespace {

// A setting and its repetitions.
struct Setting {
  std::string line;
  Change change;
  std::vector<Run> runs;
  bool picture = false;
};

// All settings of a study.
struct Study {
  Spec spec;
  bool timed = true;
  Setting shipped;
  std::optional<Setting> reference;
  std::vector<Setting> settings;              // of all knobs, knob after knob
  std::vector<Setting> without;               // one for each effect that the scene needs
  std::vector<scene::PlannedEffect> effects;  // all effects, if the study varies them

  // Whether the runs of a setting measure time.
  enum class Timing { on, off };
  // Makes a setting whose runs are repeated if they are timed.
  Setting setting(const std::string& line, const Change& change, Timing timing) const {
    const bool is_timed = timing == Timing::on;
    Setting result{line, change, {}, false};
    Run run;
    run.scene = scene_of(spec, change);
    run.frames = spec.frames;
    run.limit = spec.time_limit;
    run.timed = is_timed;
    for (run.repetition = 1; run.repetition <= (is_timed ? spec.repetitions : 1); ++run.repetition)
      result.runs.push_back(run);
    return result;
  }

  // Returns the runs of all settings.
  std::vector<Run*> runs() {
    std::vector<Run*> all;
    const auto add = [&](Setting& setting) {
      for (Run& run : setting.runs) all.push_back(&run);
    };
    if (reference) add(*reference);
    add(shipped);
    for (Setting& setting : settings) add(setting);
    for (Setting& setting : without) add(setting);
    return all;
  }
};

// Reads the specification and makes all settings.
Study plan_study(const tools::StudyOptions& options) {
  Study study;
  study.spec = read_spec(options.spec);
  study.timed = !options.untimed;
  const Study::Timing timing = study.timed ? Study::Timing::on : Study::Timing::off;
  const Spec& spec = study.spec;
  const bool all_pictures =
      spec.cost == Cost::drawing ||
      std::any_of(spec.measures.begin(), spec.measures.end(),
                  [](const Measure& measure) { return measure.kind == MeasureKind::image; });
  const bool pictures = all_pictures || std::any_of(spec.knobs.begin(), spec.knobs.end(),
                                                    [](const Knob& knob) { return knob.pictures; });
  study.shipped = study.setting("shipped", {"shipped", {}, {}, {}}, timing);
  study.shipped.picture = pictures;
  if (spec.reference) {
    study.reference = study.setting("reference", *spec.reference, Study::Timing::off);
    study.reference->picture = pictures;
  }
  for (const Knob& knob : spec.knobs)
    for (const Change& change : knob.values) {
      study.settings.push_back(study.setting(knob.name, change, timing));
      study.settings.back().picture = all_pictures || knob.pictures;
    }
  if (!spec.effects) return study;
  study.effects = scene::plan_effects(tools::read_scene(scene_of(spec, {})).scene, spec.base.without).effects;
  for (const scene::PlannedEffect& effect : study.effects)
    if (effect.active) {
      const std::string name(duet::name(effect.effect));
      study.without.push_back(study.setting("without", {name, {}, {name}, {}}, timing));
      study.without.back().picture = all_pictures;
    }
  return study;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

double sum(const std::vector<nlohmann::json>& frames, const char* key) {
  double total = 0;
  for (const nlohmann::json& frame : frames) total += frame.at(key).get<double>();
  return total;
}

// Sets the seconds of a row from all repetitions, and the stages from the median one (of an even number: the
// slower of the middle two). Processor time does not depend on other programs; wall times of stages are
// scaled to it.
void add_times(const Setting& setting, double simulated, Row& row) {
  std::vector<std::pair<double, std::size_t>> seconds;
  for (std::size_t i = 0; i < setting.runs.size(); ++i)
    seconds.emplace_back(sum(read_stats(setting.runs[i].folder), "processor_seconds") / simulated, i);
  std::sort(seconds.begin(), seconds.end());
  std::vector<double> values;
  values.reserve(seconds.size());
  for (const auto& [value, i] : seconds) values.push_back(value);
  row.seconds = median(values);
  row.seconds_least = values.front();
  row.seconds_most = values.back();
  const auto frames = read_stats(setting.runs[seconds[seconds.size() / 2].second].folder);
  const double scale = sum(frames, "processor_seconds") / sum(frames, "seconds") / simulated;
  for (const nlohmann::json& frame : frames)
    for (const auto& [name, stage] : frame.at("stages").items()) {
      auto cost = std::find_if(row.stages.begin(), row.stages.end(),
                               [&name = name](const StageCost& known) { return known.name == name; });
      if (cost == row.stages.end()) cost = row.stages.insert(cost, StageCost{name, 0, 0});
      cost->seconds += stage.at("seconds").get<double>() * scale;
      cost->calls += stage.at("calls").get<double>() / simulated;
    }
}

// Draws the last frame; takes the time for it if drawing is what the study measures.
void add_picture(const Spec& spec, const Run& run, RunResult& result, Row& row) {
  const bool is_cost = spec.cost == Cost::drawing && run.timed;
  const Drawing drawing =
      draw_last_frame(result, run, spec.picture_width, spec.picture_height, is_cost ? spec.repetitions : 0);
  result.picture = drawing.file;
  row.picture = drawing.file.string();
  if (spec.cost == Cost::drawing) row.count = drawing.samples;
  if (is_cost) row.seconds = row.seconds_least = row.seconds_most = drawing.seconds;
}

// Evaluates a setting. `keep` receives the result of its first run, unless the setting failed.
Row make_row(const Study& study, const Setting& setting, const RunResult* reference,
             RunResult* keep = nullptr) {
  const Spec& spec = study.spec;
  Row row;
  row.line = setting.line;
  row.label = setting.change.label;
  row.number = setting.change.number;
  row.seconds = row.seconds_least = row.seconds_most = row.steps = row.iterations = row.count = NAN;
  row.errors.assign(spec.measures.size(), NAN);
  const auto failed =
      std::find_if(setting.runs.begin(), setting.runs.end(), [](const Run& run) { return run.failed; });
  row.failed = failed != setting.runs.end();
  if (row.failed) {
    row.error = failed->error;
    return row;
  }
  RunResult result = load_result(setting.runs.front());
  const double simulated = result.seconds();
  row.steps = sum(result.frames, "substeps") / simulated;
  row.iterations = sum(result.frames, "cg_iterations") / simulated;
  row.unknowns = unknowns(result.simulation->world());
  row.count = spec.count == Count::steps ? row.steps
                                         : (row.steps + row.iterations) * static_cast<double>(row.unknowns);
  row.hash = result.frames.back().at("hash").get<std::string>();
  if (setting.runs.front().timed) add_times(setting, simulated, row);
  if (setting.picture) add_picture(spec, setting.runs.front(), result, row);
  for (std::size_t m = 0; m < spec.measures.size(); ++m)
    if (reference || !needs_reference(spec.measures[m].kind))
      row.errors[m] = evaluate(spec.measures[m], result, reference);
  if (keep) *keep = std::move(result);
  return row;
}

// Evaluates all settings. Throws Error (simulation) if the reference failed.
Results measure(const Study& study, int processor) {
  Results results;
  results.spec = study.spec;
  results.timed = study.timed;
  results.processor = processor;
  RunResult reference, shipped;
  if (study.reference) {
    results.reference = make_row(study, *study.reference, nullptr, &reference);
    if (results.reference->failed)
      throw Error(ExitStatus::simulation,
                  fmt::format("the reference of {} failed: {}", study.spec.path, results.reference->error));
  }
  const RunResult* exact = study.reference ? &reference : nullptr;
  results.shipped = make_row(study, study.shipped, exact, &shipped);
  for (const Setting& setting : study.settings) results.rows.push_back(make_row(study, setting, exact));
  std::size_t next = 0;
  for (const scene::PlannedEffect& effect : study.effects) {
    EffectRow row{std::string(duet::name(effect.effect)), effect.reason, effect.active, {}, NAN};
    if (effect.active) {
      RunResult without;
      row.without = make_row(study, study.without[next++], exact, &without);
      if (without.simulation && shipped.simulation)
        row.difference = state_difference(without.simulation->world(), shipped.simulation->world(), {});
    }
    results.effects.push_back(std::move(row));
  }
  const io::Manifest manifest = io::read_manifest({study.shipped.runs.front().folder});
  results.version = fmt::format("{} ({})", manifest.origin.version, manifest.origin.git_commit);
  results.machine = manifest.origin.machine;
  results.simulated = study.spec.frames / manifest.fps;
  conclude(results);
  return results;
}

}  // namespace
}  // namespace duet::study

namespace duet::tools {

int study_points(const StudyOptions& options) {
  study::Study study = study::plan_study(options);
  Report silent({.quiet = true});
  study::Runner runner({}, options.program, 1, silent);
  std::vector<study::Run*> runs = study.runs();
  return static_cast<int>(runner.distinct(runs).size());
}

int study_results(const StudyOptions& options) {
  study::Study study = study::plan_study(options);
  Report silent({.quiet = true});
  const study::Runner runner(std::filesystem::path(options.out) / "runs", options.program, 1, silent);
  std::vector<study::Run*> runs = study.runs();
  return runner.with_result(runs);
}

Outcome study(const StudyOptions& options, Report& report) {
  namespace fs = std::filesystem;
  if (!options.point) study::require_gnuplot();
  const OrderlyStop orderly;
  study::Study study = study::plan_study(options);
  const fs::path folder =
      options.out.empty() ? fs::path("out/studies") / fs::path(options.spec).stem() : fs::path(options.out);
  study::Runner runner(folder / "runs", options.program, options.jobs, report);
  std::vector<study::Run*> runs = study.runs();
  if (options.point) {
    if (!runner.carry_out_point(runs, *options.point))
      return {ExitStatus::interrupted, "the run was given up; the same command begins it anew"};
    return {ExitStatus::done, fmt::format("run {} of {} is in {}", *options.point,
                                          runner.distinct(runs).size(), (folder / "runs").string())};
  }
  if (!runner.carry_out(runs))
    return {ExitStatus::interrupted,
            fmt::format("after {} runs, which are kept in {}; the same command goes on", runner.simulated(),
                        folder.string())};
  const study::Results results = study::measure(study, runner.processor());
  io::write_atomically(folder / "results.csv", study::csv(results));
  io::write_atomically(folder / "results.json", study::json(results));
  io::write_atomically(folder / "report.html", study::study_page(results, folder / "charts"));
  if (!options.json) print(study::table(results));
  const auto failed =
      std::count_if(runs.begin(), runs.end(), [](const study::Run* run) { return run->failed; });
  return {ExitStatus::done, fmt::format("{} runs, {} of them new{}; {}", runs.size(), runner.simulated(),
                                        failed > 0 ? fmt::format(", {} failed", failed) : "",
                                        (folder / "report.html").string())};
}

}  // namespace duet::tools
