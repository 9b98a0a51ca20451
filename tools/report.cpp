#include "tools/report.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>

#include "tools/wording.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/printable.h"

namespace duet::tools {
namespace {

using Json = nlohmann::ordered_json;

// Writes progress and ignores failures: a log that cannot be written is no reason to stop a simulation.
void write_to(FILE* stream, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fflush(stream);
}

std::string line_of(const Json& object) { return json_text(object) + '\n'; }

// Returns the first word of the outcome.
const char* word_of(ExitStatus status) {
  switch (status) {
    case ExitStatus::done:
      return "done";
    case ExitStatus::interrupted:
      return "interrupted";
    case ExitStatus::differs:
      return "differs";
    case ExitStatus::unfinished:
      return "unfinished";
    default:
      return "failed";
  }
}

// Returns the message for a thread that the system refuses; `reason` is what the library says.
std::string no_thread(const char* reason) {
  return fmt::format(
      "the system refuses a thread: {} (raise the limits on memory and processes, or give fewer --threads)",
      reason);
}

}  // namespace

std::string json_text(const Json& object, int indent) {
  return object.dump(indent, ' ', true, Json::error_handler_t::replace);
}

void print(const std::string& text) {
  const std::string shown = printable(text);
  errno = 0;
  const bool written = std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size();
  if ((!written || std::fflush(stdout) != 0) && errno != EPIPE)
    throw io::system_error("standard output", "cannot write", errno);
}

Report::Report(const ReportStyle& style)
    : quiet_(style.quiet), json_(style.json), live_(!quiet_ && !json_ && ::isatty(STDOUT_FILENO) == 1) {}

void Report::start(const std::string& what, const std::string& folder, int first_frame, int last_frame,
                   int frames_to_draw) {
  const std::lock_guard lock(mutex_);
  started_ = std::chrono::steady_clock::now();
  first_frame_ = first_frame;
  last_frame_ = last_frame;
  frames_to_draw_ = frames_to_draw;
  if (quiet_) return;
  if (json_) {
    write_to(stdout, line_of({{"event", "start"},
                              {"scene", what},
                              {"folder", folder},
                              {"first_frame", first_frame},
                              {"last_frame", last_frame},
                              {"frames_to_draw", frames_to_draw}}));
  } else {
    write_to(stdout, fmt::format("{}: frames {} to {} into {}\n", printable_line(what), first_frame,
                                 last_frame, printable_line(folder)));
  }
}

void Report::simulated(const FrameStats& stats) {
  const std::lock_guard lock(mutex_);
  if (stats.frame > first_frame_) ++simulated_;
  const std::string left = time_left();
  const std::optional<DeepestOverlap>& drawn = stats.drawn_overlap;
  if (json_ && !quiet_)
    write_to(stdout, line_of({{"event", "frame"},
                              {"frame", stats.frame},
                              {"last_frame", last_frame_},
                              {"time", stats.time},
                              {"substeps", stats.substeps},
                              {"seconds", stats.seconds},
                              {"contacts", stats.contacts},
                              {"max_penetration", stats.max_penetration},
                              {"drawn_penetration", drawn ? Json(drawn->depth) : Json()},
                              {"time_left", left},
                              {"drawn", drawn_},
                              {"hash", fmt::format("{:016x}", stats.hash)}}));
  simulation_line_ = fmt::format("frame {}/{}  {} substeps  {:.2g} s/frame", stats.frame, last_frame_,
                                 stats.substeps, stats.seconds);
  if (!left.empty()) simulation_line_ += "  left " + left;
  progress(frames_to_draw_ > 0 ? fmt::format("{}  drawn {}/{}", simulation_line_, drawn_, frames_to_draw_)
                               : simulation_line_,
           fmt::format("{}  contacts {}  penetration {:.2g} m{}\n", simulation_line_, stats.contacts,
                       stats.max_penetration, drawn ? fmt::format(", drawn {:.2g} m", drawn->depth) : ""));
}

void Report::drawn(int frame, double seconds) {
  const std::lock_guard lock(mutex_);
  ++drawn_;
  drawing_seconds_ += seconds;
  if (json_ && !quiet_)
    write_to(stdout, line_of({{"event", "drawn"},
                              {"frame", frame},
                              {"seconds", seconds},
                              {"drawn", drawn_},
                              {"of", frames_to_draw_}}));
  std::string live = fmt::format("drawn {}/{}", drawn_, frames_to_draw_);
  if (!simulation_line_.empty()) {
    live = simulation_line_ + "  " + live;
  } else if (const std::string left = time_left(); !left.empty()) {
    live += "  left " + left;
  }
  progress(live, fmt::format("drawn frame {}  ({}/{})\n", frame, drawn_, frames_to_draw_));
}

void Report::exported(int frame, int done, int of) {
  const std::lock_guard lock(mutex_);
  if (json_ && !quiet_)
    write_to(stdout, line_of({{"event", "exported"}, {"frame", frame}, {"exported", done}, {"of", of}}));
  progress(fmt::format("exported {}/{}", done, of),
           fmt::format("exported frame {}  ({}/{})\n", frame, done, of));
}

void Report::note(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (quiet_) return;
  if (json_) return write_to(stdout, line_of({{"event", "note"}, {"text", text}}));
  write_to(stdout, fmt::format("{}note: {}\n", live_line_shown_ ? "\r\x1b[K" : "", printable_line(text)));
  live_line_shown_ = false;
}

void Report::error(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (live_line_shown_) write_to(stdout, "\n");
  live_line_shown_ = false;
  error_ = text;
  write_to(stderr, fmt::format("duet: {}\n", printable(text)));
}

ExitStatus Report::failure(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const Error& failure) {
    error(failure.what());
    return failure.status();
  } catch (const std::filesystem::filesystem_error& failure) {
    error(failure.what());
    return ExitStatus::files;
  } catch (const std::bad_alloc&) {
    error(out_of_memory);
    return ExitStatus::simulation;
  } catch (const std::system_error& failure) {
    error(no_thread(failure.what()));
    return ExitStatus::files;
  } catch (const std::exception& failure) {
    // TBB, with which OpenVDB makes its threads, says so by a std::runtime_error.
    if (std::string_view(failure.what()).starts_with("pthread_create")) {
      error(no_thread(failure.what()));
      return ExitStatus::files;
    }
    error(fmt::format("internal error: {}", failure.what()));
    return ExitStatus::simulation;
  }
}

