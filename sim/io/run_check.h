// Compares the files of a run with the lengths and hashes that its journal lists.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"

namespace duet::io {

/// Result of check_run().
struct RunCheck {
  int whole = 0;                    ///< number of files that are as the journal lists them
  std::vector<std::string> faults;  ///< one sentence a file: "out/stack/mesh/0003.obj: is missing"
  std::vector<std::string> notes;   ///< sentences about files that are not checked, with the reason
};

/// Compares every file that the run's journal lists, and looks for files of a run that it does not list. A
/// run without a journal has one fault that says so. Files that are not listed and belong to the frame after
/// the newest checkpoint are notes, not faults, if they are at most two: a program may be writing them, or
/// was killed while it did. More of them mean that the journal has lost lines. Files whose names no run gives
/// are not looked at. If a simulation goes on
/// meanwhile, a check with faults is repeated until the journal stays as it is. A journal that is removed
/// meanwhile is missing. Throws FileError if the journal cannot be read.
RunCheck check_run(const RunDirectory& run);

/// Returns the faults of the files that a run keeps when it is continued after frame `last`: meshes, values
/// and level sets of frames up to `last`, and the statistics and stage hashes. Statistics that lack a frame
/// are a fault, too. Pictures are not checked, because damaged ones are drawn again. Checks only the
/// statistics' frames if the run has no journal. Throws FileError if the statistics cannot be read.
std::vector<std::string> faults_of_kept(const RunDirectory& run, int last);

/// Returns a phrase that names frames, which are given in ascending order: "frame 3", "frames 3 to 5, 7".
std::string frames_text(const std::vector<int>& frames);

/// Returns the end of an outcome that names frames which a run does not have: "; frames 3 to 5 are not
/// there". The text is empty if there are none.
std::string missing_text(const std::vector<int>& frames);

}  // namespace duet::io
