// `duet report`: writes one run as an HTML page.
#include "tools/commands.h"
#include "tools/scene_files.h"
#include "tools/study/charts.h"
#include "tools/study/run_page.h"

#include "sim/base/files.h"

namespace duet::tools {

Outcome report_run(const ReportOptions& options) {
  study::require_gnuplot();
  const io::RunDirectory run = find_run(options.run);
  const std::filesystem::path folder = run.root / "report";
  const std::filesystem::path file = folder / "report.html";
  io::write_atomically(file, study::run_page(run, folder));
  return {ExitStatus::done, file.string()};
}

}  // namespace duet::tools
