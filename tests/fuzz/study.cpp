// Specs of studies.
#include "tests/fuzz/harness.h"
#include "tools/study/spec.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto path = fuzz::write_file("study.toml", fuzz::text_of(data, size));
  fuzz::is_accepted([&] { static_cast<void>(study::read_spec(path.string())); });
  return 0;
}
