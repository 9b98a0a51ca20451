// Encodes videos by the program ffmpeg. It is started directly, without a shell, so that no file name needs
// quoting.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/program.h"
#include "sim/io/run_journal.h"

namespace duet::render {
namespace {

namespace fs = std::filesystem;

// Returns sorted frames as text: "3, 5 to 8".
std::string ranges_of(const std::vector<int>& frames) {
  std::string text;
  for (std::size_t i = 0, end = 0; i < frames.size(); i = end) {
    for (end = i + 1; end < frames.size() && frames[end] == frames[end - 1] + 1;) ++end;
    text += (text.empty() ? "" : ", ") + std::to_string(frames[i]);
    if (end > i + 1) text += fmt::format(" to {}", frames[end - 1]);
  }
  return text;
}

// Returns the frames that have a picture, or should have one by the run's journal.
std::set<int> drawn_frames(const io::RunDirectory& run) {
  std::set<int> drawn;
  const auto add = [&](const fs::path& file) {
    if (const int frame = io::frame_of_file(file, ".png"); frame >= 0) drawn.insert(frame);
  };
  for (const fs::path& file : io::files_in(run.root / "image")) add(file);
  if (!run.journal) return drawn;
  for (const auto& [name, entry] : run.journal->entries())
    if (entry.state != io::RunJournal::Entry::State::removed && fs::path(name).parent_path() == "image")
      add(name);
  return drawn;
}

// Returns the first frame with a picture; empty if there is none. Throws FileError if a picture between the
// first and the last is missing, empty or damaged.
std::optional<int> first_picture(const io::RunDirectory& run) {
  const std::set<int> drawn = drawn_frames(run);
  if (drawn.empty()) return std::nullopt;
  std::vector<int> missing, damaged;
  for (int frame = *drawn.begin(); frame <= *drawn.rbegin(); ++frame)
    if (!io::holds_bytes(run.image(frame)))
      missing.push_back(frame);
    else if (run.journal && !run.journal->fault(run.image(frame)).empty())
      damaged.push_back(frame);
  std::vector<std::string> faults;
  for (const auto& [frames, what] : {std::pair{&missing, "missing or empty"}, {&damaged, "damaged"}})
    if (!frames->empty())
      faults.push_back(
          fmt::format("{}, of frame{} {}", what, frames->size() == 1 ? "" : "s", ranges_of(*frames)));
  if (faults.empty()) return *drawn.begin();
  missing.insert(missing.end(), damaged.begin(), damaged.end());
  const auto [first, last] = std::minmax_element(missing.begin(), missing.end());
  throw FileError(
      (run.root / "image").string(),
      fmt::format("there is no video, which would end early: pictures are {}", fmt::join(faults, "; ")),
      fmt::format("`duet render RUN --frames {}:{}` draws those whose meshes are there, then `duet render "
                  "RUN` makes the video",
                  *first, *last));
}

// Returns a hash of the names and marks of the pictures that the journal lists; 0 without a journal.
std::uint64_t hash_of_pictures(const io::RunDirectory& run) {
  if (!run.journal) return 0;
  std::string text;
  for (const auto& [name, entry] : run.journal->entries())
    if (entry.state == io::RunJournal::Entry::State::whole && fs::path(name).parent_path() == "image")
      text += fmt::format("{} {} {:x}\n", name, entry.mark.bytes, entry.mark.hash);
  return io::mark_of(text).hash;
}

// Returns the command that encodes H.264 which every player shows: even sizes, 4:2:0, HD colors. One thread
// and no dates make equal bytes every time. File names are relative to the run's folder, because ffmpeg would
// take a name of that folder for a pattern.
std::vector<std::string> ffmpeg_command(const std::string& ffmpeg, double fps, int first,
                                        const std::string& output) {
  const std::string options = fmt::format(
      "-hide_banner -loglevel error -nostdin -xerror -y -framerate {} -start_number {} -i image/%04d.png "
      "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p "
      "-c:v libx264 -crf 18 -pix_fmt yuv420p -threads 1 -fflags +bitexact -flags:v +bitexact "
      "-colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1 -color_range tv -movflags +faststart "
      "-f mp4",
      fps, first);
  std::vector<std::string> command = {ffmpeg};
  std::istringstream words(options);
  for (std::string word; words >> word;) command.push_back(word);
  command.push_back(output);
  return command;
}

}  // namespace

bool is_encoded(const io::RunDirectory& run, const std::string& name) {
  const fs::path video = run.root / (name + ".mp4");
  if (!run.journal || !io::holds_bytes(video)) return false;
  const auto entry = run.journal->entry(video);
  return entry && entry->state == io::RunJournal::Entry::State::whole && entry->made_of != 0 &&
         entry->made_of == hash_of_pictures(run) && run.journal->fault(video).empty();
}

std::string encode_video(const io::RunDirectory& run, const std::string& name, double fps,
                         const std::string& ffmpeg, const std::atomic<bool>* stop) {
  const std::optional<int> first = first_picture(run);
  if (!first) return fmt::format("no video: {} holds no pictures", (run.root / "image").string());

  const fs::path video = run.root / (name + ".mp4");
  io::remove_temporaries(run.root, io::RunJournal::writers_of_parts(run.root), video.filename().string());
  const std::string unfinished = io::create_temporary(video).filename().string();
  const std::uint64_t made_of = hash_of_pictures(run);
  const ProgramEnd outcome =
      run_program(ffmpeg_command(ffmpeg, fps, *first, "./" + unfinished), run.root, stop);
  std::error_code problem;
  if (outcome.start_error == 0 && outcome.status == 0) {
    if (run.journal) run.journal->replace(video, io::mark_of_file(run.root / unfinished));
    fs::rename(run.root / unfinished, video, problem);
    if (!problem && run.journal) run.journal->list(video, io::mark_of_file(video), made_of);
    if (!problem) return video.string();
  }
  std::error_code ignored;
  fs::remove(run.root / unfinished, ignored);
  if (stop != nullptr && *stop) return "no video: interrupted";
  if (outcome.start_error == ENOENT || outcome.status == 127)
    return fmt::format("no video: {} is not installed (apt install ffmpeg); the pictures are in {}", ffmpeg,
                       (run.root / "image").string());
  if (outcome.start_error != 0)
    return fmt::format("no video: {} cannot be started: {}", ffmpeg, std::strerror(outcome.start_error));
  if (outcome.status != 0)
    return fmt::format("no video: {} failed with status {}: {}", ffmpeg, outcome.status,
                       last_line(outcome.words));
  return fmt::format("no video: {} cannot be written: {}", video.string(), problem.message());
}

}  // namespace duet::render
