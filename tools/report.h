// What the program says: progress while it works, and one outcome at the end.
#pragma once

#include <chrono>
#include <exception>
#include <mutex>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "sim/base/error.h"
#include "sim/simulation/frame.h"

namespace duet::tools {

// How a command ended. The text says what is there now and what can be done next; it is empty for commands
// whose output on standard output is all there is to say.
struct Outcome {
  ExitStatus status = ExitStatus::done;
  std::string text;
};

// The object as JSON in ASCII: other characters as \uNNNN, bytes that are no UTF-8 as U+FFFD. On one line
// unless an indent is given.
std::string json_text(const nlohmann::ordered_json& object, int indent = -1);

// Writes a command's product to standard output, by printable(). Throws FileError unless the reader merely
// went away.
void print(const std::string& text);

// Progress of a long command on standard output: one live line on a terminal, otherwise a line a frame; with
// `json` one JSON object a line; with `quiet` the outcome alone. Errors go to standard error as well. Safe to
// use from two threads.
class Report {
 public:
  Report(bool quiet, bool json);

  // `last_frame` bounds the work, `frames_to_draw` is 0 when nothing is drawn.
  void start(const std::string& what, const std::string& folder, int first_frame, int last_frame,
             int frames_to_draw);
  void simulated(const FrameStats& stats);
  void drawn(int frame, double seconds);       // wall time of drawing it
  void exported(int frame, int done, int of);  // `done` of the frames, with this one
  void note(const std::string& text);
  void error(const std::string& text);
  ExitStatus failure(const std::exception_ptr& exception);  // says what was thrown, returns its exit status
  void outcome(const Outcome& outcome);

 private:
  void progress(const std::string& live, const std::string& line);
  std::string time_left() const;

  const bool quiet_, json_, live_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point started_;
  int first_frame_ = 0, last_frame_ = 0, frames_to_draw_ = 0;
  int simulated_ = 0, drawn_ = 0;
  double drawing_seconds_ = 0;   // wall time of drawing these
  std::string simulation_line_;  // the part of the live line that `simulated` writes
  bool live_line_shown_ = false;
  std::string error_;
};

}  // namespace duet::tools
