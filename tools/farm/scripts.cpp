#include "tools/farm/scripts.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include <fmt/format.h>

namespace duet::farm {
namespace {

using Values = std::map<std::string, std::string>;

// Replaces each @NAME@ of the text by its value. What values contain is not replaced again.
std::string filled(std::string_view text, const Values& values) {
  std::string result;
  while (!text.empty()) {
    const std::size_t begin = text.find('@'),
                      end = begin == text.npos ? text.npos : text.find('@', begin + 1);
    const auto value =
        end == text.npos ? values.end() : values.find(std::string(text.substr(begin + 1, end - begin - 1)));
    if (value == values.end()) {  // an @ of the shell, as in "$@"
      const std::size_t plain = begin == text.npos ? text.size() : begin + 1;
      result += text.substr(0, plain);
      text.remove_prefix(plain);
      continue;
    }
    result += text.substr(0, begin);
    result += value->second;
    text.remove_prefix(end + 1);
  }
  return result;
}

std::string words(const std::vector<std::string>& list) {
  std::string text;
  for (const std::string& word : list) {
    if (!text.empty()) text += ' ';
    text += quoted(word);
  }
  return text;
}

// Returns a name for jobs: letters, digits and underscores.
std::string job_name(const std::string& name) {
  std::string plain;
  for (const char c : name) plain += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return plain;
}

constexpr std::string_view setup = R"sh(# shellcheck shell=bash
# Sourced by the other scripts of this folder: where things are, and how a task leaves its log and its status.
@LITERALS@set -euo pipefail
farm=@FARM@
cd @WORK@

# The program.
duet() {
  @PROGRAM@ "$@"
}

# run_folder NUMBER: prints the folder of a run.
run_folder() {
  @RUN_FOLDER@
}

# task NAME COMMAND...: carries out a command, which has a log of its own, and leaves the line
# "STATUS NODE PROCESS SECONDS LOG" in logs/NAME.state, where the status is "running" at first. Returns the status.
task() {
  local name=$1 status=0 log
  shift
  log="$name.${HOSTNAME//[!A-Za-z0-9]/_}.$$.log"
  leave "$name" running "$log"
  "$@" >"$farm/logs/$log" 2>&1 || status=$?
  leave "$name" "$status" "$log"
  return "$status"
}

# leave NAME STATUS LOG: writes the state of a task under a name that no other process uses, and renames it.
leave() {
  local new="$farm/logs/$1.state.$HOSTNAME.$$"
  printf '%s %s %s %(%s)T %s\n' "$2" "${SLURMD_NODENAME:-$HOSTNAME}" "$$" -1 "$3" >"$new"
  mv -f -- "$new" "$farm/logs/$1.state"
}

# status_of NAME: prints the status that a task left; nothing if it has none.
status_of() {
  local status=''
  if [[ -e $farm/logs/$1.state ]]; then
    read -r status _ <"$farm/logs/$1.state" || true
  fi
  printf '%s\n' "$status"
}
)sh";

// Lines that Slurm reads at the top of a script. Logs are kept by setup.sh: Slurm takes % and \ in paths for
// patterns.
std::string head(const Plan& plan, const std::string& what, int processors) {
  std::string text = "#!/usr/bin/env bash\n";
  if (plan.engine == "slurm")
    text += fmt::format(
        "#SBATCH --job-name={}-{}\n#SBATCH --time={}\n#SBATCH --cpus-per-task={}\n#SBATCH --requeue\n"
        "#SBATCH --output=/dev/null\n",
        job_name(plan.name), what, plan.minutes, processors);
  return text;
}

constexpr std::string_view source_setup = R"sh(@LITERALS@farm=@FARM@
# shellcheck source=/dev/null
source "$farm/setup.sh"
)sh";

constexpr std::string_view simulate =
    R"sh(# Simulates run NUMBER, or continues it after its last whole frame.   simulate.sh [NUMBER]
@SOURCE@
number=${1:-${SLURM_ARRAY_TASK_ID:?simulate.sh: which run?}}
case $(status_of "simulate-$number") in
  0) exit 0 ;;        # an earlier task has simulated all frames
  2 | 3) exit 3 ;;    # it failed, and would fail again
esac
changes=(@CHANGES@)
@CASES@task "simulate-$number" duet sim @SCENE@ "${changes[@]}" --out "$(run_folder "$number")" --threads @THREADS@ \
  --resume --wait @WAIT@@STOP@
)sh";

constexpr std::string_view draw =
    R"sh(# Draws the pictures of a range of frames that are not there or not whole. Waits up to SECONDS for each frame that the
# simulation is still to write.   draw.sh NUMBER [SECONDS]
@SOURCE@
number=${1:-${SLURM_ARRAY_TASK_ID:?draw.sh: which task?}}
seconds=${2:-0} tasks=@TASKS@ frames=$((@LAST@ + 1))
run=$(((number - 1) / tasks + 1)) part=$(((number - 1) % tasks))
first=$((part * frames / tasks)) last=$(((part + 1) * frames / tasks - 1))
export LP_NUM_THREADS=${LP_NUM_THREADS:-0} # one processor a task; pictures do not depend on it
task "draw-$number" duet render "$(run_folder "$run")" --frames "$first:$last" --missing --wait "$seconds"
)sh";

