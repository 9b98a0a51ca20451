#include "sim/io/run_folder.h"

#include <algorithm>
#include <array>
#include <utility>

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
// manifest, or nothing but temporary files, a journal and a claim, which a program may leave that is killed
// before it writes the manifest.
void require_run_or_empty(const RunDirectory& run) {
  std::error_code error;
  const fs::directory_iterator entries(run.root, error);
  if (error) throw system_error(run.root, "cannot read the folder", error.value());
  const bool empty = std::all_of(begin(entries), end(entries), [&](const fs::directory_entry& entry) {
    return is_temporary(entry.path()) || entry.path() == journal_path(run.root) ||
           entry.path() == run.root / "claim" || entry.path() == run.root / "journal";
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

RunLock::RunLock(const RunDirectory& run, const std::string& work, double wait) : root_(run.root) {
  create_folder(run.root);
  require_run_or_empty(run);
  claim_ = std::make_unique<RunClaim>(run.root, work, wait);
}

RunLock::~RunLock() {
  claim_.reset();
  ::rmdir(root_.c_str());  // fails if the folder is not empty
}

void clear_run(const RunDirectory& run) {
  if (fs::exists(run.manifest())) remove_file(video_path(run, read_manifest(run)));
  for (const auto& [folder, extension] : numbered_files(run)) remove_frames(folder, extension);
  remove_file(run.static_level_sets());
  remove_file(run.body_values());
  remove_file(run.stats());
  remove_file(run.stage_hashes());
  for (const fs::path& part : files_in(run.root / "journal")) remove_file(part);
  // The journal goes last: if the program is killed before, the rest of the run is still checked.
  remove_file(journal_path(run.root));
}

void continue_run(const RunDirectory& run, const Manifest& manifest, const std::string& scene_source) {
  const std::set<long> writers = RunJournal::writers_of_parts(run.root);
  remove_temporaries(run.root, writers);
  for (const auto& [folder, extension] : numbered_files(run)) remove_temporaries(folder, writers);
  write_description(run, manifest, scene_source);
}

fs::path video_path(const RunDirectory& run, const Manifest& manifest) {
  return run.root / fs::path(manifest.scene).stem().replace_extension(".mp4");
}

}  // namespace duet::io
