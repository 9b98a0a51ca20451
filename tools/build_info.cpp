#include "tools/build_info.h"

#include <fstream>
#include <thread>

#include "tools/processor/processor.h"
#include "tools/version.h"
#include <fmt/format.h>
#include <sys/utsname.h>

#include "sim/base/numerics.h"

namespace duet::tools {

std::string compiler_text() {
#if defined(__clang__)
  return fmt::format("clang++ {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#elif defined(__GNUC__)
  return fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#else
  return "unknown compiler";
#endif
}

std::string variant_text() {
#if defined(__x86_64__)
  const std::string code = processor::level_name(processor::level_of(processor::required_features));
#else
  const std::string code = DUET_ARCHITECTURE;
#endif
  return std::string(DUET_MARCH) == "native" ? fmt::format("native ({})", code) : code;
}

std::string machine_text() {
  std::ifstream cpus("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(cpus, line))
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) {
      model = line.substr(line.find(": ") + 2);
      break;
    }
  utsname system{};
  ::uname(&system);
  return fmt::format("{}, {} hardware threads, {} {}", model, std::thread::hardware_concurrency(),
                     system.sysname, system.machine);
}

std::string version_text() {
  return fmt::format("duet {} ({}), {}, {}, numerics {}", version, git_commit, compiler_text(),
                     variant_text(), numerics_version);
}

}  // namespace duet::tools
