// The plan of a farm: the runs that many machines work on, and how their work is divided into tasks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/commands.h"

namespace duet::farm {

namespace fs = std::filesystem;

// What a farm works on.
enum class Kind { run, variations, study };

// One run of a farm.
struct PlannedRun {
  fs::path folder;  // run directory, absolute
  // Keys that vary between the runs, in the order of the command line, and their values in this run.
  std::vector<std::pair<std::string, std::string>> values;
  std::vector<std::string> set;  // "key=value" of --set, by which this run differs from the others
  int frames = 0;                // last frame
  // Identity of what is simulated, as checkpoints have it; empty: the plan is of a program that kept none.
  std::optional<std::uint64_t> identity = {};
};

// Everything that the scripts need. Paths are absolute.
struct Plan {
  Kind kind = Kind::run;
  std::string engine;                // slurm, parallel or local
  std::string name;                  // of the scene or study, for names of jobs
  fs::path folder;                   // scripts, logs and variations: the folder of the run, ending in .farm
  fs::path work;                     // folder in which the commands run
  fs::path program;                  // duet
  fs::path scene;                    // scene file, folder of the run to repeat, or specification of the study
  std::vector<std::string> changes;  // words of the command line that change the scene of all runs
  int frames = 0;                    // last frame of the longest run
  std::vector<PlannedRun> runs;      // empty for a study
  fs::path study;                    // folder of the study; empty: none
  int points = 0;                    // number of runs of the study
  int tasks = 1;                     // drawing tasks of each run
  int threads = 1, minutes = 60, chain = 1;  // as in FarmOptions
  std::vector<std::string> sbatch;           // as in FarmOptions
};

// Returns the path of this program as tasks call it. The program of a portable build is called by its
// launcher.
fs::path this_program();

// Makes the plan of the options. Throws Error (usage), SceneError with the flaws of a variation, and
// FileError.
Plan make_plan(const tools::FarmOptions& options);

// Returns the plan as JSON, for farm.json.
std::string plan_json(const Plan& plan);

// Reads the plan of `name`: the folder of a farm, the folder or the name of a run or study that has one, or
// the scene or specification that it was written for. `out` is the value of --out; empty: none. Throws
// FileError if there is no plan, or if it is damaged.
Plan read_plan(const std::string& name, const std::string& out = {});

// Returns whether the folder of a run holds frames of another scene or other settings than the plan asks for.
// Such a run cannot be continued, and its results are not those of the plan. Throws FileError.
bool holds_other_run(const PlannedRun& run);

// Splits the text of --vary "key=a,b,c". Commas in brackets, braces and quotes belong to values. Throws Error
// (usage) if the key or a value is missing.
std::pair<std::string, std::vector<std::string>> split_variation(const std::string& text);

}  // namespace duet::farm
