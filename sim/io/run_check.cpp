#include "sim/io/run_check.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/line_log.h"
#include "sim/io/run_folder.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

using State = RunJournal::Entry::State;

// Folders of the files that have the number of a frame as name, and the extensions of these files.
constexpr const char* numbered[][2] = {
    {"mesh", ".obj"}, {"levelset", ".vdb"}, {"values", ".npy"}, {"image", ".png"}, {"checkpoint", ".bin"}};

// Texts about a file that the journal does not list.
constexpr const char* not_whole =
    ": is of a frame that is not whole, or was not whole when its program ended";
constexpr const char* not_listed = ": is not in the journal, which was damaged, or another program wrote it";

// Returns the frame of a numbered file of a run, given by its path relative to the run's folder; -1 for
// other files.
int frame_of(const fs::path& name) {
  for (const auto& [folder, extension] : numbered)
    if (name.parent_path() == folder) return frame_of_file(name, extension);
  return -1;
}

// Lists the files in the folder that a run writes, by their paths relative to the folder. The files of
// source/ are not among them.
std::set<std::string> files_of_run(const RunDirectory& run) {
  std::set<std::string> files;
  for (const auto& [folder, extension] : numbered)
    for (const fs::path& path : files_in(run.root / folder))
      if (frame_of_file(path, extension) >= 0)
        files.insert((fs::path(folder) / path.filename()).generic_string());
  for (const fs::path& path : {run.manifest(), run.scene(), run.stats(), run.stage_hashes(),
                               run.static_level_sets(), run.body_values()})
    if (fs::exists(path)) files.insert(path.lexically_relative(run.root).generic_string());
  return files;
}

// Compares a file with the journal. Returns a sentence about what is wrong, or an empty text.
std::string fault_of(const RunDirectory& run, const RunJournal& journal, const std::string& name) {
  const fs::path path = run.root / name;
  try {
    const std::string fault = journal.fault(path);
    return fault.empty() ? std::string() : fmt::format("{}: {}", path.string(), fault);
  } catch (const FileError& error) {
    return error.what();
  }
}

// Compares the files with the journal as it is now. A run without a journal has one fault that says so.
RunCheck check_once(const RunDirectory& run) {
  RunCheck check;
  const std::shared_ptr<RunJournal> journal = RunJournal::read(run.root);
  if (!journal) {
    check.faults.push_back(
        fmt::format("{}: is missing: the files of the run cannot be checked (programs before 28 November "
                    "2026 wrote none)",
                    journal_path(run.root).string()));
    return check;
  }
  check.faults = journal->faults();
  const std::map<std::string, RunJournal::Entry> entries = journal->entries();
  int newest = -1;  // frame of the newest checkpoint that is listed; -1: none
  for (const auto& [name, entry] : entries) {
    if (entry.state == State::whole && fs::path(name).parent_path() == "checkpoint")
      newest = std::max(newest, frame_of(name));
    if (entry.state == State::replacing)
      check.notes.push_back(fmt::format("{}: was about to be replaced when the program that wrote it ended",
                                        (run.root / name).string()));
    if (entry.state != State::whole) continue;
    if (std::string fault = fault_of(run, *journal, name); !fault.empty())
      check.faults.push_back(std::move(fault));
    else
      ++check.whole;
  }
  if (journal->is_torn())
    check.notes.push_back(fmt::format(
        "{}: its last line has no end, as after a power failure: the file that it was about is not checked",
        journal_path(run.root).string()));
  const int in_hand = std::max(newest + 1, journal->first_frame());
  int before = 0;  // number of files of frames before the journal's first frame
  std::vector<std::pair<std::string, int>> unlisted;  // paths and frames of files after the newest checkpoint
  for (const std::string& name : files_of_run(run)) {
    if (entries.contains(name)) continue;
    const int frame = frame_of(name);
    const std::string path = (run.root / name).string();
    if (frame >= 0 && frame < journal->first_frame())
      ++before;
    else if (fs::path(name).parent_path() == "image" && frame <= in_hand)
      check.notes.push_back(path + not_whole);
    else if (frame > newest || newest < 0)
      unlisted.emplace_back(path, frame);
    else
      check.faults.push_back(path + not_listed);
  }
  // A simulation lists each file before it writes the next one, so that at most the frame in hand is not
  // listed.
  constexpr std::size_t most_unlisted = 2;
  for (const auto& [path, frame] : unlisted)
    if (unlisted.size() <= most_unlisted && frame <= in_hand)
      check.notes.push_back(path + not_whole);
    else
      check.faults.push_back(path + not_listed);
  if (before > 0)
    check.notes.push_back(
        fmt::format("{}: lists files from frame {} on; {} of earlier frames are not checked",
                    journal_path(run.root).string(), journal->first_frame(), before));
  return check;
}

}  // namespace

std::string frames_text(const std::vector<int>& frames) {
  std::string text;
  for (std::size_t i = 0, end = 0; i < frames.size(); i = end) {
    for (end = i + 1; end < frames.size() && frames[end] == frames[end - 1] + 1;) ++end;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", frames[i]);
    if (end > i + 1) text += fmt::format(" to {}", frames[end - 1]);
  }
  return (frames.size() == 1 ? "frame " : "frames ") + text;
}

std::string missing_text(const std::vector<int>& frames) {
  if (frames.empty()) return {};
  return fmt::format("; {} {} not there", frames_text(frames), frames.size() == 1 ? "is" : "are");
}

RunCheck check_run(const RunDirectory& run) {
  // Returns the size of the journal and its parts; 0 if there is none.
  const auto journal_size = [&] {
    std::error_code missing;
    std::uintmax_t size = fs::file_size(journal_path(run.root), missing);
    if (missing) size = 0;
    for (const fs::path& part : files_in(run.root / "journal"))
      if (const std::uintmax_t more = fs::file_size(part, missing); !missing) size += more;
    return size;
  };
  // A simulation that goes on meanwhile replaces and removes files, which looks like faults. It appends to
  // the journal when it does so, and a simulation anew removes the journal: the check is repeated until the
  // journal has the same size before and after it.
  RunCheck check;
  std::uintmax_t before = 0, after = journal_size();
  do {
    before = after;
    check = check_once(run);
    after = journal_size();
  } while (!check.faults.empty() && after != before);
  return check;
}

std::vector<std::string> faults_of_kept(const RunDirectory& run, int last) {
  std::vector<std::string> faults;
  if (run.journal)
    for (const auto& [name, entry] : run.journal->entries()) {
      const fs::path folder = fs::path(name).parent_path();
      const int frame = frame_of(name);
      const bool is_kept =
          (folder == "mesh" || folder == "levelset" || folder == "values") && frame >= 0 && frame <= last;
      if (!is_kept && !(is_growing(name) && folder.empty())) continue;
      if (std::string fault = fault_of(run, *run.journal, name); !fault.empty())
        faults.push_back(std::move(fault));
    }
  std::vector<int> missing;
  const std::vector<int> frames =
      fs::exists(run.stats()) ? frames_of_lines(read_file(run.stats())) : std::vector<int>();
  const std::set<int> known(frames.begin(), frames.end());
  for (int frame = 0; frame <= last; ++frame)
    if (!known.contains(frame)) missing.push_back(frame);
  if (!missing.empty())
    faults.push_back(fmt::format("{}: lacks {}", run.stats().string(), frames_text(missing)));
  return faults;
}

}  // namespace duet::io
