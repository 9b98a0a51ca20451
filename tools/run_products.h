// Removes a run from its folder, together with what commands made of it: exports, the page for browsers and
// the report.
#pragma once

#include "tools/report.h"

#include "sim/io/run_directory.h"

namespace duet::tools {

/// Removes an earlier run from its folder: what io::clear_run() removes, then view.html, the report and the
/// exports in export/, which show the removed frames. Removes only files that the commands wrote, as their
/// names and beginnings tell, and notes the others, such as a .blend file, which somebody may have edited.
/// Throws FileError.
void replace_run(const io::RunDirectory& run, Report& report);

}  // namespace duet::tools
