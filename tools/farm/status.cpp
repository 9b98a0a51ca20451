#include "tools/farm/status.h"

#include <algorithm>
#include <cstdint>
#include <sstream>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/json_text.h"
#include "sim/io/run_claim.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_journal.h"

namespace duet::farm {
namespace {

// Returns the seconds that a line of statistics gives for a frame after frame 0; none for other lines.
std::optional<double> seconds_in(std::string_view line) {
  const nlohmann::json object = io::parse_json(line);
  if (!object.is_object()) return std::nullopt;
  const auto frame = object.find("frame"), seconds = object.find("seconds");
  const bool is_later = frame != object.end() && io::integer_of<int>(*frame).value_or(0) > 0;
  if (!is_later || seconds == object.end() || !seconds->is_number()) return std::nullopt;
  return seconds->get<double>();
}

// Returns the seconds that a frame took on average over the last frames of a run; none if it has no frame.
std::optional<double> seconds_per_frame(const io::RunDirectory& run) {
  constexpr std::size_t most = 24;  // frames: a larger number follows changes of their cost later
  std::error_code missing;
  if (!fs::exists(run.stats(), missing)) return std::nullopt;
  const std::string text = io::read_file(run.stats());
  std::size_t end = text.rfind('\n'), count = 0;
  double sum = 0;
  while (end != std::string::npos && end > 0 && count < most) {
    const std::size_t begin = text.rfind('\n', end - 1) + 1;  // npos + 1 is 0
    const std::optional<double> seconds = seconds_in(std::string_view(text).substr(begin, end - begin));
    if (!seconds) break;
    sum += *seconds;
    ++count;
    end = begin == 0 ? std::string::npos : begin - 1;
  }
  return count > 0 ? std::optional(sum / static_cast<double>(count)) : std::nullopt;
}

// Returns the number of pictures of frames up to `last`, and the seconds between two of them.
std::pair<int, std::optional<double>> pictures_of(const io::RunDirectory& run, int last) {
  int count = 0;
  fs::file_time_type first = fs::file_time_type::max(), newest = fs::file_time_type::min();
  for (const fs::path& file : io::files_in(run.image(0).parent_path())) {
    const int frame = io::frame_of_file(file, ".png");
    if (frame < 0 || frame > last || !io::holds_bytes(file)) continue;
    ++count;
    std::error_code missing;
    const auto time = fs::last_write_time(file, missing);
    if (missing) continue;
    first = std::min(first, time);
    newest = std::max(newest, time);
  }
  if (count < 2) return {count, std::nullopt};
  return {count, std::chrono::duration<double>(newest - first).count() / (count - 1)};
}

RunStatus examine_run(const PlannedRun& planned) {
  RunStatus status;
  status.frames = planned.frames;
  const io::RunDirectory run{planned.folder};
  std::error_code missing;
  if (!fs::exists(run.manifest(), missing)) return status;
  if (const auto holder = io::RunClaim::holder(run.root)) status.writer = holder->text();
  status.is_other = holds_other_run(planned);
  if (status.is_other) return status;
  for (const fs::path& file : io::files_in(run.checkpoint()))
    status.simulated = std::max(status.simulated, io::frame_of_file(file, ".bin"));
  const auto [drawn, picture] = pictures_of(run, status.frames);
  status.drawn = drawn;
  if (status.is_done()) return status;
  if (const auto frame = seconds_per_frame(run); frame && status.simulated < status.frames)
    status.seconds_left = *frame * (status.frames - status.simulated);
  if (picture)
    status.seconds_left = std::max(status.seconds_left.value_or(0), *picture * (status.frames + 1 - drawn));
  return status;
}

// Returns the number of runs of a study that have a result. Folders of runs are named by scene, settings and
// program, so that results of an earlier specification do not count. If another program asks, or if the study
// cannot be read any more, all results count that are there.
int results_of_study(const Plan& plan) {
  if (plan.program == this_program()) try {
      tools::StudyOptions study;
      study.spec = plan.scene.string();
      study.out = plan.study.string();
      study.untimed = true;
      return tools::study_results(study);
    } catch (const Error&) {
    }
  const std::vector<fs::path> files = io::files_in(plan.study / "runs");
  return static_cast<int>(std::count_if(files.begin(), files.end(), [](const fs::path& file) {
    return file.filename().string().ends_with(".outcome.json");
  }));
}

}  // namespace

std::string end_of_log(const fs::path& log) {
  std::error_code missing;
  if (!fs::exists(log, missing)) return {};
  std::istringstream lines(io::read_file(log));
  std::string line, last, error;
  while (std::getline(lines, line)) {
    if (!line.empty()) last = line;
    if (line.starts_with("duet: ")) error = line.substr(6);
  }
  return error.empty() ? last : error;
}

std::vector<TaskState> task_states(const Plan& plan) {
  std::vector<TaskState> tasks;
  const std::string host = io::this_process().host;
  std::error_code missing;
  const fs::path logs = plan.folder / "logs";
  for (const fs::path& file : io::files_in(logs)) {
    if (file.extension() != ".state") continue;
    std::istringstream words(io::read_file(file));
    TaskState task;
    double seconds = 0;
    words >> task.status >> task.node >> task.process >> seconds >> task.log;
    task.name = file.stem().string();
    if (task.status == "running" && task.node == host &&
        !fs::exists(fmt::format("/proc/{}", task.process), missing)) {
      task.status = "lost";
      task.last_line = "it was killed; the same script continues it";
    } else if (task.has_failed())
      task.last_line = end_of_log(logs / task.log);
    tasks.push_back(std::move(task));
  }
  std::sort(tasks.begin(), tasks.end(),
            [](const TaskState& a, const TaskState& b) { return a.name < b.name; });
  return tasks;
}

Status examine(const Plan& plan) {
  Status status;
  for (const PlannedRun& run : plan.runs) status.runs.push_back(examine_run(run));
  if (plan.kind == Kind::study) status.points = results_of_study(plan);
  status.tasks = task_states(plan);
  return status;
}

}  // namespace duet::farm
