// The runs of a study. Each is a child process `duet sim` with a folder named by a hash of everything that
// its result depends on, so that a study which was stopped continues where it was.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/commands.h"

namespace duet::study {

namespace fs = std::filesystem;

// One run of one setting.
struct Run {
  tools::SceneChoice scene;
  int frames = 1;      // last frame
  int repetition = 1;  // number of the repetition, from 1
  bool timed = true;   // runs alone, on one processor, with one thread
  double limit = 600;  // s, after which it is ended and counts as failed
  // Runner::carry_out() sets the following members.
  fs::path folder;      // run directory
  bool failed = false;  // ended with another exit status than 0
  std::string error;    // why it failed; empty: it did not
};

// Carries out runs as child processes.
class Runner {
 public:
  // `folder`: holds all run directories. `program`: the program duet that simulates; empty: this one. `jobs`:
  // number of untimed runs at a time.
  Runner(fs::path folder, fs::path program, int jobs, tools::Report& report);

  // Carries out the runs that have no result yet, the untimed ones first, and reports how each ended. Returns
  // false if it was interrupted. Throws FileError, and Error (usage) for scenes that cannot be read.
  bool carry_out(std::vector<Run*>& runs);

  // Carries out the run of the number `point` (from 1) among the distinct ones, unless it has a result.
  // Returns false if it was interrupted. Throws Error (usage) if there is no such run, FileError if another
  // program works on it.
  bool carry_out_point(std::vector<Run*>& runs, int point);
  // Identifies all runs and returns those with different folders, the untimed ones first.
  std::vector<Run*> distinct(std::vector<Run*>& runs) const;

  // Returns the number of distinct runs that have a result.
  int with_result(std::vector<Run*>& runs) const;

  // Returns the processor that timed runs are bound to; -1: none.
  int processor() const { return processor_; }
  // Returns the number of runs that were carried out, without those that had a result already.
  int simulated() const { return simulated_; }

 private:
  struct Child;
  // Sets the folder of a run, by the hash of scene, effects, program and number of frames.
  void identify(Run& run) const;
  // Returns whether the run has a result, and sets its failure from that.
  bool finished(Run& run) const;
  // Starts the process of a run. Throws FileError.
  Child start(Run& run) const;
  // Records how a process ended. `status` is that of waitpid(), `overdue`: it was ended for its time limit.
  void conclude(Run& run, int status, bool overdue) const;
  // Carries out runs, up to `at_once` at a time. Returns false if it was interrupted.
  bool carry_out_together(const std::vector<Run*>& runs, std::size_t at_once);

  fs::path folder_, program_;
  int jobs_, processor_;
  tools::Report& report_;
  std::uint64_t program_hash_;
  int simulated_ = 0, to_simulate_ = 0;
};

}  // namespace duet::study
