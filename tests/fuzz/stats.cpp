// stats.jsonl and hashes.jsonl: what continues a run, reports on it or compares it reads them.
#include "tests/fuzz/harness.h"
#include "tools/farm/status.h"

#include "sim/io/run_check.h"
#include "sim/io/stage_log.h"
#include "sim/io/stats_log.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  const io::RunDirectory run{fuzz::memory_folder(), {}};
  fuzz::write_file("stats.jsonl", text);
  fuzz::write_file("hashes.jsonl", text);
  static const farm::Plan plan = [&] {
    io::Manifest manifest;
    manifest.scene = "fuzz.toml";
    manifest.frames = 9;
    io::write_manifest(run, manifest);
    farm::Plan result;
    result.folder = run.root / "farm";
    result.runs = {{run.root, {}, {}}};
    return result;
  }();
  fuzz::is_accepted([&] { static_cast<void>(farm::examine(plan)); });
  fuzz::is_accepted([&] { static_cast<void>(io::recorded_hash(run, 1)); });
  fuzz::is_accepted([&] { static_cast<void>(io::faults_of_kept(run, 3)); });
  fuzz::is_accepted([&] {
    const io::StageComparison comparison = io::compare_stages(run, run);
    if (comparison.difference || !comparison.same_length)
      fuzz::report_finding("a run differs from itself: " + comparison.text());
  });
  // The program that continues a run keeps the lines of frames up to the last checkpoint, and no others.
  fuzz::is_accepted([&] {
    FrameStats next;
    next.frame = 4;
    io::StatsLog(run, 3).append(next);
  });
  const std::vector<int> frames = io::frames_of_lines(io::read_file(run.stats()));
  if (frames.empty() || frames.back() != 4) fuzz::report_finding("the line of frame 4 is not the last one");
  for (std::size_t i = 0; i + 1 < frames.size(); ++i)
    if (frames[i] > 3) fuzz::report_finding("a line after the last frame was kept");
  return 0;
}
