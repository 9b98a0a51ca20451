// The runs of a study: each is a child process `duet sim`, kept in a folder under the hash of all that its
// result depends on, so that a study that was stopped goes on where it was.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/commands.h"

namespace duet::study {

namespace fs = std::filesystem;

struct Run {
  tools::SceneChoice scene;
  int frames = 1;
  int repetition = 1;  // 1, 2, ...
  bool timed = true;   // alone, on one processor, with one thread
  double limit = 600;  // s
  // Found by prepare:
  fs::path folder;  // a run directory
  bool failed = false;
  std::string error;  // why
};

class Runner {
 public:
  // `program`: the duet that simulates; empty: this one. `jobs`: untimed runs at the same time.
  Runner(fs::path folder, fs::path program, int jobs, tools::Report& report);

  // Carries out what is not there yet, the untimed runs first, and says how each run ended. Throws FileError,
  // and Error (usage) for scenes that cannot be read. False when interrupted.
  bool carry_out(std::vector<Run*>& runs);

  int processor() const { return processor_; }  // of timed runs
  int simulated() const { return simulated_; }  // runs that were not there yet

 private:
  struct Child;
  void identify(Run& run) const;
  bool finished(Run& run) const;
  Child start(Run& run) const;
  void conclude(Run& run, int status, bool overdue) const;
  bool carry_out_together(const std::vector<Run*>& runs, std::size_t at_once);

  fs::path folder_, program_;
  int jobs_, processor_;
  tools::Report& report_;
  std::uint64_t program_hash_;
  int simulated_ = 0, to_simulate_ = 0;
};

}  // namespace duet::study
