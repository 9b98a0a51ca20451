// The journal of a run and its parts. The first piece of the input is journal.jsonl, the others, after form
// feeds, are parts. The folder has one more file, which journals may list.
#include <string>

#include "tests/fuzz/harness.h"

#include "sim/io/run_check.h"
#include "sim/io/run_journal.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto root = fuzz::memory_folder() / "run";
  std::filesystem::remove_all(root);
  std::string rest = fuzz::text_of(data, size);
  fuzz::write_file("run/mesh/0000.obj", "o ball\n");
  for (int part = 0; part < 4; ++part) {
    const std::size_t end = rest.find('\f');
    fuzz::write_file(
        part == 0 ? "run/journal.jsonl" : "run/journal/host-1-1-" + std::to_string(part) + ".jsonl",
        rest.substr(0, end));
    if (end == std::string::npos) break;
    rest.erase(0, end + 1);
  }
  fuzz::is_accepted([&] { static_cast<void>(io::check_run(io::RunDirectory{root, {}})); });
  fuzz::is_accepted([&] { static_cast<void>(io::RunJournal::writers_of_parts(root)); });
  // The program that continues the run merges the parts. What it leaves can be read without new faults.
  std::size_t faults = 0;
  const bool opened = fuzz::is_accepted([&] { faults = io::RunJournal::open(root, 0)->faults().size(); });
  if (opened && io::RunJournal::read(root)->faults().size() > faults + 1)
    fuzz::report_finding("a journal has more faults after it was opened");
  return 0;
}