constexpr std::string_view finish =
    R"sh(# Encodes the video of run NUMBER, writes its report and checks all its files.   finish.sh [NUMBER]
@SOURCE@
number=${1:-${SLURM_ARRAY_TASK_ID:?finish.sh: which run?}}
run=$(run_folder "$number") worst=0
task "encode-$number" duet encode "$run" || worst=$?
task "report-$number" duet report "$run" || worst=$?
task "verify-$number" duet verify "$run" || worst=$?
exit "$worst"
)sh";

constexpr std::string_view collect_script =
    R"sh(# Writes the table, the contact sheet and the page of all variations.
@SOURCE@
task collect duet farm --collect "$farm"
)sh";

constexpr std::string_view point =
    R"sh(# Carries out one run of the study, unless it has a result.   point.sh [NUMBER]
@SOURCE@
number=${1:-${SLURM_ARRAY_TASK_ID:?point.sh: which run?}}
task "point-$number" duet study @SCENE@ --out @STUDY@ --untimed --point "$number"
)sh";

constexpr std::string_view gather = R"sh(# Carries out what is left of the study, and writes its report.
@SOURCE@
task gather duet study @SCENE@ --out @STUDY@ --untimed
)sh";

constexpr std::string_view slurm_begin = R"sh(#!/usr/bin/env bash
# Submits all jobs to Slurm. It may be called again: what is whole stays.
@SOURCE@
if ! command -v sbatch >/dev/null; then
  echo "start.sh: sbatch is not installed here: call this script on a machine that submits jobs to Slurm" >&2
  exit 4
