#include "sim/io/run_folder.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/io/line_log.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

using NumberedFiles = std::array<std::pair<fs::path, const char*>, 5>;

// Returns the folders of the files that have the number of a frame as name, and the extensions of these
// files.
NumberedFiles numbered_files(const RunDirectory& run) {
  return {{{run.root / "mesh", ".obj"},
           {run.root / "levelset", ".vdb"},
           {run.root / "values", ".npy"},
           {run.root / "image", ".png"},
           {run.checkpoint(), ".bin"}}};
}

// Removes the numbered files of a folder; other files stay.
void remove_frames(const fs::path& folder, const std::string& extension) {
  for (const fs::path& path : files_in(folder))
    if (frame_of_file(path, extension) >= 0) remove_file(path);
}

// Throws FileError unless the folder is one to which a simulation may write. It holds a run with a readable
// manifest, or nothing but temporary files and a journal, which a program may leave that is killed before
// it writes the manifest.
void require_run_or_empty(const RunDirectory& run) {
  std::error_code error;
  const fs::directory_iterator entries(run.root, error);
  if (error) throw system_error(run.root, "cannot read the folder", error.value());
  const bool empty = std::all_of(begin(entries), end(entries), [&](const fs::directory_entry& entry) {
    return is_temporary(entry.path()) || entry.path() == journal_path(run.root);
  });
  if (empty) return;
  if (!fs::exists(run.manifest()))
    throw FileError(run.root.string(), "the folder holds files that are not of a run, and stays untouched",
                    "choose another folder with --out");
  read_manifest(run);
}

void write_description(const RunDirectory& run, const Manifest& manifest, const std::string& scene_source) {
  write_manifest(run, manifest);
  run.write(run.scene(), scene_source);
  for (const auto& [folder, extension] : numbered_files(run)) create_folder(folder);
}

}  // namespace

HeldRun held_run(const RunDirectory& run) {
  HeldRun held;
  for (const auto& [folder, extension] : numbered_files(run))
    for (const fs::path& path : files_in(folder))
      if (const int frame = frame_of_file(path, extension); frame >= 0) held.frames.insert(frame);
  if (fs::exists(run.stats()))
    for (const int frame : frames_of_lines(read_file(run.stats()))) held.frames.insert(frame);
  held.has_video = fs::exists(run.manifest()) && fs::exists(video_path(run, read_manifest(run)));
  return held;
}

RunLock::RunLock(const RunDirectory& run) : root_(run.root) {
  create_folder(run.root);
  require_run_or_empty(run);
  folder_ = ::open(run.root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_ < 0) throw system_error(run.root, "cannot open the folder", errno);
  // File systems without locks fail in other ways, which are ignored: the lock is only a safeguard.
  if (::flock(folder_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(folder_);
    throw FileError(run.root.string(), "another simulation is writing to this folder",
                    "wait for it, or choose another folder with --out");
  }
}

RunLock::~RunLock() {
  ::rmdir(root_.c_str());  // fails if the folder is not empty
  ::close(folder_);
}

void clear_run(const RunDirectory& run) {
  if (fs::exists(run.manifest())) remove_file(video_path(run, read_manifest(run)));
  for (const auto& [folder, extension] : numbered_files(run)) remove_frames(folder, extension);
  remove_file(run.static_level_sets());
  remove_file(run.body_values());
  remove_file(run.stats());
  remove_file(run.stage_hashes());
  // The journal goes last: if the program is killed before, the rest of the run is still checked.
  remove_file(journal_path(run.root));
}

void continue_run(const RunDirectory& run, const Manifest& manifest, const std::string& scene_source) {
  remove_temporaries(run.root);
  for (const auto& [folder, extension] : numbered_files(run)) remove_temporaries(folder);
  write_description(run, manifest, scene_source);
}

fs::path video_path(const RunDirectory& run, const Manifest& manifest) {
  return run.root / fs::path(manifest.scene).stem().replace_extension(".mp4");
}

}  // namespace duet::io
