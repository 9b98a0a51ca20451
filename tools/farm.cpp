// `duet farm`: writes the scripts by which many machines work on a run, its variations or a study, submits
// them, and says how far they are.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>

#include "tools/commands.h"
#include "tools/farm/collect.h"
#include "tools/farm/plan.h"
#include "tools/farm/scripts.h"
#include "tools/farm/status.h"
#include "tools/run_products.h"
#include "tools/study/charts.h"
#include "tools/wording.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/wording.h"
#include "sim/io/run_folder.h"

namespace duet::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Returns whether a program of this name is in PATH.
bool is_installed(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/usr/bin:/bin";
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    if (::access((fs::path(folders.substr(begin, end - begin)) / name).c_str(), X_OK) == 0) return true;
    begin = end + 1;
  }
  return false;
}

// Throws FileError if --submit needs a program that is not installed.
void require_engine(const std::string& engine) {
  const auto require = [&](const char* program, const char* package) {
    if (!is_installed(program))
      throw FileError(
          program, fmt::format("is not installed, and --engine {} --submit needs it", engine),
          fmt::format("`apt install {}`, choose another engine, or write the scripts without --submit",
                      package));
  };
  if (engine == "slurm") require("sbatch", "slurm-client");
  if (engine == "parallel") require("parallel", "parallel");
}

// Removes the runs that are of other settings than the plan asks for, because they cannot be continued, and
// notes their number. Throws Error (usage) if there are such runs and they are not to be replaced, and
// FileError if a program still writes to one.
void clear_other_runs(const farm::Plan& plan, bool overwrite, Report& report) {
  std::vector<io::RunDirectory> others;
  for (const farm::PlannedRun& run : plan.runs) {
    if (!farm::holds_other_run(run)) continue;
    if (!overwrite)
      throw Error(ExitStatus::usage,
                  fmt::format("{}: the folder holds a run of another scene or other settings, which stays "
                              "untouched (give --overwrite to replace it, or another folder with --out)",
                              run.folder.string()));
    others.push_back({run.folder});
  }
  for (const io::RunDirectory& other : others) {
    const io::RunLock lock(other, "duet farm");
    replace_run(other, report);
  }
  if (!others.empty())
    report.note(fmt::format("removed {} of another scene or other settings", counted(others.size(), "run")));
}

// Removes what tasks left that have ended: the states would pass for those of the tasks of new scripts.
void remove_states(const farm::Plan& plan) {
  for (const farm::TaskState& task : farm::task_states(plan))
    if (task.status != "running") io::remove_file(plan.folder / "logs" / (task.name + ".state"));
}

