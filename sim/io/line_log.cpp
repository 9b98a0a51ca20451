#include "sim/io/line_log.h"

#include <cerrno>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/frame_limits.h"
#include "sim/io/json_text.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

// Returns the number "frame" of a line, or -1 if the line is torn, is not a JSON object or has no possible
// frame.
int frame_of_line(std::string_view line) {
  const nlohmann::json object = parse_json(line);
  if (!object.is_object()) return -1;
  const auto frame = object.find("frame");
  if (frame == object.end() || !frame->is_number_integer()) return -1;
  const double number = frame->get<double>();
  return number >= 0 && number <= max_frames ? static_cast<int>(number) : -1;
}

// Calls visit(line, frame_of_line(line)) for each line that has its line end, which is part of `line`.
template <class Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  for (std::size_t end = 0; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1)) {
    const std::string_view line = text.substr(0, end + 1);
    visit(line, frame_of_line(line));
  }
}

// Returns the lines with frames from 0 to `last_kept`.
std::string lines_up_to(std::string_view text, int last_kept) {
  std::string kept;
  for_each_line(text, [&](std::string_view line, int frame) {
    if (frame >= 0 && frame <= last_kept) kept += line;
  });
  return kept;
}

}  // namespace

std::vector<int> frames_of_lines(std::string_view text) {
  std::vector<int> frames;
  for_each_line(text, [&](std::string_view, int frame) {
    if (frame >= 0) frames.push_back(frame);
  });
  return frames;
}

std::string line_of_frame(std::string_view text, int frame) {
  std::string found;
  for_each_line(text, [&](std::string_view line, int number) {
    if (found.empty() && number == frame && frame >= 0) found = line;
  });
  return found;
}

LineLog::LineLog(const RunDirectory& run, const fs::path& path, int last_kept) : run_(run), path_(path) {
  const bool is_there = fs::exists(path_);
  const std::string text = is_there && last_kept >= 0 ? read_file(path_) : std::string();
  const std::string kept = lines_up_to(text, last_kept);
  if (!is_there || last_kept < 0 || kept != text) run_.write(path_, kept);
  hash_.add(kept);
  list();
  file_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file_ < 0) throw system_error(path_, "cannot write", errno);
}

LineLog::~LineLog() { ::close(file_); }

bool LineLog::is_empty() const { return ::lseek(file_, 0, SEEK_END) == 0; }

void LineLog::append(const std::string& line) {
  append_line(file_, path_, line);
  hash_.add(line);
  hash_.add("\n");
}

void LineLog::list() const {
  if (run_.journal) run_.journal->list(path_, {hash_.size(), hash_.value()});
}

}  // namespace duet::io
