// How far a farm is: frames that are simulated and drawn, tasks that failed, and the time that is left.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/farm/plan.h"

namespace duet::farm {

// What is known of one run. Frames count from 0.
struct RunStatus {
  int simulated = -1;                  // last whole frame; -1: none
  int drawn = 0;                       // number of pictures
  int frames = 0;                      // last frame that the run is to have
  bool is_other = false;               // its folder holds frames of other settings, which do not count
  std::string writer;                  // program that simulates it; empty: none
  std::optional<double> seconds_left;  // s, estimated; empty: unknown, or nothing is left
  // Returns whether all frames are simulated and drawn.
  bool is_done() const { return simulated >= frames && drawn > frames; }
};

// What a task left in its file logs/NAME.state.
struct TaskState {
  std::string name, status, node;  // status: a number, or "running"
  long process = 0;                // process id of its script on the node
  std::string log;                 // file in logs/
  std::string last_line;           // of the log, or the error in it
  // Returns whether it ended and did not do its work; one whose time was over is continued by others.
  bool has_failed() const { return status != "0" && status != "75" && status != "running"; }
};

// Everything that `duet farm --status` prints.
struct Status {
  std::vector<RunStatus> runs;   // as in the plan
  std::vector<TaskState> tasks;  // by name
  int points = 0;                // of a study: runs that have a result
};

// Returns what the tasks of a farm left, by name. Throws FileError.
std::vector<TaskState> task_states(const Plan& plan);

// Examines the files of a farm. Throws FileError.
Status examine(const Plan& plan);

// Returns what the log of a task says about its end: the last error in it, or its last line.
std::string end_of_log(const fs::path& log);

}  // namespace duet::farm