// Writes the scripts and the plan. Throws Error (usage) if the folder has other files, or a farm that is not
// to be replaced.
void write_scripts(const farm::Plan& plan, bool overwrite, Report& report) {
  const bool is_farm = fs::exists(plan.folder / "farm.json");
  if (is_farm && !overwrite)
    throw Error(
        ExitStatus::usage,
        fmt::format(
            "{}: the folder has scripts already, which stay untouched (give --overwrite to replace them and "
            "runs of other settings; `duet farm --status {}` says how far they are)",
            plan.folder.string(), shell_word(plan.folder.string())));
  if (!is_farm && fs::exists(plan.folder) && !fs::is_empty(plan.folder))
    throw Error(ExitStatus::usage,
                fmt::format("{}: the folder holds other files, which stay untouched (choose another "
                            "one with --out)",
                            plan.folder.string()));
  clear_other_runs(plan, overwrite, report);
  remove_states(plan);
  io::create_folder(plan.folder / "logs");
  for (const auto& [name, text] : farm::scripts(plan)) {
    const fs::path file = plan.folder / name;
    io::write_atomically(file, text);
    std::error_code error;
    const fs::perms who = fs::status(file, error).permissions() &
                          (fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
    // Who may read a script may execute it.
    if (name != "setup.sh")
      fs::permissions(file, static_cast<fs::perms>(static_cast<unsigned>(who) >> 2), fs::perm_options::add,
                      error);
    if (error) throw io::system_error(file, "cannot make executable", error.value());
  }
  io::write_atomically(plan.folder / "farm.json", farm::plan_json(plan));
}

// Returns what the farm works on: "8 runs to frame 240 in /home/me/out/stack.farm".
std::string describe(const farm::Plan& plan) {
  if (plan.kind == farm::Kind::study)
    return fmt::format("{} of the study {}", counted(static_cast<std::size_t>(plan.points), "run"),
                       plan.name);
  return fmt::format("{} to frame {}, {}", counted(plan.runs.size(), "run"), plan.frames,
                     counted(plan.runs.size() * static_cast<std::size_t>(plan.tasks), "drawing task"));
}

Json status_json(const farm::Plan& plan, const farm::Status& status) {
  Json runs = Json::array(), tasks = Json::array();
  for (std::size_t i = 0; i < status.runs.size(); ++i) {
    const farm::RunStatus& run = status.runs[i];
    Json entry = {{"folder", plan.runs[i].folder.string()},
                  {"simulated", run.simulated},
                  {"drawn", run.drawn},
                  {"last_frame", run.frames},
                  {"writer", run.writer},
                  {"has_other_settings", run.is_other}};
    if (run.seconds_left) entry["seconds_left"] = *run.seconds_left;
    runs.push_back(std::move(entry));
  }
  for (const farm::TaskState& task : status.tasks)
    tasks.push_back({{"name", task.name},
                     {"status", task.status},
                     {"node", task.node},
                     {"process", task.process},
                     {"log", (plan.folder / "logs" / task.log).string()},
                     {"last_line", task.last_line}});
  return {{"event", "farm"},
          {"runs", runs},
          {"tasks", tasks},
          {"points", status.points},
          {"of_points", plan.points}};
}

// Returns a line for each run that is not done, and for each task that failed.
std::string status_text(const farm::Plan& plan, const farm::Status& status) {
  std::string text;
  for (std::size_t i = 0; i < status.runs.size(); ++i) {
    const farm::RunStatus& run = status.runs[i];
    if (run.is_done() && status.runs.size() > 1) continue;
    if (run.is_other) {
      text += fmt::format(
          "{}: holds a run of another scene or other settings, which does not count (write the scripts anew "
          "with --overwrite to replace it){}\n",
          plan.runs[i].folder.string(), run.writer.empty() ? "" : "; " + run.writer + " writes to it");
      continue;
    }
    text += fmt::format("{}: frame {} of {} simulated, {} of {} pictures drawn", plan.runs[i].folder.string(),
                        std::max(run.simulated, 0), run.frames, run.drawn, run.frames + 1);
    if (run.seconds_left) text += fmt::format(", about {} left", clock_text(*run.seconds_left));
    if (!run.writer.empty()) text += fmt::format("; {} writes to it", run.writer);
    text += '\n';
  }
  for (const farm::TaskState& task : status.tasks)
    if (task.has_failed())
      text += fmt::format("failed: {} on {}, status {}: {} ({})\n", task.name, task.node, task.status,
                          task.last_line, (plan.folder / "logs" / task.log).string());
  return text;
}

Outcome print_status(const farm::Plan& plan, bool json) {
  const farm::Status status = farm::examine(plan);
  const auto failed =
      static_cast<std::size_t>(std::count_if(status.tasks.begin(), status.tasks.end(),
                                             [](const farm::TaskState& task) { return task.has_failed(); }));
  const auto running = static_cast<std::size_t>(
      std::count_if(status.tasks.begin(), status.tasks.end(),
                    [](const farm::TaskState& task) { return task.status == "running"; }));
  const auto done = static_cast<std::size_t>(std::count_if(
      status.runs.begin(), status.runs.end(), [](const farm::RunStatus& run) { return run.is_done(); }));
  if (json)
    print(json_text(status_json(plan, status)) + "\n");
  else
    print(status_text(plan, status));
  const bool is_study = plan.kind == farm::Kind::study;
  const bool is_done = is_study ? status.points >= plan.points : done == plan.runs.size();
  const fs::path page = plan.folder / "results.html";
  const bool has_page = plan.kind == farm::Kind::variations && running == 0 && fs::exists(page);
  const std::string text =
      fmt::format("{} of {} {}{}{}{}", is_study ? static_cast<std::size_t>(status.points) : done,
                  is_study ? static_cast<std::size_t>(plan.points) : plan.runs.size(),
                  is_study ? "runs have a result" : "runs are simulated and drawn",
                  running > 0 ? ", " + counted(running, "task") + " at work" : "",
                  failed > 0 ? ", " + counted(failed, "task") + " failed" : "",
                  has_page ? "; results in " + page.string() : "");
  return {failed > 0 ? ExitStatus::simulation : is_done ? ExitStatus::done : ExitStatus::unfinished, text};
}

Outcome collect_results(const farm::Plan& plan) {
  if (plan.kind != farm::Kind::variations)
    throw Error(ExitStatus::usage,
                fmt::format("{}: has no variations to collect (`duet report` makes the page of a run)",
                            plan.folder.string()));
  study::require_gnuplot();
  const std::vector<farm::VariationResult> rows = farm::read_results(plan);
  std::string written, failed;
  for (const fs::path& path : farm::collect(plan, rows))
    written += (written.empty() ? "" : ", ") + path.string();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].state == "failed") failed += fmt::format("{}{}", failed.empty() ? "; failed: " : ", ", i + 1);
  return {ExitStatus::done, fmt::format("{}{}", written, failed)};
}

// Replaces this program by the script that starts all tasks.
void start(const farm::Plan& plan) {
  const std::string script = (plan.folder / "start.sh").string();
  ::execlp("bash", "bash", script.c_str(), nullptr);
  throw io::system_error("bash", "cannot run", errno);
}

}  // namespace

Outcome farm(const FarmOptions& options, Report& report) {
  if (options.status) return print_status(farm::read_plan(options.scene.name, options.out), options.json);
  if (options.collect) return collect_results(farm::read_plan(options.scene.name, options.out));
  if (options.engine.empty())
    throw Error(ExitStatus::usage,
                "--engine is required: slurm, parallel or local (or --status for an earlier farm)");
  if (options.submit) require_engine(options.engine);
  const farm::Plan plan = farm::make_plan(options);
  write_scripts(plan, options.overwrite, report);
  const std::string script = shell_word((plan.folder / "start.sh").string());
  report.note(fmt::format("{}; scripts in {}", describe(plan), plan.folder.string()));
  if (options.submit) start(plan);
  return {ExitStatus::done,
          fmt::format("start the tasks with `{}`; `duet farm --status {}` says how far they are", script,
                      shell_word(plan.folder.string()))};
}

}  // namespace duet::tools