void Report::outcome(const Outcome& outcome) {
  const std::lock_guard lock(mutex_);
  if (json_) {
    Json object = {{"event", "outcome"},
                   {"outcome", word_of(outcome.status)},
                   {"status", static_cast<int>(outcome.status)},
                   {"text", outcome.text}};
    if (!error_.empty()) object["error"] = error_;
    return write_to(stdout, line_of(object));
  }
  if (live_line_shown_) write_to(stdout, "\n");
  write_to(stdout, fmt::format("{}: {}\n", word_of(outcome.status), printable_line(outcome.text)));
}

void Report::progress(const std::string& live, const std::string& line) {
  if (quiet_ || json_) return;
  write_to(stdout, live_ ? "\r\x1b[K" + live : line);
  live_line_shown_ = live_;
}

// Simulation and drawing run side by side, so that the slower one decides. Both are extrapolated linearly. A
// picture waits for its frame: the time until the first picture says nothing about how long drawing takes.
std::string Report::time_left() const {
  const double so_far = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
  double seconds = 0;
  if (simulated_ > 0) seconds = so_far / simulated_ * (last_frame_ - first_frame_ - simulated_);
  if (drawn_ > 0) seconds = std::max(seconds, drawing_seconds_ / drawn_ * (frames_to_draw_ - drawn_));
  return seconds > 0 ? clock_text(seconds) : std::string();
}

}  // namespace duet::tools