fi
mkdir -p "$farm/logs"
rm -f -- "$farm"/logs/*.state

# submit WORD...: submits a job and prints its number.
submit() {
  local job
  job=$(sbatch --parsable @SBATCH@ "$@")
  printf '%s\n' "$job" >>"$farm/logs/jobs"
  printf '%s\n' "${job%%;*}"
}
)sh";

// Drawing tasks that wait for frames must not keep the next job of the simulation from starting, hence
// --nice.
constexpr std::string_view slurm_runs = R"sh(
first='' last=''
for ((link = 1; link <= @CHAIN@; ++link)); do # each job continues where the time limit of the one before ended it
  last=$(submit --array=1-@RUNS@ ${last:+"--dependency=afterany:$last"} "$farm/simulate.sh")
  first=${first:-$last}
done
before=$last
@FOLLOW@rest=$(submit --array=1-@DRAWS@ --dependency="afterany:$before" "$farm/draw.sh") # skips what is drawn
ending=$(submit --array=1-@RUNS@ --dependency="afterany:$rest" "$farm/finish.sh")
@COLLECT@echo "submitted: simulation $first to $last, drawing $rest, end $ending"
)sh";

constexpr std::string_view slurm_follow =
    R"sh(following=$(submit --array=1-@DRAWS@ --dependency="after:$first" --nice=100 "$farm/draw.sh" '' 600)
before=$before:$following
)sh";

constexpr std::string_view slurm_study = R"sh(
points=$(submit --array=1-@POINTS@ "$farm/point.sh")
end=$(submit --dependency="afterany:$points" "$farm/gather.sh")
echo "submitted: runs $points, report $end"
)sh";

constexpr std::string_view here_begin = R"sh(#!/usr/bin/env bash
# Carries out all tasks on this machine, as many at a time as there are processors, or as JOBS in the environment says.
# It may be called again: what is whole stays.
@SOURCE@
@NEEDS@mkdir -p "$farm/logs"
rm -f -- "$farm"/logs/*.state
jobs=${JOBS:-$(nproc)}
trap 'kill -- $(jobs -p) 2>/dev/null || true' INT TERM

# each PHASE COUNT SCRIPT [WORD...]: calls SCRIPT NUMBER WORD... for each NUMBER up to COUNT. Tasks that fail leave
# their status, and the others go on.
each() {
  local phase=$1 count=$2 script=$3
  shift 3
  @EACH@
}
)sh";

constexpr std::string_view with_xargs =
    R"sh(seq 1 "$count" | xargs -P "$jobs" -I '{}' bash "$farm/$script" '{}' "$@" || echo "start.sh: tasks failed: $phase" >&2)sh";
constexpr std::string_view with_parallel =
    R"sh(seq 1 "$count" | parallel --will-cite -q --jobs "$jobs" --joblog "$farm/logs/$phase.joblog" bash "$farm/$script" '{}' "$@" ||
    echo "start.sh: tasks failed: $phase (logs/$phase.joblog)" >&2)sh";
constexpr std::string_view needs_parallel = R"sh(if ! command -v parallel >/dev/null; then
  echo "start.sh: GNU parallel is not installed (apt install parallel)" >&2
  exit 4
fi
)sh";

constexpr std::string_view here_runs = R"sh(
each simulate @RUNS@ simulate.sh &
simulation=$!
@FOLLOW@wait "$simulation"
each draw @DRAWS@ draw.sh 0
each finish @RUNS@ finish.sh
@COLLECT@duet farm --status "$farm"
)sh";

constexpr std::string_view here_study = R"sh(
each points @POINTS@ point.sh
bash "$farm/gather.sh" || true
duet farm --status "$farm"
)sh";

// Returns the cases of simulate.sh: the changes of each variation.
std::string cases(const Plan& plan) {
  if (plan.kind != Kind::variations) return {};
  std::string text = "case $number in\n";
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    std::vector<std::string> set;
    for (const std::string& change : plan.runs[i].set) set.insert(set.end(), {"--set", change});
    text += fmt::format("  {}) changes+=({}) ;;\n", i + 1, words(set));
  }
  return text + "  *) echo \"simulate.sh: there is no run $number\" >&2; exit 2 ;;\nesac\n";
}

// Returns whether a value in the scripts contains characters that shells expand outside of single quotes.
bool has_dollars(const Plan& plan) {
  std::string all = plan.folder.string() + plan.work.string() + plan.program.string() + plan.scene.string() +
                    plan.study.string() + words(plan.changes) + words(plan.sbatch);
  for (const PlannedRun& run : plan.runs) all += run.folder.string() + words(run.set);
  return all.find_first_of("$`") != std::string::npos;
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return "'" + escaped + "'";
}

std::map<std::string, std::string> scripts(const Plan& plan) {
  const bool is_slurm = plan.engine == "slurm", has_variations = plan.kind == Kind::variations;
  constexpr int margin =
      85;  // % of the time limit after which no further frame begins; the rest is for the frame in hand
  Values values = {
      {"FARM", quoted(plan.folder.string())},
      {"WORK", quoted(plan.work.string())},
      {"PROGRAM", quoted(plan.program.string())},
      {"SCENE", quoted(plan.scene.string())},
      {"STUDY", quoted(plan.study.string())},
      {"LITERALS", has_dollars(plan) ? "# shellcheck disable=SC2016 # values are meant as they are\n" : ""},
      {"CHANGES", words(plan.changes)},
      {"THREADS", std::to_string(plan.threads)},
      // A task that Slurm gave to another node, because it took the first one for dead, waits for the first
      // one's end.
      {"WAIT", std::to_string(is_slurm ? plan.minutes * 60 / 2 : 120)},
      {"STOP", is_slurm ? fmt::format(" --stop-after {}", plan.minutes * 60 * margin / 100) : ""},
      {"TASKS", std::to_string(plan.tasks)},
      {"LAST", std::to_string(plan.frames)},
      {"CHAIN", std::to_string(plan.chain)},
      {"RUNS", std::to_string(plan.runs.size())},
      {"DRAWS", std::to_string(plan.runs.size() * static_cast<std::size_t>(plan.tasks))},
      {"POINTS", std::to_string(plan.points)},
      {"SBATCH", words(plan.sbatch)},
      {"EACH", std::string(plan.engine == "parallel" ? with_parallel : with_xargs)},
      {"NEEDS", std::string(plan.engine == "parallel" ? needs_parallel : "")},
      {"CASES", cases(plan)}};
  values["RUN_FOLDER"] = plan.kind == Kind::run
                             ? fmt::format("printf '%s\\n' {}", quoted(plan.runs.front().folder.string()))
                             : "printf '%s/runs/%04d\\n' \"$farm\" \"$1\"";
  values["SOURCE"] = filled(source_setup, values);
  if (!values["SOURCE"].empty()) values["SOURCE"].pop_back();  // the line end
  // Of variations all simulations may not run at the same time: their pictures are drawn afterwards.
  values["FOLLOW"] = has_variations ? ""
                     : is_slurm     ? filled(slurm_follow, values)
                                    : filled("each follow @DRAWS@ draw.sh 60\n", values);
  values["COLLECT"] = !has_variations ? ""
                      : is_slurm
                          ? "submit --dependency=\"afterany:$ending\" \"$farm/collect.sh\" >/dev/null\n"
                          : "bash \"$farm/collect.sh\" || true\n";
  const auto start = [&](std::string_view begin, std::string_view rest) {
    return filled(std::string(begin) + std::string(rest), values);
  };
  std::map<std::string, std::string> files = {{"setup.sh", filled(setup, values)}};
  const auto add = [&](const std::string& name, std::string_view text, int processors) {
    files[name + ".sh"] = head(plan, name, processors) + filled(text, values);
  };
  if (plan.kind == Kind::study) {
    add("point", point, 1);
    add("gather", gather, 1);
    files["start.sh"] = is_slurm ? start(slurm_begin, slurm_study) : start(here_begin, here_study);
    return files;
  }
  add("simulate", simulate, plan.threads);
  add("draw", draw, 1);
  add("finish", finish, 1);
  if (has_variations) add("collect", collect_script, 1);
  files["start.sh"] = is_slurm ? start(slurm_begin, slurm_runs) : start(here_begin, here_runs);
  return files;
}

}  // namespace duet::farm
