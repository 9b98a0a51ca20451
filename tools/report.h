// Output of the program: progress while it works, and one outcome at the end.
#pragma once

#include <chrono>
#include <exception>
#include <mutex>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "sim/base/error.h"
#include "sim/simulation/frame.h"

namespace duet::tools {

// What a command says if there is not enough memory.
inline constexpr const char* out_of_memory =
    "out of memory (fewer cells in the deformable bodies or smaller pictures need less)";

// The outcome of a command. The text states what exists now and what can be done next. It is empty for
// commands whose whole result went to standard output.
struct Outcome {
  ExitStatus status = ExitStatus::done;
  std::string text;
};

// Returns the object as JSON in ASCII: other characters become \uNNNN, bytes that are not UTF-8 become
// U+FFFD. It takes one line unless an indent is given.
std::string json_text(const nlohmann::ordered_json& object, int indent = -1);

// Writes the result of a command to standard output, with control characters made visible by printable().
// Throws FileError if it cannot be written. A closed pipe is no error.
void print(const std::string& text);

// How a Report shows what it is told: options of the command line.
struct ReportStyle {
  bool quiet = false;  // true: only the outcome
  bool json = false;   // true: a JSON object a line
};

// Shows the progress of a long command on standard output: one live line on a terminal, otherwise a line for
// each frame, or what ReportStyle says. Errors go to standard error in all cases. Safe to use from several
// threads.
class Report {
 public:
  explicit Report(const ReportStyle& style);

  // Announces the work: `what` is its title, `folder` where results go, `first_frame` to `last_frame` what
  // will be simulated. `frames_to_draw` is 0 if nothing will be drawn.
  void start(const std::string& what, const std::string& folder, int first_frame, int last_frame,
             int frames_to_draw);
  // Reports a simulated frame, and the time that is left.
  void simulated(const FrameStats& stats);
  // Reports a frame that took `seconds` (s) of wall time to draw.
  void drawn(int frame, double seconds);
  // Reports an exported frame, the `done`-th of `of`.
  void exported(int frame, int done, int of);
  // Prints a note, unless the report is quiet.
  void note(const std::string& text);
  // Prints an error to standard error, and keeps its text for the outcome.
  void error(const std::string& text);
  // Prints the error of an exception and returns the exit status that belongs to it.
  ExitStatus failure(const std::exception_ptr& exception);
  // Prints the outcome, last of all.
  void outcome(const Outcome& outcome);

 private:
  // Prints `live` on a terminal and `line` elsewhere; nothing with quiet or json.
  void progress(const std::string& live, const std::string& line);
  // Estimates the time that is left, as "h:mm:ss"; empty before the first frame is done.
  std::string time_left() const;

  const bool quiet_, json_, live_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point started_;
  int first_frame_ = 0, last_frame_ = 0, frames_to_draw_ = 0;
  int simulated_ = 0, drawn_ = 0;  // frames so far
  double drawing_seconds_ = 0;     // wall time of drawing them
  std::string simulation_line_;    // part of the live line about the simulation
  bool live_line_shown_ = false;
  std::string error_;  // text of the last error; empty: none
};

}  // namespace duet::tools
