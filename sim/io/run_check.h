// Compares the files of a run with its journal.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"

namespace duet::io {

struct RunCheck {
  int whole = 0;                    ///< files that are what the journal lists
  std::vector<std::string> faults;  ///< "out/stack/mesh/0003.obj: is missing", a sentence a file
  std::vector<std::string> notes;   ///< what is not checked, and why
};

/// Looks at every file that the journal lists and at every file of a run that it does not list. A run without
/// a journal has that as its fault. Files of the frame after the newest checkpoint may be of a program that
/// writes them, or was killed meanwhile: they are notes. Throws FileError where the journal cannot be read.
RunCheck check_run(const RunDirectory& run);

/// The faults of what a run that goes on after frame `last` keeps: meshes and level sets up to that frame,
/// and statistics and hashes of stages that are there. Pictures are drawn again where they are damaged.
/// Statistics that lack a frame are a fault, too.
std::vector<std::string> faults_of_kept(const RunDirectory& run, int last);

/// "frame 3", "frames 3 to 5, 7"; the frames in order.
std::string frames_text(const std::vector<int>& frames);

}  // namespace duet::io
