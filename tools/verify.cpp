// `duet verify`: compares the files of a run with the journal of what it wrote.
#include "tools/commands.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/base/wording.h"
#include "sim/io/run_check.h"

namespace duet::tools {

Outcome verify(const VerifyOptions& options, Report& report) {
  const io::RunDirectory run = find_run(options.run);
  const io::RunCheck check = io::check_run(run);
  for (const std::string& note : check.notes) report.note(note);
  for (const std::string& fault : check.faults) report.error(fault);
  const std::string whole = fmt::format("{} of {} {} as written", counted(as_index(check.whole), "file"),
                                        run.root.string(), check.whole == 1 ? "is" : "are");
  if (check.faults.empty()) return {ExitStatus::done, whole};
  return {ExitStatus::files, fmt::format("{} damaged, missing or unknown; {}", check.faults.size(), whole)};
}

}  // namespace duet::tools
